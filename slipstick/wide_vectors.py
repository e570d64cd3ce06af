"""A compiler of numba whose loops use the widest vectors of the processor.

LLVM prefers vectors of 256 bits on processors with AVX-512, because early ones lower their clock for wider ones. The
loops of this project are long and free of branches, and gain more than that. `pipeline_class` is numba's documented way
to change its passes. After a change of this file, empty the cache of numba, which watches only the files of the
functions that it stores.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.typed_passes import AnnotateTypes

_WIDTH = '"prefer-vector-width"="512"'


class WideLibrary(JITCodeLibrary):
    """The code of a function and of those that it calls."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Add a module of intermediate code."""
        for function in ir_module.functions:
            set.add(function.attributes, _WIDTH)  # their own `add` refuses attributes that llvmlite does not know
        super().add_ir_module(ir_module)


class ChooseLibrary(LoweringPass):
    """Create the library of a function before lowering, which would create a usual one if there were none."""

    _name = "choose_library"
    library: type[JITCodeLibrary]

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Create the library, whose machine code can be cached."""
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


class LibraryCompiler(CompilerBase):
    """The usual passes, and the choice of the library in front of lowering."""

    choice: type[ChooseLibrary]

    def define_pipelines(self) -> list[PassManager]:
        """The passes."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.add_pass_after(self.choice, AnnotateTypes)
        manager.finalize()
        return [manager]


@register_pass(mutates_CFG=False, analysis_only=False)
class _ChooseWide(ChooseLibrary):
    _name = "choose_wide_library"
    library = WideLibrary


class WideCompiler(LibraryCompiler):
    """The compiler."""

    choice = _ChooseWide
