"""The digest of what is declared: equal for equal declarations, whatever their comments, docstrings and layout."""

import dataclasses
import hashlib
from collections.abc import Callable, Mapping
from enum import Enum
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def digest(*declared: Any) -> str:
    """Return the SHA-256 of declarations, settings and numbers, with the code of their functions.

    Functions count with their constants, with what they enclose, and with the functions and values of their own module
    that they use; those of other modules count by their name. The digest depends on the version of Python, whose byte
    code it covers.
    """
    hashed = hashlib.sha256()
    _add(declared, hashed.update, {})
    return hashed.hexdigest()


def _add(value: Any, update: Callable[[bytes], None], seen: dict[int, int]) -> None:
    """Add a value, with its type and length, so that no two values add the same bytes; functions once, by number."""
    def add_all(kind: str, values: list[Any]) -> None:
        update(f"{kind} {len(values)};".encode())
        for each in values:
            _add(each, update, seen)

    if isinstance(value, FunctionType):
        if id(value) in seen:  # another one has it as well, or it calls itself
            update(f"again {seen[id(value)]};".encode())
            return
        seen[id(value)] = len(seen)
        code, own = value.__code__, value.__globals__
        enclosed = dict(zip(code.co_freevars, (cell.cell_contents for cell in value.__closure__ or ()), strict=True))
        used = {name: own[name] for name in sorted(_list_names(code)) if name in own}
        add_all("function", [_WithoutText(code, value.__doc__), value.__defaults__, value.__kwdefaults__, enclosed, {
            name: each if getattr(each, "__module__", value.__module__) == value.__module__ else _name(each)
            for name, each in used.items()}])
    elif isinstance(value, _WithoutText):
        consts = [None if each == value.docstring else each for each in value.code.co_consts]
        add_all("code", [value.code.co_code, value.code.co_names, value.code.co_varnames, *(
            _WithoutText(each, None) if isinstance(each, CodeType) else each for each in consts)])
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        add_all(type(value).__name__, [[field.name, getattr(value, field.name)] for field in dataclasses.fields(value)])
    elif isinstance(value, Mapping):
        add_all("mapping", [[key, value[key]] for key in sorted(value, key=repr)])
    elif isinstance(value, (set, frozenset)):
        add_all("set", sorted(value, key=repr))
    elif isinstance(value, (list, tuple)):
        add_all("sequence", list(value))
    elif isinstance(value, np.ndarray):
        add_all("array", [value.shape, str(value.dtype), np.ascontiguousarray(value).tobytes()])
    elif isinstance(value, (type, ModuleType, Enum)) or (callable(value) and hasattr(value, "__name__")):
        add_all("name", [_name(value)])
    else:
        text = value if isinstance(value, bytes) else repr(value).encode()
        update(f"{type(value).__name__} {len(text)};".encode() + text)


@dataclasses.dataclass(frozen=True)
class _WithoutText:
    """The code of a function with this docstring."""

    code: CodeType
    docstring: str | None


def _list_names(code: CodeType) -> set[str]:
    """Return the names that a function and those in it may take from their module."""
    return set(code.co_names).union(*(_list_names(each) for each in code.co_consts if isinstance(each, CodeType)))


def _name(value: Any) -> str:
    """Return by what name a value of another module is known."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", repr(value)))
    return f"{getattr(value, '__module__', '')}.{name}"
