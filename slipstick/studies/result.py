"""The result of a study as typed values. Reports, pictures and the service read them; the service adds nothing."""

from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

from slipstick.confirmation.explanations import Explanation
from slipstick.confirmation.further import FurtherExperiment
from slipstick.confirmation.gap import WITHIN, Closure
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.times import TimesOver
from slipstick.confirmation.worth import Worth
from slipstick.studies.finding import (
    Candidate,
    Coefficient,
    Confirmation,
    CountedFindings,
    FindingResult,
    Law,
    Remainder,
)
from slipstick.time_budget import Partial

__all__ = ["WITHIN", "BlockResult", "Candidate", "ClosedBlock", "Closure", "Coefficient", "Confirmation", "Control",
           "CountedFindings", "Explanation", "FindingResult", "FurtherExperiment", "Gap", "Law", "MeasuredCondition",
           "Remainder", "SimulationResult", "StudyResult", "TimesOver", "Worth"]


@dataclass(frozen=True)
class BlockResult:
    """The result of a block of the model, between the signals at its input and the one at its output."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the block."""
    signals: str
    """The measured signals that it connects."""
    chi_square: float
    """Reduced chi-square with all findings and remainders; 1 if only noise is left."""
    findings: list[str]
    """Titles of the findings in this block; empty if there are none."""
    unexplained: bool
    """Whether something is left that no pair explains."""
    outlying: list[int] = field(default_factory=list)
    """Engagements, numbered from 0 as in the recordings, that are far worse than the others in this block, and are
    used nevertheless: the worst first."""

    @property
    def is_explained(self) -> bool:
        """Whether nothing is left, neither in all engagements nor in single ones."""
        return not (self.unexplained or self.outlying)


@dataclass(frozen=True)
class ClosedBlock:
    """A block that was not tested, because signals were not measured."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the block."""
    signals: str
    """The signals that it connects."""
    missing: list[str]
    """Those that it needs and that the recordings do not have."""


@dataclass(frozen=True)
class Control:
    """What the best effect on another quantity closes: a wrong effect must not close the gap."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    effect: str
    """Name of that effect."""
    closures: dict[str, Closure]
    """Closure by signal, `shifting_time`, or `within_engagements`."""


@dataclass(frozen=True)
class Gap:
    """The gap between model and recordings without and with the findings."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    closures: dict[str, Closure]
    """Closure by signal, `shifting_time`, or `within_engagements`: of all signals beside the scatter of the parameters,
    in standard deviations of the noise."""
    before: list[float]
    """Held-out prediction of each shifting time in s, without the findings."""
    after: list[float]
    """Held-out prediction of each shifting time in s, with the findings."""
    control: Control | None
    """Control for comparison; null if every effect acts on a quantity of the findings."""


@dataclass(frozen=True)
class MeasuredCondition:
    """A stated level of a condition, and what the blocks measure in the engagements of this level."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the condition."""
    stated: float
    """Stated level, in the unit of the condition."""
    deviation: float
    """Mean deviation of what was measured, relative to the stated level."""
    scatter: float
    """Standard deviation of the engagements from each other, relative to the stated level."""
    engagements: int
    """Number of engagements of this level."""


@dataclass(frozen=True)
class BeyondParameter:
    """A parameter that a data sheet gives, and that the recordings put beyond what is known of it."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the parameter."""
    change: float
    """Its mean by the blocks, relative to its nominal value, as a difference."""
    error: float
    """Standard error of this change."""


@dataclass(frozen=True)
class SimulationResult:
    """A fit of the simulation of the whole bench to all signals."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    parameters: dict[str, float]
    """Mean of each parameter relative to its nominal value, and of each condition relative to what the blocks measure
    of it, or else to its stated value."""
    scatter: dict[str, float]
    """Standard deviation of each from engagement to engagement, relative to nominal."""
    chi_square: dict[str, float]
    """Mean squared residual of each signal and of the shifting time, in units of its noise."""
    log_likelihood: float
    """Natural log-likelihood, up to a constant of the recordings."""
    converged: bool
    """Whether the fit converged within its iterations."""
    model: dict[str, Any]
    """The model in the format that `slipstick build --model` reads."""
    errors: dict[str, float] = field(default_factory=dict)
    """Standard error of each mean, relative to nominal; empty in results of earlier versions."""
    at_bound: list[str] = field(default_factory=list)
    """Parameters and conditions whose mean is at a bound of the fit: their estimates and errors mean little."""
    undetermined: list[str] = field(default_factory=list)
    """Parameters and conditions whose mean the recordings tell no better than was known before."""


@dataclass(frozen=True)
class StudyResult:
    """What a study has found."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    kind: Literal["none", "effect", "tie", "several", "unlisted", "open"]
    """`none`: the recordings show no missing effect. `effect`: one effect is missing. `tie`: one of several.
    `several`: there is more than one finding. `unlisted`: something is missing that the catalogue does not have.
    `open`: the time budget ended before anything was found."""
    sentence: str
    """The answer in words."""
    findings: list[FindingResult]
    """What is missing, in the order of the blocks."""
    blocks: list[BlockResult]
    """The result of each block."""
    set_aside: list[int]
    """Engagements, numbered from 0 as in the recordings, that are far worse than all others and are not used."""
    before: SimulationResult | None
    """The fit without the findings, in which parameters scatter no more than in the fit with them; null in a partial
    result."""
    after: SimulationResult | None
    """The fit with those findings that the simulation supports; null in a partial result."""
    gap: Gap | None
    """The gap without and with the findings; null if the simulation supports none, and in a partial result."""
    experiments: int
    """Number of engagements that were used; each is one observation of all tests."""
    noise: dict[str, float]
    """Standard deviation of the noise of each signal in its unit, and of the shifting time in s."""
    recordings_digest: str
    """SHA-256 of the recordings."""
    settings_digest: str
    """SHA-256 of the settings and of the source of the method."""
    closed: list[ClosedBlock] = field(default_factory=list)
    """Blocks that were not tested: what is missing there is not found."""
    unused_channels: list[str] = field(default_factory=list)
    """Further channels that have no value in some engagement: no law over them was tried."""
    conditions: list[MeasuredCondition] = field(default_factory=list)
    """Stated levels of motor speed, load inertia and brake torque as the blocks measure them. The simulation has the
    measured values. A condition whose block was not tested, or that has a value in each engagement, is not listed."""
    remainders: list[Remainder] = field(default_factory=list)
    """Smaller findings that are not reported: wrong more likely than not, or rare pairs beside a usual one."""
    explanations: list[Explanation] = field(default_factory=list)
    """Effects of the catalogue that would explain what the simulation leaves where blocks were not tested, that which
    gains most first. Their laws are not measured, and other effects are not excluded."""
    times: list[TimesOver] = field(default_factory=list)
    """Changes of the shifting time over the conditions that the parameters do not explain; only of recordings of
    shifting times alone."""
    partial: Partial | None = None
    """What is complete and what is missing, if the time budget ended before the study; null if it is complete."""
    beyond: list[BeyondParameter] = field(default_factory=list)
    """Parameters that are not what the bench states, which explains the recordings better than any law does."""

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON."""
        return asdict(self)

    @property
    def models(self) -> dict[str, dict[str, Any]]:
        """The models `before` and `after` as JSON; none in a partial result."""
        return {name: fit.model for name, fit in (("before", self.before), ("after", self.after)) if fit is not None}

    @property
    def effects(self) -> list[str]:
        """The named effects of the catalogue."""
        return [finding.effect for finding in self.findings if finding.effect is not None]
