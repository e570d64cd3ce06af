"""A mixed-effects fit: parameters and coefficients common to all experiments, and scatter from run to run.

Of experiment i the model is f(theta + b_i, c), b_i ~ N(0, covariance) on the scattering parameters. The marginal
likelihood is taken with f linearised about the conditional mode of b_i (first-order conditional estimation: Lindstrom
and Bates, Biometrics 46, 673, 1990), by Gauss-Newton in theta and expectation-maximization in the covariance.

The noise of each channel is estimated with the rest, and is at least its sensor's: what a model cannot describe counts
as noise, and so does not drag its parameters to where they make no sense.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from slipstick.errors import InvalidValue
from slipstick.study.comparison import Comparison
from slipstick.study.design import Design
from slipstick.study.linearised import Linearised, linearise, predict_at

_ITERATIONS = 20
_EM = 6  # updates of covariance and noise on one linearisation
_CONVERGED = 2.0  # of the log-likelihood, between two linearisations: some hundred thousand in all
RIDGE = 1e-6  # information on what nothing depends on, such as the shape of an absent effect
_SMALLEST = 1e-8  # variance of a multiplier below which it does not scatter
_FIRST = 0.03**2  # variance of a multiplier at the start
_DAMPINGS = (0.0, 1e-3, 3e-2)
_SHARES = (1.0, 0.25, 0.05)  # of a step in theta that are tried
_RELAXATIONS = 2  # of the modes, before a smaller step is tried
_REACH = 0.1  # farthest that a mode moves in one step


@dataclass(frozen=True, eq=False)
class State:
    """`theta` (p,) common, `modes` (n, q) of the scattering entries of it, their `covariance` (q, q), and `noise`.

    `noise` (channels,) is the variance of each channel's residuals over that of its sensor.
    """

    theta: np.ndarray
    modes: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray


@dataclass(frozen=True, eq=False)
class Marginal:
    """Products under the covariance V_i of an experiment: `products` (n, p + 1, p + 1) of J_i and r_i + G_i b_i.

    `logdet` (n,) is that of V_i over the noise's; `gain` (n, q, q) the posterior covariance of the modes.
    """

    products: np.ndarray
    logdet: np.ndarray
    gain: np.ndarray

    @property
    def information(self) -> np.ndarray:
        """J_i' V_i^-1 J_i, (n, p, p)."""
        return self.products[:, :-1, :-1]

    @property
    def score(self) -> np.ndarray:
        """J_i' V_i^-1 (r_i + G_i b_i), (n, p)."""
        return self.products[:, :-1, -1]


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds, longest step and prior of each entry of theta, all (p,)."""

    lower: np.ndarray
    upper: np.ndarray
    reach: np.ndarray
    centre: np.ndarray
    precision: np.ndarray

    def within(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest step (p,) from theta that bounds and reach allow."""
        return np.maximum(self.lower - theta, -self.reach), np.minimum(self.upper - theta, self.reach)

    def holding(self, place: int, value: float) -> "Limits":
        """The same with one entry held at a value."""
        there = np.arange(len(self.lower)) == place
        return replace(self, lower=np.where(there, value, self.lower), upper=np.where(there, value, self.upper))

    @classmethod
    def of(cls, design: Design) -> "Limits":
        """Those of the design's unknowns."""
        return cls(*np.array([[one.lower, one.upper, one.reach, one.start, one.precision]
                              for one in design.unknowns]).T)


@dataclass(frozen=True, eq=False)
class MixedFit:
    """The `state` found for `design`, of which the entries `scattering` scatter, and the linearisation `about` it.

    `log_likelihood` (n,) is natural, and marginal over the scatter.
    """

    design: Design
    scattering: tuple[int, ...]
    state: State
    about: Linearised
    log_likelihood: np.ndarray
    iterations: int
    converged: bool

    @property
    def points(self) -> np.ndarray:
        """theta + b_i of each experiment, (n, p)."""
        return spread(self.state, self.scattering)

    @property
    def scatter(self) -> np.ndarray:
        """Covariance (q, q) of the scattering entries from run to run, as modes and what these may be off show it."""
        modes = self.state.modes
        return np.asarray(np.cov(modes.T, bias=True) + self.marginal.gain.mean(axis=0))

    @property
    def marginal(self) -> Marginal:
        """The linearised experiments with the scatter integrated out."""
        return marginal(self.about, self.state, self.scattering)


def spread(state: State, scattering: tuple[int, ...]) -> np.ndarray:
    """The point of each experiment, (n, p)."""
    points = np.tile(state.theta, (len(state.modes), 1))
    points[:, list(scattering)] += state.modes
    return points


def shifted(gram: np.ndarray, modes: np.ndarray, scattering: tuple[int, ...]) -> np.ndarray:
    """The products with the residual r_i replaced by r_i + G_i b_i: what theta and new modes together explain."""
    moved, places = gram.copy(), list(scattering)
    onto = (gram[..., places] @ modes[..., None])[..., 0]
    moved[..., :, -1] += onto
    moved[..., -1, :-1] += onto[..., :-1]
    moved[..., -1, -1] += onto[..., -1] + (onto[..., places] * modes).sum(axis=-1)
    return moved


def marginal(about: Linearised, state: State, scattering: tuple[int, ...]) -> Marginal:
    """Integrate the scatter out of products whose residual was taken at the modes of `state`."""
    places, q = list(scattering), len(scattering)
    gram = about.weighted(state.noise)
    moved = shifted(gram, state.modes, scattering)
    root = np.linalg.cholesky(state.covariance)
    inner = np.eye(q) + root.T @ gram[:, places][:, :, places] @ root
    gain = root @ np.linalg.inv(inner) @ root.T
    onto = moved[:, places, :]
    products = moved - onto.transpose(0, 2, 1) @ gain @ onto
    return Marginal(products, np.linalg.slogdet(inner)[1], gain)


def fit(comparison: Comparison, design: Design, scattering: tuple[int, ...], start: State | None = None) -> MixedFit:
    """Fit the design to the comparison from `start` on: by default the design's, and the noise that it leaves.

    The first of the scattering entries stays where it is, and only scatters. Its mean is as good as unknown: modes
    slide along the curved valley that pressure bias and initial position form, the other parameters follow, and only
    the determinant in the marginal likelihood, whose slope a Gauss-Newton step neglects, tells its ends apart.
    """
    counts = np.array([comparison.weights[:, columns].sum() for columns in comparison.channels.values()])
    state = start or _cold(comparison, design, scattering, counts)
    limits = Limits.of(design).holding(scattering[0], state.theta[scattering[0]])
    about = linearise(comparison, design, spread(state, scattering))
    while not np.all(np.isfinite(about.residuals)):
        # An effect so strong that engagements blow up: begin nearer to where it is absent.
        nearer = np.where(np.arange(len(state.theta)) < len(design.parameters), state.theta,
                          (state.theta + limits.centre) / 2)
        if np.allclose(nearer, state.theta):
            raise InvalidValue("The simulation blows up at the parameters of the study",
                               "Give recordings of a bench like the nominal one")
        state = replace(state, theta=nearer)
        about = linearise(comparison, design, spread(state, scattering))
    converged, iterations = False, 0
    while not converged and iterations < _ITERATIONS:
        before = _objective(about, state, scattering, limits, counts)
        state = _search(comparison, design, about, state, _aim(about, state, scattering, limits), scattering)
        about = linearise(comparison, design, spread(state, scattering))
        state = _scattered(about, state, scattering, counts)
        after = _objective(about, state, scattering, limits, counts)
        converged, iterations = abs(before - after) < _CONVERGED, iterations + 1
    return _concluded(comparison, MixedFit(design, scattering, state, about, np.empty(0), iterations, converged))


def at(comparison: Comparison, design: Design, scattering: tuple[int, ...], state: State) -> MixedFit:
    """What a fit that ended at `state` had found."""
    about = linearise(comparison, design, spread(state, scattering))
    return _concluded(comparison, MixedFit(design, scattering, state, about, np.empty(0), 0, True))


def _concluded(comparison: Comparison, found: MixedFit) -> MixedFit:
    return replace(found, log_likelihood=log_likelihood(comparison, found.marginal, found.state.noise))


def _aim(about: Linearised, state: State, scattering: tuple[int, ...], limits: Limits) -> np.ndarray:
    """The theta (p,) that the linearised experiments ask for, within reach."""
    integrated = marginal(about, state, scattering)
    information = integrated.information.sum(axis=0) + np.diag(limits.precision + RIDGE)
    score = integrated.score.sum(axis=0) + limits.precision * (limits.centre - state.theta)
    lower, upper = limits.within(state.theta)
    return np.asarray(state.theta + bounded(information, score, lower, upper))


def _search(comparison: Comparison, design: Design, about: Linearised, state: State, aim: np.ndarray,
            scattering: tuple[int, ...]) -> State:
    """On the way to the theta `aim`, as far as the squares fall; every experiment takes the best of several modes."""
    def heights(predicted: np.ndarray, modes: np.ndarray) -> np.ndarray:
        squares = ((comparison.measured - predicted) / comparison.scale) ** 2 * comparison.weights
        each = sum(squares[:, columns].sum(axis=1) / factor for factor, columns in
                   zip(state.noise, comparison.channels.values(), strict=True))
        return np.asarray(np.nan_to_num(each + _rarity(modes, state.covariance), nan=np.inf))

    def tried(theta: np.ndarray, base: np.ndarray, candidates: list[np.ndarray]) -> tuple[np.ndarray, float]:
        """The best modes of each experiment, and the sum of their heights."""
        modes = np.array([base, *candidates])
        points = np.array([spread(replace(state, theta=theta, modes=one), scattering) for one in modes])
        predicted = predict_at(comparison, design, points)
        found = np.array([heights(one, its) for one, its in zip(predicted, modes, strict=True)])
        return modes[found.argmin(axis=0), np.arange(len(base))], float(found.min(axis=0).sum())

    before, places = float(heights(comparison.measured - about.residuals, state.modes).sum()), list(scattering)
    for share in _SHARES:
        theta = state.theta + share * (aim - state.theta)
        gram = about.weighted(state.noise)
        slope = gram[:, places, -1] - gram[:, places, :-1] @ (theta - state.theta)
        modes, height = tried(theta, state.modes, _damped(gram[:, places][:, :, places], slope, state))
        for _ in range(_RELAXATIONS):
            if height < before:
                return replace(state, theta=theta, modes=modes)
            if not np.isfinite(height):
                break
            now = replace(state, theta=theta, modes=modes)
            there = linearise(comparison, design, spread(now, scattering), columns=scattering)
            gram = there.weighted(state.noise)
            modes, height = tried(theta, modes, _damped(gram[:, :-1, :-1], gram[:, :-1, -1], now))
    return state


def _rarity(modes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """b_i' covariance^-1 b_i of modes (n, q): (n,)."""
    return np.asarray((modes @ np.linalg.inv(covariance) * modes).sum(axis=1))


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


def _scattered(about: Linearised, state: State, scattering: tuple[int, ...], counts: np.ndarray) -> State:
    """The state with the covariance and the noise that its modes and residuals show: expectation-maximization."""
    places, square = list(scattering), about.gram[:, :, -1, -1].sum(axis=1)
    for _ in range(_EM):
        posterior = marginal(about, state, scattering).gain
        covariance = state.modes.T @ state.modes / len(state.modes) + posterior.mean(axis=0)
        open_ = np.einsum("nqr,cnrq->c", posterior, about.gram[:, :, places][:, :, :, places], optimize=True)
        state = replace(state, covariance=np.diag(np.diag(covariance) + _SMALLEST),
                        noise=np.maximum(1.0, (square + open_) / counts))
    return state


def log_likelihood(comparison: Comparison, integrated: Marginal, noise: np.ndarray) -> np.ndarray:
    """Natural log-likelihood of each experiment, (n,), marginal over the scatter."""
    scale = comparison.scale
    for factor, columns in zip(noise, comparison.channels.values(), strict=True):
        scale[columns] *= np.sqrt(factor)
    constant = ((comparison.weights > 0) * np.log(2 * np.pi * scale**2)).sum(axis=1)
    return np.asarray(-0.5 * (integrated.products[:, -1, -1] + integrated.logdet + constant))


def _cold(comparison: Comparison, design: Design, scattering: tuple[int, ...], counts: np.ndarray) -> State:
    theta, n, q = np.array([one.start for one in design.unknowns]), len(comparison.measured), len(scattering)
    state = State(theta, np.zeros((n, q)), _FIRST * np.eye(q), np.ones(len(counts)))
    about = linearise(comparison, design, spread(state, scattering))
    return replace(state, noise=np.maximum(1.0, about.gram[:, :, -1, -1].sum(axis=1) / counts))


def _objective(about: Linearised, state: State, scattering: tuple[int, ...], limits: Limits,
               counts: np.ndarray) -> float:
    """Minus the logarithm of the joint density of data and modes, with the determinant of Laplace's approximation."""
    if not np.all(np.isfinite(about.residuals)):
        return np.inf
    square = about.gram[:, :, -1, -1].sum(axis=1) @ (1 / state.noise)
    modes = _rarity(state.modes, state.covariance).sum()
    prior = (limits.precision * (state.theta - limits.centre) ** 2).sum()
    logdet = marginal(about, state, scattering).logdet.sum()
    return float(0.5 * (square + modes + logdet + prior + counts @ np.log(state.noise)))


def bounded(information: np.ndarray, score: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The step (p,) between `lower` and `upper` that raises a quadratic log-likelihood most."""
    values, vectors = np.linalg.eigh(information)
    roots = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
    crack = np.maximum(upper, lower + 1e-12)  # lsq_linear wants one
    return np.asarray(lsq_linear((vectors * roots).T, vectors.T @ score / roots, (lower, crack), method="bvls").x)
