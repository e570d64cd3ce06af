"""What functions take as bench, recordings, model and conditions: values, names, files, or results that have them."""

import json
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any, Protocol

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.numerics.quantities import NotAQuantity, in_unit
from slipstick.recordings import Recordings


class HasModel(Protocol):
    """A result with a model, such as that of a calibration."""

    @property
    def model(self) -> Model:
        """The model."""


ModelLike = Model | HasModel | Path | str
"""A model, a result that has one, or the JSON file of a model, calibration or extended model."""


BenchLike = Bench | Path | str
"""A bench, the name of a shipped one, or the path of a file."""
RecordingsLike = Recordings | Path | str
"""Recordings, the name of shipped ones, or the path of a file."""


def describe(given: object) -> str:
    """The type of an argument, and its value if that is short in words."""
    value = f" {given!r:.60}" if isinstance(given, str | int | float | list | tuple | dict | None) else ""
    return f"The {type(given).__name__}{value}"


def bench_of(given: BenchLike) -> Bench:
    """The bench that is `given`, or that of a name or a file; raises `InvalidValue`, `BadBench` and `UnknownName`."""
    bench = Bench.open(given) if isinstance(given, Path | str) else given
    if not isinstance(bench, Bench):
        raise InvalidValue(f"{describe(given)} is not a bench",
                           'Give a Bench, the name of a shipped one, such as "heavy", or the path of a file')
    return bench


def recordings_of(bench: Bench, given: RecordingsLike) -> Recordings:
    """The recordings that are `given`, or those of a name or a file, whose current profiles are those of the bench.

    Raises `InvalidValue`, `BadRecording` and `UnknownName`.
    """
    recordings = Recordings.open(given, profiles=bench.profiles) if isinstance(given, Path | str) else given
    if not isinstance(recordings, Recordings):
        raise InvalidValue(f"{describe(given)} is not recordings",
                           'Give Recordings, the name of shipped ones, such as "sample", or the path of a file')
    return recordings


def in_unit_of(given: float | str, unit: str, name: str) -> float:
    """A number in `unit`, or a text such as "3 ms", in that unit; raises `InvalidValue` with the argument's `name`."""
    try:
        return in_unit(given if isinstance(given, str) else f"{given} {unit}", unit)
    except NotAQuantity as error:
        raise InvalidValue(f"`{name}` is {given!r}: {error}", f'Give a number in {unit}, or a text with a unit') \
            from None


def as_mapping(settings: Any) -> dict[str, Any]:
    """Settings, a data class, a mapping or None, as a mapping; raises `InvalidValue`."""
    if settings is None:
        return {}
    if is_dataclass(settings) and not isinstance(settings, type):
        return asdict(settings)
    if not isinstance(settings, Mapping):
        raise InvalidValue(f"The settings are {settings!r:.60}", 'Give a mapping, such as {"level": 0.95}')
    return dict(settings)


def model_of(bench: Bench, given: ModelLike | None) -> Model:
    """The model that is `given`, by default the nominal one of the bench.

    Raises `InvalidValue`, also for a model of another bench, and `UnknownName` for an effect that is not known.
    """
    if given is None:
        return Model(bench.physics)
    model = read_model(given) if isinstance(given, Path | str) else getattr(given, "model", given)
    if not isinstance(model, Model):
        raise InvalidValue(f"{describe(given)} is not a model",
                           "Give a Model, such as `extended` or `refitted` of a study, or the result of a calibration")
    bench.require(model.physics)
    return model


def conditions_of(bench: Bench, given: Conditions | Recordings | None) -> Conditions:
    """The conditions that are `given`, or those of recordings; by default those of the bench."""
    if given is None:
        return bench.conditions
    conditions = given.conditions if isinstance(given, Recordings) else given
    if not isinstance(conditions, Conditions):
        raise InvalidValue(f"A {type(given).__name__} is not conditions", "Give Conditions, or Recordings with them")
    return conditions


def read_model(path: Path | str) -> Model:
    """Model from a JSON file, at its top level or under "model"; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(Path(path).read_text())
    except (OSError, ValueError) as error:
        raise _no_model(f"'{path}'", error) from error
    return parse_model(content, f"'{path}'")


def parse_model(content: Any, source: str) -> Model:
    """Model from JSON, at its top level or under "model"; raises `InvalidValue`, `UnknownName`."""
    try:
        return Model.from_spec(content.get("model", content))
    except (ValueError, AttributeError, KeyError, TypeError) as error:
        raise _no_model(source, error) from error


def _no_model(source: str, error: Exception) -> InvalidValue:
    return InvalidValue(f"Cannot read a model from {source} ({type(error).__name__}: {error})",
                        "Give the JSON of a calibration (`calibrate --out`) or of a study (`study --extended`)")
