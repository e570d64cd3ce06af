"""The model of a table that another program computed: its description is kept, and it is not simulated here."""

import hashlib
import json
from dataclasses import dataclass
from typing import Any

from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class ForeignModel:
    """A model of which only the description is known: `text`, a JSON object of texts, numbers and booleans.

    It has no key `bench`, which models of Slipstick have. Raises `InvalidValue` for another text.
    """

    text: str

    def __post_init__(self) -> None:
        """Bring the text into the form in which models are stored, so that equal descriptions are equal."""
        remedy = 'Give a JSON object of texts and numbers, such as {"name": "my machine"}'
        try:
            content = json.loads(self.text, parse_constant=_refuse)
            json.dumps(content, ensure_ascii=False).encode()  # raises for lone surrogates, which no response can hold
        except (ValueError, RecursionError) as error:
            raise InvalidValue(f"The description of the model is not JSON ({str(error)[:100]})", remedy) from error
        if not isinstance(content, dict) or "bench" in content or any(
                isinstance(value, dict | list | None) for value in content.values()):
            raise InvalidValue("The description of the model is no JSON object of texts and numbers, or it has the key "
                               "'bench', which marks a model of Slipstick", remedy)
        object.__setattr__(self, "text", json.dumps(content, sort_keys=True))

    def spec(self) -> dict[str, Any]:
        """The description as JSON."""
        content: dict[str, Any] = json.loads(self.text)
        return content

    @property
    def digest(self) -> str:
        """SHA-256 of the description: equal digests mean equal descriptions."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def uses_run_order(self) -> bool:
        """False: the run order is no condition of such a table."""
        return False


TableModel = Model | ForeignModel
"""The model of a table."""


def simulated(model: TableModel) -> Model:
    """Return a model that can be simulated; raises `InvalidValue` for one of another program."""
    if isinstance(model, ForeignModel):
        raise InvalidValue("The table was computed by another program, whose model cannot be simulated here",
                           "Omit `simulate` and `bench`, and use the axes of the table")
    return model


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")
