"""Models in JSON files, as `calibrate --out` and `study --extended` write them."""

import json
from pathlib import Path

from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue


def read_model(path: Path) -> Model:
    """Model from a JSON file, at its top level or under "model"; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return Model.from_spec(content.get("model", content))
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise InvalidValue(f"Cannot read a model from '{path}' ({type(error).__name__}: {error})",
                           "Give the JSON that `calibrate --out` or `study --extended` writes") from error
