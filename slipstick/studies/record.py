"""Stored results as typed values again: the inverse of `dataclasses.asdict`."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

from slipstick.errors import InvalidValue
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult


def result_from_dict(values: Mapping[str, Any]) -> StudyResult:
    """The result whose `asdict` is `values`; raises `InvalidValue` if a field is missing."""
    found: StudyResult = _typed(StudyResult, values)
    return found


def figures_from_dict(values: Mapping[str, Any]) -> Figures:
    """The figures whose `asdict` is `values`; raises `InvalidValue` if a field is missing."""
    found: Figures = _typed(Figures, values)
    return found


def _typed(kind: Any, value: Any) -> Any:
    """`value` with mappings replaced by the data classes that the annotation `kind` names."""
    if value is None:
        return None
    if is_dataclass(kind):
        return _record(kind, value)
    inner = [one for one in get_args(kind) if one is not NoneType]
    if get_origin(kind) is list:
        return [_typed(inner[0], one) for one in value]
    if get_origin(kind) is dict:
        return {name: _typed(inner[1], one) for name, one in value.items()}
    # What is left with a single argument is `kind | None`; a Literal and a plain type hold the value itself.
    return _typed(inner[0], value) if NoneType in get_args(kind) else value


def _record(kind: Any, values: Mapping[str, Any]) -> Any:
    hints = get_type_hints(kind)
    missing = [one.name for one in fields(kind)
               if one.name not in values and one.default is MISSING and one.default_factory is MISSING]
    if missing:
        raise InvalidValue(f"The stored {kind.__name__} has no '{missing[0]}'",
                           "Repeat the study: the result is that of another version")
    return kind(**{one.name: _typed(hints[one.name], values[one.name]) for one in fields(kind) if one.name in values})
