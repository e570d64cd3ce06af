"""Stored results as typed values again: the inverse of `dataclasses.asdict`."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from slipstick.errors import InvalidValue

_Record = TypeVar("_Record")


def from_dict(kind: type[_Record], values: Mapping[str, Any]) -> _Record:
    """The record of a `kind` whose `asdict` is `values`; raises `InvalidValue` if a field is missing."""
    record: _Record = _to_type(kind, values)
    return record


def _to_type(kind: Any, value: Any) -> Any:
    """`value` with mappings replaced by the data classes that the annotation `kind` names."""
    if value is None:
        return None
    if is_dataclass(kind):
        return _to_record(kind, value)
    inner = [argument for argument in get_args(kind) if argument is not NoneType]
    if get_origin(kind) is list:
        return [_to_type(inner[0], entry) for entry in value]
    if get_origin(kind) is dict:
        return {name: _to_type(inner[1], entry) for name, entry in value.items()}
    # What is left with a single argument is `kind | None`; a Literal and a plain type hold the value itself.
    return _to_type(inner[0], value) if NoneType in get_args(kind) else value


def _to_record(kind: Any, values: Mapping[str, Any]) -> Any:
    hints = get_type_hints(kind)
    missing = [field.name for field in fields(kind)
               if field.name not in values and field.default is MISSING and field.default_factory is MISSING]
    if missing:
        raise InvalidValue(f"The stored {kind.__name__} has no '{missing[0]}'",
                           "Repeat the study: the result is that of another version")
    return kind(**{field.name: _to_type(hints[field.name], values[field.name])
                   for field in fields(kind) if field.name in values})
