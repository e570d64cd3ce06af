"""The result of a study as typed values. Reports, pictures and the service read them; the service adds nothing."""

from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar, Literal

from slipstick.confirmation.further import FurtherExperiment
from slipstick.confirmation.gap import WITHIN, Closure
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.worth import Worth

__all__ = ["WITHIN", "BlockResult", "Candidate", "ClosedBlock", "Closure", "Coefficient", "Confirmation", "Control",
           "CountedNames", "FindingResult", "FurtherExperiment", "Gap", "Law", "MeasuredCondition", "SimulationResult",
           "StudyResult", "Worth"]


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a named effect, fitted to all signals at once."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the coefficient; `factor` for the multiple of a measured law."""
    unit: str
    """Unit."""
    value: float
    """Estimate."""
    lower: float
    """Lower end of the interval, which is conditional on the name."""
    upper: float
    """Upper end of the interval."""
    at_bound: bool
    """Whether the estimate is at a bound of the coefficient, so that the interval has no meaning."""


@dataclass(frozen=True)
class CountedNames:
    """Names given on simulated benches new to the development, each with its confidence from other lists of cases."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    lower: float
    """Least confidence of these names."""
    upper: float
    """Largest confidence of these names."""
    right: int
    """How many of them were right."""
    of: int
    """How many there are."""


@dataclass(frozen=True)
class Law:
    """A measured law: how a quantity changes with what it depends on, without a formula."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    x: list[float] | None
    """Points at which the change was measured; null for a single number, such as a lag."""
    x_unit: str
    """Unit of the points."""
    change: list[float]
    """Change of the quantity at the points."""
    lower: list[float]
    """Lower end of the band at each point."""
    upper: list[float]
    """Upper end of the band at each point."""
    unit: str
    """Unit of the change, "1" if it is relative."""
    relative: bool
    """Whether the change is a share of the quantity."""
    up_to: Literal["nothing", "constant", "line"]
    """What may be added to the law because parameters of the model take it as well: a constant, or a straight line."""
    linearised: bool
    """Whether the band is that of a linear model about the fit, and may be several times too narrow."""
    formula: list[float] | None
    """The same change by the formula of the named effect with its fitted coefficients; null without one."""


@dataclass(frozen=True)
class Candidate:
    """A pair of quantity and dependence that the recordings do not tell apart from the finding."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    effect: str | None
    """Effect of the catalogue; null if it has none for this pair."""
    quantity: str
    """Quantity of the model that changes."""
    depends_on: str
    """What the change depends on."""
    nats: float
    """Gain of the natural log-likelihood by the pair."""
    behind: float
    """Standard errors over engagements by which it trails the finding."""


@dataclass(frozen=True)
class Confirmation:
    """Whether the simulation of the whole bench supports a finding of the blocks."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    simulated: Literal["formula", "measured law", "no"]
    """The term of the finding in the simulation: for a named effect its formula, or its measured law if that describes
    the recordings better. `no`: the simulation has no such quantity or dependence."""
    coefficients: list[Coefficient]
    """Coefficients, fitted with those of all other findings; empty if the simulation does not support the finding."""
    agrees: bool | None
    """Whether the simulation supports the finding in addition to the other ones; null if it has no term for it."""


@dataclass(frozen=True)
class FindingResult:
    """Something that the recordings show and the model lacks."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    kind: Literal["effect", "tie", "unlisted"]
    """`effect`: the catalogue has it. `tie`: one of several. `unlisted`: the catalogue has no effect of this pair with
    a law of this shape."""
    effect: str | None
    """Effect of the catalogue, the first of a tie; null if unlisted."""
    title: str
    """The finding in words."""
    quantity: str
    """Quantity of the model that changes."""
    depends_on: str
    """What the change depends on."""
    blocks: list[str]
    """Blocks of the model that show it."""
    nats: float
    """Gain of the natural log-likelihood of held-out engagements in these blocks."""
    errors: float
    """Mean gain in its standard errors over engagements."""
    rivals: list[Candidate]
    """Pairs that the recordings do not tell apart from it."""
    law: Law | None
    """The measured law."""
    confirmation: Confirmation
    """Whether the simulation of the whole bench supports it."""
    worth: Worth | None
    """By how much it changes shifting times and signals; null if the simulation has no term for it."""
    confidence: float | None
    """Expected share of right names among findings that are as certain, beside as many others, on simulated benches
    that the development had not used; null if unlisted. It is an average over these benches: yours may differ."""
    counted: CountedNames | None
    """How many names with such a confidence were right; null if unlisted."""
    experiments: list[FurtherExperiment]
    """Experiments that would resolve a tie, the best first."""


@dataclass(frozen=True)
class BlockResult:
    """The result of a block of the model, between the signals at its input and the one at its output."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    name: str
    """Name of the block."""
    signals: str
    """The measured signals that it connects."""
    chi_square: float
    """Reduced chi-square with all findings; 1 if only noise is left."""
    findings: list[str]
    """Titles of the findings in this block; empty if there are none."""
    unexplained: bool
    """Whether something is left that no pair explains."""


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
    """The model in the format that `python -m worker build --model` reads."""


@dataclass(frozen=True)
class StudyResult:
    """What a study has found."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    kind: Literal["none", "effect", "tie", "several", "unlisted"]
    """`none`: the recordings show no missing effect. `effect`: one effect is missing. `tie`: one of several.
    `several`: there is more than one finding. `unlisted`: something is missing that the catalogue does not have."""
    sentence: str
    """The answer in words."""
    findings: list[FindingResult]
    """What is missing, in the order of the blocks."""
    blocks: list[BlockResult]
    """The result of each block."""
    set_aside: list[int]
    """Engagements, numbered from 0 as in the recordings, that are far worse than all others and are not used."""
    before: SimulationResult
    """The fit without the findings, in which parameters scatter no more than in the fit with them."""
    after: SimulationResult
    """The fit with those findings that the simulation supports."""
    gap: Gap | None
    """The gap without and with the findings; null if the simulation supports none."""
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

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON."""
        return asdict(self)

    @property
    def effects(self) -> list[str]:
        """The named effects of the catalogue."""
        return [one.effect for one in self.findings if one.effect is not None]
