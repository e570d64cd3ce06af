"""What functions take as a model and as conditions: values, files, or results that have them."""

import json
from pathlib import Path
from typing import Protocol

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings


class HasModel(Protocol):
    """A result with a model, such as that of a calibration."""

    @property
    def model(self) -> Model:
        """The model."""


ModelLike = Model | HasModel | Path | str
"""A model, a result that has one, or the JSON file of a model, calibration or extended model."""


def model_of(bench: Bench, given: ModelLike | None) -> Model:
    """The model that is `given`, by default the nominal one of the bench.

    Raises `InvalidValue`, also for a model of another bench, and `UnknownName` for an effect that is not known.
    """
    if given is None:
        return Model(bench.physics)
    model = read_model(given) if isinstance(given, Path | str) else getattr(given, "model", given)
    if not isinstance(model, Model):
        raise InvalidValue(f"A {type(given).__name__} is not a model",
                           "Give a Model, a result that has one, or the JSON file that `calibrate` or `study` wrote")
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
        return Model.from_spec(content.get("model", content))
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise InvalidValue(f"Cannot read a model from '{path}' ({type(error).__name__}: {error})",
                           "Give the JSON that `calibrate --out` or `study --extended` writes") from error
