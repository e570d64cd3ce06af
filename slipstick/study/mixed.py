"""A mixed-effects fit: parameters and coefficients common to all experiments, and scatter from run to run.

The marginal likelihood (see `marginal`) is climbed (see `climb`) at several values of the temperature gain.

The noise of each channel is estimated with the rest, and is at least its sensor's: what a model cannot describe counts
as noise, and so does not drag its parameters to where they make no sense.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.study.climb import Climb, Limits, climb, objective
from slipstick.study.comparison import Comparison
from slipstick.study.design import Design
from slipstick.study.linearised import Linearised, linearise
from slipstick.study.marginal import Marginal, State, log_likelihood, marginal, spread

_ITERATIONS, _ITERATIONS_ALONG, _ITERATIONS_NEAR = 15, 8, 10  # of a profile's first fit, its others, and without one
_ALONG_VALLEY, _BRACKET = 0.04, 3  # first step of its profile, and how often it is doubled
_VERTICES, _NARROW = 3, 0.004  # of parabolas that are tried, and how near they come to one another
TOLERANCE = 2.0  # of the log-likelihood, between two linearisations: some hundred thousand in all
_FIRST = 0.03**2  # variance of a multiplier at the start


@dataclass(frozen=True, eq=False)
class MixedFit:
    """The `state` found for `design`, and the linearisation `about` it.

    `log_likelihood` (n,) is natural, and marginal over the scatter.
    """

    design: Design
    state: State
    about: Linearised
    log_likelihood: np.ndarray
    iterations: int
    converged: bool

    @property
    def points(self) -> np.ndarray:
        """theta + b_i of each experiment, (n, p)."""
        return spread(self.state, self.design.scattering)

    @property
    def scatter(self) -> np.ndarray:
        """Covariance (q, q) of the scattering entries from run to run, as modes and what these may be off show it."""
        modes = self.state.modes
        return np.asarray(np.cov(modes.T, bias=True) + self.marginal.gain.mean(axis=0))

    @property
    def marginal(self) -> Marginal:
        """The linearised experiments with the scatter integrated out."""
        return marginal(self.about, self.state, self.design.scattering)


def fit(comparison: Comparison, design: Design, theta: np.ndarray | None = None,
        tolerance: float = TOLERANCE, profiled: bool = True) -> MixedFit:
    """Fit the design to the comparison from `theta` (p,) on, by default the design's start, and without scatter.

    It is converged where the log-likelihood changes by less than the tolerance. Scatter that a wrong model has bent
    would hold a right one where it is: every fit finds its own. The temperature gain is found by its profile, or
    held where it begins: with pressure bias and initial position it forms a curved valley, down which Gauss-Newton
    steps drift.
    """
    start = np.array([one.start for one in design.unknowns]) if theta is None else theta
    most = _ITERATIONS if profiled else _ITERATIONS_NEAR
    found = climb(comparison, design, *_begun(comparison, design, start), design.valley, tolerance, most)
    if profiled and design.valley is not None:
        found = _profiled(comparison, design, found, design.valley, tolerance)
    return _concluded(comparison, design, found)


def _profiled(comparison: Comparison, design: Design, begun: Climb, place: int, tolerance: float) -> Climb:
    """The highest of climbs with one entry of theta held at several values: a bracket, and vertices of parabolas."""
    limits = Limits.of(design)
    lower, upper = limits.lower[place], limits.upper[place]
    middle = float(begun.state.theta[place])
    climbs: dict[float, Climb] = {}
    heights: dict[float, float] = {}

    def keep(value: float, one: Climb) -> None:
        climbs[value], heights[value] = one, -objective(comparison, design, one.about, one.state)

    def height(value: float) -> float:
        if value not in heights:
            top = climbs[max(heights, key=heights.__getitem__)].state
            theta = top.theta.copy()
            theta[place] = value
            state = replace(top, theta=theta)
            about = linearise(comparison, design, spread(state, design.scattering))
            keep(value, climb(comparison, design, state, about, place, tolerance, _ITERATIONS_ALONG))
        return heights[value]

    keep(middle, begun)
    step = _ALONG_VALLEY if height(middle + _ALONG_VALLEY) > height(middle) else -_ALONG_VALLEY
    value = middle + step
    for _ in range(_BRACKET):
        if height(value) < max(heights.values()) or not lower < value + 2 * step < upper:
            break
        step *= 2
        value += step
        height(value)
    for _ in range(_VERTICES):
        three = sorted(sorted(heights, key=lambda one: -heights[one])[:3])
        if not np.all(np.isfinite([heights[one] for one in three])):
            break
        curved, slope, _ = np.polyfit(np.array(three) - middle, [heights[one] for one in three], 2)
        vertex = float(middle - slope / (2 * curved)) if curved < 0 else middle
        if not three[0] < vertex < three[-1] or min(abs(vertex - one) for one in three) < _NARROW:
            break
        height(vertex)
    return climbs[max(heights, key=heights.__getitem__)]


def _begun(comparison: Comparison, design: Design, theta: np.ndarray) -> tuple[State, Linearised]:
    """The state at theta without scatter, and with the noise that it leaves; nearer to neutral where it blows up."""
    n, q, centre = len(comparison.measured), len(design.scattering), Limits.of(design).centre
    while True:
        state = State(theta, np.zeros((n, q)), _FIRST * np.eye(q), np.ones(len(comparison.channels)))
        about = linearise(comparison, design, spread(state, design.scattering))
        if np.all(np.isfinite(about.residuals)):
            misfit = about.gram[:, :, -1, -1].sum(axis=1) / comparison.counts
            return replace(state, noise=np.maximum(1.0, misfit)), about
        nearer = np.where(np.arange(len(theta)) < len(design.parameters), theta, (theta + centre) / 2)
        if np.allclose(nearer, theta):
            raise InvalidValue("The simulation blows up at the parameters of the study",
                               "Give recordings of a bench like the nominal one")
        theta = nearer


def at(comparison: Comparison, design: Design, state: State) -> MixedFit:
    """What a fit that ended at `state` had found."""
    about = linearise(comparison, design, spread(state, design.scattering))
    return _concluded(comparison, design, Climb(state, about, 0, True))


def _concluded(comparison: Comparison, design: Design, found: Climb) -> MixedFit:
    integrated = marginal(found.about, found.state, design.scattering)
    return MixedFit(design, found.state, found.about, log_likelihood(comparison, integrated, found.state.noise),
                    found.iterations, found.converged)
