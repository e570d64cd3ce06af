"""The climb of a marginal likelihood: Gauss-Newton steps in theta, with the slope of the determinant added, and
expectation-maximization in the covariance of the scatter and the noise of the channels.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from slipstick.study.comparison import Comparison
from slipstick.study.design import Design
from slipstick.study.linearised import Linearised, linearise, predict_at
from slipstick.study.marginal import State, determinant, marginal, rarity, spread

RIDGE = 1e-6  # information on what nothing depends on, such as the shape of an absent effect
_EM = 6  # updates of covariance and noise on one linearisation
_SMALLEST = 1e-8  # variance of a multiplier below which it does not scatter
_DAMPINGS = (0.0, 1e-3, 3e-2)
_SHARES = (1.0, 0.25, 0.05)  # of a step in theta that are tried
_RELAXATIONS = 2  # of the modes, before a smaller step is tried
_WEAK, _ALONG = 2, 0.02  # directions along which the determinant's slope is taken, and the step
_NEAR = 100.0  # change of the log-likelihood below which that slope matters
_REACH = 0.1  # farthest that a mode moves in one step


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds, longest step and prior of each entry of theta, all (p,)."""

    lower: np.ndarray
    upper: np.ndarray
    reach: np.ndarray
    centre: np.ndarray
    precision: np.ndarray

    def within(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest step (p,) from theta that bounds and reach allow.

        What has no prior may double: of some effects a strong one is ten times what is typical.
        """
        held = (self.precision > 0) | (self.reach == 0)
        reach = np.where(held, self.reach, np.maximum(self.reach, np.abs(theta - self.centre)))
        return np.maximum(self.lower - theta, -reach), np.minimum(self.upper - theta, reach)

    @classmethod
    def of(cls, design: Design) -> "Limits":
        """Those of the design's unknowns."""
        return cls(*np.array([[one.lower, one.upper, one.reach, one.start, one.precision]
                              for one in design.unknowns]).T)


@dataclass(frozen=True, eq=False)
class Climb:
    """Where a climb came to: the state, the linearisation about it, and whether it changed little in the end."""

    state: State
    about: Linearised
    iterations: int
    converged: bool


def climb(comparison: Comparison, design: Design, state: State, about: Linearised, held: int | None,
          tolerance: float, most: int) -> Climb:
    """Climb from a state, linearised `about` it, until the log-likelihood changes by less than the tolerance.

    One entry of theta is `held` where it is; after `most` steps it ends in any case.
    """
    change, iterations = np.inf, 0
    if not np.all(np.isfinite(about.residuals)):  # where it is to begin, engagements blow up
        return Climb(state, about, 0, False)
    while change >= tolerance and iterations < most:
        before = objective(comparison, design, about, state)
        near = change <= max(_NEAR, tolerance)
        narrowing = _narrowing(comparison, design, about, state) if near else np.zeros(len(state.theta))
        aim = _aim(about, state, design, narrowing, held)
        state = _search(comparison, design, about, state, aim, narrowing)
        about = linearise(comparison, design, spread(state, design.scattering))
        state = _scattered(comparison, about, state, design)
        after = objective(comparison, design, about, state)
        # No end before the determinant has been heard.
        change, iterations = abs(before - after) if near else max(abs(before - after), tolerance), iterations + 1
    return Climb(state, about, iterations, change < tolerance)


def objective(comparison: Comparison, design: Design, about: Linearised, state: State) -> float:
    """Minus the logarithm of the joint density of data and modes, with the determinant of Laplace's approximation."""
    if not np.all(np.isfinite(about.residuals)):
        return np.inf
    limits = Limits.of(design)
    square = about.gram[:, :, -1, -1].sum(axis=1) @ (1 / state.noise)
    modes = rarity(state.modes, state.covariance).sum()
    prior = (limits.precision * (state.theta - limits.centre) ** 2).sum()
    logdet = marginal(about, state, design.scattering).logdet.sum()
    return float(0.5 * (square + modes + logdet + prior + comparison.counts @ np.log(state.noise)))


def _narrowing(comparison: Comparison, design: Design, about: Linearised, state: State) -> np.ndarray:
    """Slope (p,) of the logarithm of the determinant, along the directions in theta that are known least.

    Pressure bias, initial position and temperature gain form a curved valley. Its ends are told apart by how wide it
    is for each experiment, which only the determinant says and a Gauss-Newton step neglects.
    """
    integrated, places = marginal(about, state, design.scattering), list(design.scattering)
    precision = np.diag(Limits.of(design).precision + RIDGE)
    weak = np.linalg.eigh(integrated.information.sum(axis=0) + precision)[1][:, :_WEAK]
    gram, slope = about.weighted(state.noise), np.zeros(len(state.theta))
    for direction in weak.T:
        moved = integrated.gain @ (gram[:, places, :-1] @ direction)[..., None]
        there = replace(state, theta=state.theta + _ALONG * direction, modes=state.modes - _ALONG * moved[..., 0])
        moved_to = linearise(comparison, design, spread(there, design.scattering), columns=places)
        inner = moved_to.weighted(state.noise)[:, :-1, :-1]
        change = determinant(inner, state.covariance) - integrated.logdet
        slope += np.nan_to_num(change).sum() / _ALONG * direction
    return slope


def _aim(about: Linearised, state: State, design: Design, narrowing: np.ndarray, held: int | None) -> np.ndarray:
    """The theta (p,) that the linearised experiments ask for, within reach, with one entry held."""
    integrated, limits = marginal(about, state, design.scattering), Limits.of(design)
    information = integrated.information.sum(axis=0) + np.diag(limits.precision + RIDGE)
    score = integrated.score.sum(axis=0) + limits.precision * (limits.centre - state.theta) - 0.5 * narrowing
    lower, upper = limits.within(state.theta)
    if held is not None:
        lower[held] = upper[held] = 0.0
    return np.asarray(state.theta + bounded(information, score, lower, upper))


def _search(comparison: Comparison, design: Design, about: Linearised, state: State, aim: np.ndarray,
            narrowing: np.ndarray) -> State:
    """On the way to the theta `aim`, as far as heights fall; every experiment takes the best of several modes."""
    def heights(predicted: np.ndarray, modes: np.ndarray) -> np.ndarray:
        squares = ((comparison.measured - predicted) / comparison.scale) ** 2 * comparison.weights
        each = sum(squares[:, columns].sum(axis=1) / factor for factor, columns in
                   zip(state.noise, comparison.channels.values(), strict=True))
        return np.asarray(np.nan_to_num(each + rarity(modes, state.covariance), nan=np.inf))

    def tried(theta: np.ndarray, base: np.ndarray, candidates: list[np.ndarray]) -> tuple[np.ndarray, float]:
        """The best modes of each experiment, and the sum of their heights."""
        modes = np.array([base, *candidates])
        points = np.array([spread(replace(state, theta=theta, modes=one), design.scattering) for one in modes])
        predicted = predict_at(comparison, design, points)
        found = np.array([heights(one, its) for one, its in zip(predicted, modes, strict=True)])
        return modes[found.argmin(axis=0), np.arange(len(base))], float(found.min(axis=0).sum())

    before, places = float(heights(comparison.measured - about.residuals, state.modes).sum()), list(design.scattering)
    for share in _SHARES:
        theta = state.theta + share * (aim - state.theta)
        gram = about.weighted(state.noise)
        slope = gram[:, places, -1] - gram[:, places, :-1] @ (theta - state.theta)
        modes, height = tried(theta, state.modes, _damped(gram[:, places][:, :, places], slope, state))
        for _ in range(_RELAXATIONS):
            if height + narrowing @ (theta - state.theta) < before:
                return replace(state, theta=theta, modes=modes)
            if not np.isfinite(height):
                break
            now = replace(state, theta=theta, modes=modes)
            there = linearise(comparison, design, spread(now, design.scattering), columns=places)
            gram = there.weighted(state.noise)
            modes, height = tried(theta, modes, _damped(gram[:, :-1, :-1], gram[:, :-1, -1], now))
    return state


def _damped(inner: np.ndarray, slope: np.ndarray, state: State) -> list[np.ndarray]:
    """Modes (n, q) to try, by Levenberg-Marquardt at several dampings, from G_i' G_i (n, q, q) and G_i' r_i (n, q).

    Pressure bias and initial position form a curved valley, along which a whole step climbs its wall.
    """
    found, precision = [], np.linalg.inv(state.covariance)
    for damping in _DAMPINGS:
        diagonal = damping * np.einsum("nqq->nq", inner)
        curvature = inner + precision + diagonal[:, :, None] * np.eye(inner.shape[1])
        change = np.linalg.solve(curvature, (slope - state.modes @ precision)[..., None])[..., 0]
        found.append(state.modes + np.clip(change, -_REACH, _REACH))
    return found


def _scattered(comparison: Comparison, about: Linearised, state: State, design: Design) -> State:
    """The state with the covariance and the noise that its modes and residuals show: expectation-maximization."""
    places, square = list(design.scattering), about.gram[:, :, -1, -1].sum(axis=1)
    for _ in range(_EM):
        posterior = marginal(about, state, design.scattering).gain
        covariance = state.modes.T @ state.modes / len(state.modes) + posterior.mean(axis=0)
        open_ = np.einsum("nqr,cnrq->c", posterior, about.gram[:, :, places][:, :, :, places], optimize=True)
        state = replace(state, covariance=np.diag(np.clip(np.diag(covariance), _SMALLEST, design.widest**2)),
                        noise=np.maximum(1.0, (square + open_) / comparison.counts))
    return state


def bounded(information: np.ndarray, score: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The step (p,) between `lower` and `upper` that raises a quadratic log-likelihood most."""
    values, vectors = np.linalg.eigh(information)
    roots = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    crack = np.maximum(upper, lower + 1e-12)  # lsq_linear wants one
    problem = (vectors * roots).T, vectors.T @ score / roots, (lower, crack)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = lsq_linear(*problem, method="bvls").x
    if not np.all(np.isfinite(step)):  # bvls divides zero by zero where nothing pulls at an entry that is at its bound
        step = lsq_linear(*problem, method="trf").x
    return np.clip(step, lower, crack)
