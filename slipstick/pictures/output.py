"""What a model predicts, in words and in the unit in which it is shown: shifting times, or another machine's output."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slipstick.pictures import units
from slipstick.pictures.theme import in_words


@dataclass(frozen=True)
class Output:
    """An output `name` in `unit`; small values and differences of it are shown in `small`, `factor` to one `unit`."""

    name: str
    unit: str

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Output":
        """The output that the figure data of a fit or the answer to a propagation names; shifting times by default."""
        given = data.get("output")
        return cls(given["name"], given["unit"]) if given else SHIFTING_TIME

    @property
    def words(self) -> str:
        """The name with spaces."""
        return in_words(self.name)

    @property
    def small(self) -> str:
        """The unit of differences and standard deviations."""
        return "ms" if self.unit == "s" else units.raised(self.unit)

    @property
    def factor(self) -> float:
        """From `unit` to `small`."""
        return 1e3 if self.unit == "s" else 1.0

    @property
    def per(self) -> str:
        """What probability densities are per: a thousandth of the unit."""
        return "ms" if self.unit == "s" else f"0.001 {units.raised(self.unit)}"

    @property
    def plural(self) -> str:
        """Several of them."""
        return "times" if self.name == "shifting_time" else "values"

    @property
    def measured(self) -> str:
        """What it was measured of, several of them."""
        return "engagements" if self.name == "shifting_time" else "measurements"

    @property
    def more(self) -> str:
        """Larger, of times."""
        return "later" if self.unit == "s" else "larger"

    @property
    def less(self) -> str:
        """Smaller, of times."""
        return "earlier" if self.unit == "s" else "smaller"

    @property
    def later(self) -> str:
        """What a positive difference, measured minus predicted, means."""
        return "the test bench locks later than the model" if self.name == "shifting_time" else \
            f"the measured {self.words} is larger than that of the model"

    @property
    def missing(self) -> str:
        """Why there is no output."""
        return "may never lock" if self.name == "shifting_time" else f"may have no {self.words}"


SHIFTING_TIME = Output("shifting_time", "s")
