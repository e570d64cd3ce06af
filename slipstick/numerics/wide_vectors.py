"""A compiler of numba whose loops use the widest vectors of the processor.

LLVM prefers vectors of 256 bits on Intel's processors with AVX-512, because early ones lower their clock for wider
ones. The loops of this project are long and free of branches, and gain more than that. `pipeline_class` is numba's
documented way to change its passes. After a change of this file, empty the cache of numba, which watches only the files
of the functions that it stores.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager

_WIDTH = '"prefer-vector-width"="512"'


class WideLibrary(JITCodeLibrary):
    """The code of a function and of those that it calls."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Add a module of intermediate code."""
        for function in ir_module.functions:
            set.add(function.attributes, _WIDTH)  # their own `add` refuses attributes that llvmlite does not know
        super().add_ir_module(ir_module)


class WideCompiler(CompilerBase):
    """The usual passes with a `library`, for which lowering would create a usual one if there were none."""

    library: type[JITCodeLibrary] = WideLibrary

    def define_pipelines(self) -> list[PassManager]:
        """The passes, and the library in which they leave the code, which can be cached."""
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]
