"""The truth about a case, which its files do not contain."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .bad_runs import BadRun
from .case import Case, Hidden, bad_runs_of
from .dependences import KNOWN_PAIRS
from .draw_effect import collect_visited
from .run import Run

_PARAMETERS = {"friction_coefficient": "alpha", "pressure_gain": "k", "film_coefficient": "gamma",
               "clearance": "z_contact", "oil_temperature_gain": "kT", "spring_rate": "d2", "piston_feed": "a2"}


@dataclass(frozen=True)
class HiddenEffect:
    """A hidden effect in words, its strength, and its law as a table over the range that the runs visit.

    `grid` (m,) are abscissas, `change` are the factors or differences there (by `kind`), and `visits` the shares of the
    visits to each point; all are empty where the law is not one over a number. `base` is the mean over the runs of the
    parameter that a factor multiplies.
    """

    pair: tuple[str, str]
    is_known: bool
    block: str
    form: str
    trend: str
    share: float
    strength: float
    quantity: str
    abscissa: str
    kind: str
    base: float | None
    grid: list[float]
    change: list[float]
    visits: list[float]


@dataclass(frozen=True)
class Truth:
    """What is hidden in a case: effects, factors of parameters, bad runs, and the mean parameters of its runs."""

    case: str
    runs: int
    hidden: tuple[HiddenEffect, ...]
    missing: tuple[str, ...]
    factors: dict[str, float]
    bad_runs: tuple[BadRun, ...]
    parameters: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """Return the truth as JSON has it."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "Truth":
        """Return the truth of `to_json`."""
        hidden = tuple(HiddenEffect(**{**each, "pair": tuple(each["pair"])}) for each in content["hidden"])
        bad_runs = tuple(BadRun(**each) for each in content["bad_runs"])
        return cls(**{**content, "hidden": hidden, "bad_runs": bad_runs, "missing": tuple(content["missing"])})


def describe(case: Case, run: Run) -> Truth:
    """Return what is hidden in a `run` of the case."""
    means = {name: float(np.mean(values)) for name, values in run.engagements.values.items()}
    return Truth(case.name, len(run.conditions), tuple(_describe(hidden, run, means) for hidden in case.hidden),
                 case.missing, dict(case.factors), bad_runs_of(case, run.conditions), means)


def _describe(hidden: Hidden, run: Run, means: dict[str, float]) -> HiddenEffect:
    effect = hidden.effect
    grid = change = visits = np.zeros(0)
    if effect.plays is None and effect.response is None:
        abscissas = collect_visited(effect.quantity, effect.abscissa, run)
        grid = np.linspace(*np.quantile(abscissas, (0.01, 0.99)), 41)
        edges = np.concatenate([[-np.inf], (grid[1:] + grid[:-1]) / 2, [np.inf]])
        visits = np.histogram(abscissas, edges)[0] / abscissas.size
        change = np.broadcast_to(effect.law(hidden.amplitude, grid), grid.shape)
    return HiddenEffect(effect.pair, effect.pair in KNOWN_PAIRS, effect.block, effect.form, effect.trend, hidden.share,
                        round(hidden.strength, 2), effect.quantity, effect.abscissa, effect.kind,
                        means.get(_PARAMETERS.get(effect.quantity, "")), grid.tolist(), change.tolist(),
                        visits.tolist())
