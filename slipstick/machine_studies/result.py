"""The result of a study of a declared machine. Reports, pictures and the service read it; the service adds nothing."""

from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

from slipstick.studies.finding import Coefficient, Law
from slipstick.time_budget import Partial

_DOCUMENTED = {"use_attribute_docstrings": True}


@dataclass(frozen=True)
class Rival:
    """Another pair of quantity and dependence that was fitted in place of a finding."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    title: str
    """The pair in words."""
    quantity: str
    """Quantity of the machine that would change."""
    depends_on: str
    """What the change would depend on."""
    nats: float | None = None
    """Its gain in log marginal likelihood, as far as it was fitted; null in results of earlier versions."""
    behind: float | None = None
    """Standard errors over the runs by which the finding leads it; null in results of earlier versions."""


@dataclass(frozen=True)
class MachineFinding:
    """Something that the recordings show and the model of the machine lacks."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    title: str
    """The finding in words."""
    quantity: str
    """Quantity of the machine that changes."""
    depends_on: str
    """What the change depends on."""
    effect: str | None
    """The effect of the machine by its name, where it declares one of this kind; null without one."""
    kind: str | None
    """The kind of effect that explains the law, such as Coulomb friction; null where the measured law explains more."""
    equation: str | None
    """The change by that kind, with its coefficients in numbers and units; null without one."""
    coefficients: list[Coefficient]
    """Coefficients of that kind with 95 % intervals; empty without one."""
    blocks: list[str]
    """Blocks of the machine that show it."""
    nats: float
    """Gain in log marginal likelihood."""
    errors: float
    """Standard errors in which the runs agree about it; of a finding in a few runs, the root of twice the nats that all
    but the best of them gain."""
    rivals: list[Rival]
    """Pairs that the recordings do not tell apart from it."""
    law: Law | None
    """The measured law; null where it is one of lags, or of the past of a signal."""
    confirmed: bool | None
    """Whether the simulation of the whole machine describes the recordings better with the findings; null for an error
    of a sensor, which changes nothing of the machine, for a law over a measured signal that the simulation does not
    have, and in a partial result."""
    next_best: Rival | None = None
    """The pair that gains most of those that it leads; null without one."""
    runs: list[int] = field(default_factory=list)
    """Runs, numbered from 0 as recorded, in which alone it acts: they are set aside, and like all others with it; empty
    where it acts in all."""


@dataclass(frozen=True)
class MachineBlock:
    """The result of a block of the machine, between the signals that it reads and gives."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    name: str
    """Name of the block."""
    signals: str
    """What it reads and gives."""
    chi_square: float
    """Median over the runs of the reduced chi-square with all findings; 1 if only noise is left."""
    before: float
    """The same without the findings."""
    unexplained: bool
    """Whether something is left that no candidate explains."""
    converged: bool = True
    """Whether the fit of the block with all findings reached its optimum."""
    joined: list[str] = field(default_factory=list)
    """Declared blocks that read each other's signals and are simulated together as this one; empty for a declared
    block."""
    switches: list[str] = field(default_factory=list)
    """States whose rate may jump, as the block declares them; empty in results of earlier versions."""


@dataclass(frozen=True)
class MachineParameter:
    """A parameter of the machine beside the findings, in its unit."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    name: str
    """Name of the parameter."""
    unit: str
    """Unit."""
    value: float
    """Mean over the runs."""
    lower: float
    """Lower end of its 95 % interval."""
    upper: float
    """Upper end of its 95 % interval."""
    scatter: float
    """Standard deviation between runs."""
    determined: bool
    """Whether the recordings tell more about it than was known."""
    beyond: bool
    """Whether it is outside of what is declared."""
    declared: float | None = None
    """The value that the machine declares; null where it is the first value of a signal."""
    before: float | None = None
    """The mean without the findings; null where there are none, and in a calibration."""
    beyond_before: bool = False
    """Whether that mean is outside of what is declared."""


@dataclass(frozen=True)
class StatedCondition:
    """A condition whose stated values are off by more than the machine declares; shares of these values."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    name: str
    """Name of the condition."""
    error: float
    """Error of the level, or of the drift over the run order, that is off most; no more than three times the declared
    one is looked for."""
    declared_error: float
    """Standard deviation of these errors as declared."""
    scatter: float
    """Standard deviation of the errors between runs; no more than three times the declared one is looked for."""
    declared_scatter: float
    """The largest one as declared."""


@dataclass(frozen=True)
class MachineGap:
    """The squares beyond noise that the simulation of the whole machine leaves, by runs whose own did not enter."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    before: float
    """Excess of squared residuals over their expectation without the findings, in standard deviations of the noise."""
    after: float
    """The same with the findings."""
    closed: float | None
    """Share that the findings close; null where `converged` is false, and where there is no excess to close."""
    control: str
    """A law over another quantity that the recordings did not ask for."""
    control_closed: float | None
    """Share that the control closes: a wrong law must not; null where `control_converged` is false, or no excess."""
    nats: float
    """Gain in log marginal likelihood of the whole machine by the findings."""
    errors: float
    """Standard errors in which the runs agree about it."""
    converged: bool
    """Whether the fits of the whole machine without and with the findings converged so far that this share is known."""
    control_converged: bool = True
    """Whether those without and with the control converged; true in results of earlier versions."""


@dataclass(frozen=True)
class MachineStudyResult:
    """What a study of a declared machine has found."""

    __pydantic_config__: ClassVar[dict[str, Any]] = _DOCUMENTED

    machine: str
    """Name of the machine."""
    kind: Literal["none", "effect", "tie", "several", "unlisted"]
    """`none`: the recordings show nothing that is missing. `effect`: a single finding, of a known kind. `tie`: one of
    several. `several`: there is more than one finding. `unlisted`: a measured law that is of no known kind, or
    something that no candidate explains."""
    sentence: str
    """The answer in words."""
    findings: list[MachineFinding]
    """What is missing, the first finding first."""
    blocks: list[MachineBlock]
    """The result of each block."""
    parameters: list[MachineParameter]
    """The parameters beside the findings."""
    gap: MachineGap | None
    """The gap of the whole machine; null where nothing was found, and in a partial result."""
    set_aside: list[int]
    """Runs, numbered from 0 as recorded, that are far worse than all others and are not used; a finding may explain
    some of them."""
    runs: int
    """Number of runs that were used."""
    noise: dict[str, float]
    """Standard deviation of the noise of each signal, in its unit."""
    units: dict[str, str]
    """Units of signals, commands and conditions."""
    recordings_digest: str
    """SHA-256 of the recordings."""
    settings_digest: str
    """SHA-256 of settings, kinds and machine, with the code of its functions."""
    partial: Partial | None = None
    """What is complete and what is missing, if the time budget ended before the study; null if it is complete."""
    seen: dict[str, list[float]] = field(default_factory=dict)
    """Least and largest value of each command and condition of the runs that were used."""
    doubts: list[str] = field(default_factory=list)
    """What is of another order, or of the other sign, in the recordings than in the machine's own experiments."""
    run_names: list[str] = field(default_factory=list)
    """Where each run is from, by its number, such as the file; empty where the recordings do not say so."""
    conditions: list[StatedCondition] = field(default_factory=list)
    """Conditions whose stated values are off by more than the machine declares, beside the findings."""

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON."""
        return asdict(self)


@dataclass(frozen=True)
class ShownRun:
    """A run, numbered from 0 as recorded: what was `measured` of each signal and what the models have, at `time` in s.

    A signal ends where no sample of it counts any more in any run.
    """

    run: int
    time: list[float]
    measured: dict[str, list[float]]
    models: dict[str, dict[str, list[float]]]


@dataclass(frozen=True)
class MachineFigures:
    """Data of pictures: the runs that the model without the findings describes worst. Models are `before` and, where
    there are findings, `after`."""

    runs: list[ShownRun] = field(default_factory=list)
