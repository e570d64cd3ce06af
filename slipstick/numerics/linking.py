"""A compiler of numba for functions that only compiled functions call: machine code is made of entry points alone.

Numba optimizes each function with all that it calls, and makes machine code of it, before it compiles the caller; a
function in the tenth level of calls is optimized and emitted ten times. Here nothing is made of a function but the
intermediate code that is linked into that of its callers. An entry point contains everything, is optimized as a whole,
and computes the same.

Where a version of numba lacks what is used of its libraries here, functions are compiled as usual.
"""

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from types import CellType, FunctionType
from typing import Any

from llvmlite import binding
from numba import njit
from numba.core.codegen import JITCodeLibrary

from slipstick.numerics.wide_vectors import WideCompiler, WideLibrary

_ENVIRONMENT = "_ZN08NumbaEnv"
"""How names of variables begin that point to the environment of a function, into which numba writes that address."""


class _Library(WideLibrary):
    """The intermediate code of a function."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        """Make machine code of the variables of environments only: modules share them by their names."""
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        variables = [variable.name for variable in self._final_module.global_variables
                     if variable.name.startswith(_ENVIRONMENT)]
        lines = [f'@"{name}" = common global i64 0' for name in variables]  # pointers have no notation of all versions
        self._codegen._add_module(binding.parse_assembly("\n".join(lines)))
        self._codegen._engine.finalize_object()
        self._finalized = True


class Linked(WideCompiler):
    """The compiler."""

    library = _Library


_USED = ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals",
         "_verify_declare_only_symbols")
LINKED: dict[str, Any] = {"pipeline_class": Linked} if all(hasattr(JITCodeLibrary, name) for name in _USED) else {}
"""Options of `njit`."""


def linked(function: Callable[..., Any]) -> Any:
    """Compile a function with the callers that are compiled; it cannot be called from Python, and needs no cache."""
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cpython_wrapper": True,
                               "no_cfunc_wrapper": True, **LINKED}
    return njit(**options)(function)


def digest_files(paths: Iterable[Path], further: str = "") -> str:
    """SHA-256 of source files, and of a further text: a key of the machine code that is made of them."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths) + further.encode()).hexdigest()


def with_key(key: str, function: Callable[..., None]) -> Callable[..., None]:
    """Return a copy of an entry point with a key in its closure, which the index of numba's cache covers.

    Without one, the index covers the file that defines the function alone. A function around it would hold the key too,
    but numba would optimize and emit all that it calls once more for it.
    """
    assert isinstance(function, FunctionType)
    code = function.__code__.replace(co_freevars=("key",))
    return FunctionType(code, function.__globals__, function.__name__, None, (CellType(key),))
