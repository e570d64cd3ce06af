"""A finding of a study as typed values."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

from slipstick.confirmation.further import FurtherExperiment
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.worth import Worth
from slipstick.naming.released import VALUE


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
class CountedFindings:
    """Findings on simulated benches whose numbers were drawn, each with its confidence from other lists of cases."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    lower: float
    """Least confidence of these findings."""
    upper: float
    """Largest confidence of these findings."""
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


class Paired(Protocol):
    """A pair of quantity and dependence."""

    @property
    def quantity(self) -> str:
        """What changes."""

    @property
    def depends_on(self) -> str:
        """What it depends on."""


class Contested(Paired, Protocol):
    """A pair with those that the recordings do not tell apart from it."""

    @property
    def rivals(self) -> Sequence[Paired]:
        """These pairs."""


class Changed(Paired, Protocol):
    """What a finding of any machine says of its law."""

    @property
    def title(self) -> str:
        """The finding in words."""

    @property
    def law(self) -> Law | None:
        """The measured law."""


@dataclass(frozen=True)
class Candidate:
    """A pair of quantity and dependence that the recordings do not tell apart from the finding."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    effect: str | None
    """Effect of the catalogue; null if it has none for this pair."""
    quantity: str
    """Quantity of the model that changes."""
    depends_on: str
    """What the change depends on; `value` of a parameter that is itself another one than the bench states."""
    nats: float
    """Gain of the natural log-likelihood by the pair."""
    behind: float
    """Standard errors over engagements by which it trails the finding."""

    @property
    def is_value(self) -> bool:
        """Whether it is another value of a parameter, and no law."""
        return self.depends_on == VALUE


@dataclass(frozen=True)
class Confirmation:
    """Whether the simulation of the whole bench supports a finding of the blocks."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    simulated: Literal["formula", "measured law", "no", "not computed"]
    """The term of the finding in the simulation: for a named effect its formula, or its measured law if that describes
    the recordings better. `no`: the simulation has no such quantity or dependence. `not computed`: the time budget
    ended before the simulation was fitted."""
    coefficients: list[Coefficient]
    """Coefficients, fitted with those of all other findings; empty if the simulation does not support the finding."""
    agrees: bool | None
    """Whether the simulation supports the finding in addition to the other ones; null if it has no term for it, or was
    not fitted."""


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
    """Gain of the natural log-likelihood in these blocks, less the BIC penalty of its coefficients."""
    errors: float
    """Standard errors over engagements in which they show the law, as a standard normal deviate: by what they gain, or
    by their scores in the direction of the law, which are larger where its form loses in some of them."""
    rivals: list[Candidate]
    """Pairs that the recordings do not tell apart from it."""
    law: Law | None
    """The measured law."""
    confirmation: Confirmation
    """Whether the simulation of the whole bench supports it."""
    worth: Worth | None
    """By how much it changes shifting times and signals; null if the simulation has no term for it, or was not fitted.
    """
    confidence: float | None
    """Expected share of right findings among those with such a lead and such others beside them, on simulated benches.
    It is an average over these benches: yours may differ. Null in results of earlier versions without a name."""
    counted: CountedFindings | None
    """How many findings with such a confidence were right; null where the confidence is."""
    experiments: list[FurtherExperiment]
    """Experiments that would resolve a tie, the best first."""
    lead: float | None = None
    """Standard errors over engagements by which it leads the next best explanation: another pair, or none."""
    next_best: Candidate | None = None
    """The pair of another effect that gains most after it in its blocks; null if there is none."""


@dataclass(frozen=True)
class Remainder:
    """What another pair would explain beside a finding in its part of the bench, but more likely a part of its cause.

    It is neither named nor simulated. A law does not follow every cause, and what it leaves looks like a second one.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    effect: str | None
    """Effect of the catalogue; null if it has none for this pair."""
    title: str
    """The pair in words."""
    quantity: str
    """Quantity of the model that would change."""
    depends_on: str
    """What the change would depend on."""
    blocks: list[str]
    """Blocks of the model that show it."""
    nats: float
    """Gain of the natural log-likelihood in these blocks beside the findings."""
    confidence: float
    """Expected share of right ones among findings with such evidence."""
    counted: CountedFindings
    """How many findings with such a confidence were right."""
