"""What findings of all studies have: their names, and the measured law."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from slipstick.errors import InvalidValue
from slipstick.interface.files import write
from slipstick.interface.frames import data_frame
from slipstick.interface.picture import Picture
from slipstick.law_files import LawTable, write_law
from slipstick.machine_studies.result import MachineFinding
from slipstick.pictures.study import law
from slipstick.studies.export import file_stem
from slipstick.studies.finding import Changed
from slipstick.studies.finding import Law as StudyLaw
from slipstick.studies.result import FindingResult

_Result = TypeVar("_Result", FindingResult, MachineFinding)


@dataclass(frozen=True, eq=False)
class Law:
    """The measured law of a finding: the change of its quantity over what it depends on, without a formula.

    Its `table` is None for a single number. The intervals have the confidence `level`; `runs` is what was recorded.
    """

    finding: Changed
    table: LawTable | None
    level: float
    runs: str = "engagements"

    @property
    def x(self) -> list[float] | None:
        """Points at which the change was measured, in `x_unit`; None for a single number, such as a lag."""
        return self._law.x

    @property
    def x_unit(self) -> str:
        """Unit of the points."""
        return self._law.x_unit

    @property
    def change(self) -> list[float]:
        """Change of the quantity at the points, in `unit`."""
        return self._law.change

    @property
    def band(self) -> tuple[list[float], list[float]]:
        """Lower and upper end of the interval of the change at each point, in `unit`."""
        return self._law.lower, self._law.upper

    @property
    def unit(self) -> str:
        """Unit of the change, "1" if it is a share of the quantity."""
        return self._law.unit

    @property
    def formula(self) -> list[float] | None:
        """The change by the formula of the named effect at the points, in `unit`; None without a name."""
        return self._law.formula

    def plot(self) -> Picture:
        """The law with its band, and the formula of the named effect beside it."""
        drawn = law.draw_law(self.finding, self._law, self.level, self.runs)
        return Picture(file_stem(self.finding), drawn, drawn["description"])

    def to_frame(self) -> Any:
        """The columns of the law as a data frame, with units in the headings."""
        shown = self._law
        columns: dict[str, Sequence[Any]] = {} if shown.x is None else {
            f"{self.finding.depends_on} [{shown.x_unit}]": shown.x}
        columns |= {f"{name} [{shown.unit}]": values for name, values in (
            ("change", shown.change), ("lower", shown.lower), ("upper", shown.upper), ("formula", shown.formula))
            if values is not None}
        return data_frame(columns)

    def save(self, path: Path | str) -> Path:
        """Write the law as a file for another program, by the suffix of `path`, and return the path.

        That is `.csv`, `.mat` (MATLAB), `.mo` (a Modelica block with a table), or `.h` (a C header with a function).
        Raises `InvalidValue` for another suffix, and for a law that is a single number.
        """
        path = Path(path)
        if self.table is None:
            raise InvalidValue(f"The law of “{self.finding.title}” is a single number", "Read it from `change`")
        return write(path, write_law(self.table, path.suffix))

    @property
    def _law(self) -> StudyLaw:
        assert self.finding.law is not None
        return self.finding.law

    def __repr__(self) -> str:
        return f"<Law: {law.headline(self.finding, self._law)}>"


@dataclass(frozen=True, eq=False)
class NamedFinding(Generic[_Result]):
    """The names of a finding, which are in its `result`."""

    result: _Result

    @property
    def title(self) -> str:
        """The finding in words."""
        return self.result.title

    @property
    def effect(self) -> str | None:
        """Name of the effect, of the catalogue or declared by the machine; None if none explains the law."""
        return self.result.effect

    @property
    def quantity(self) -> str:
        """Quantity of the model that changes."""
        return self.result.quantity

    @property
    def depends_on(self) -> str:
        """What the change depends on."""
        return self.result.depends_on

    def __repr__(self) -> str:
        return f"<Finding: {self.title}>"
