"""The nonlinear mixed model of a machine's parts with laws: Gauss-Newton steps, random effects by REML, laws by
evidence.

Each step solves the linear mixed model about the parameters of every run (linear_model.py), in which the coefficients
of a law have the prior of its amplitude and smoothness; these are those of the largest marginal likelihood.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from slipstick.engine.bases import WALKS, flat_forms, form_root, smooth_root
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import Fitted, Gram, estimate, marginalise, restricted_likelihood
from slipstick.engine.model import PartModel, State, build_part, key_of_law, key_of_term, move_part, touches
from slipstick.engine.recordings import Pair, Recorded
from slipstick.errors import InvalidValue

AMPLITUDES = np.geomspace(1e-4, 10, 101)
"""Grid of the amplitude of a law, in units of its size."""
_BUILDS, _STEPS, _TRIALS = 10, 10, 4
"""Most times that columns are computed, most steps with the same ones, and most trials of a step, each half as long."""
_SHRUNK = 0.5
"""Share of what the step before has promised above which columns are computed anew."""
HOPED = 3.0
"""Times what a step promises that a fit may still gain."""
_SETTLED = 0.1
"""Nats that a step promises, or by which it may lower the posterior, at which a fit ends: no decision depends on it."""
_FIRST, _LEAST = 1e-4, 1e-10
"""Variances of random effects, relative to their scale: to begin with, and at least."""
_INDEPENDENT = 0.01
"""Share of the information on a flat form below which it is replaced by other terms."""
_BEYOND = 3.0
"""Scatter between runs that is possible, over the largest that is declared: what exceeds the declared one must show in
the parameter, and not as a law."""
_FURTHEST, _WIDTHS = 0.8, 6.0
"""Largest magnitude of a change of a parameter in its scale, so that a positive one stays positive, or in its widest
scatter where that is more."""


@dataclass(frozen=True)
class Prior:
    """Amplitude of a law, in units of its size, and standard deviation of its walk over that of its line.

    The law is known up to so many flat forms, which parameters replace: nothing, a constant, or a line. A prior with a
    `length`, in knots, is that of a smooth curve, and one with a `form` (m, r) is a combination of its columns; neither
    changes.
    """

    amplitude: float = 0.0
    walk: float = 0.0
    known_up_to: int = 0
    length: float = 0.0
    form: np.ndarray | None = None

    @property
    def is_kept(self) -> bool:
        """Whether the prior is not estimated."""
        return bool(self.length) or self.form is not None

    def root(self, law: Candidate) -> np.ndarray:
        """Return L (m, r) with L L' the covariance of the m coefficients of a law."""
        if self.form is not None:
            return self.amplitude * self.form
        if self.length:
            return self.amplitude * smooth_root(law.count, self.length)
        return self.amplitude * form_root(law.families, self.walk, self.known_up_to)


@dataclass(frozen=True, eq=False)
class Products:
    """Products (n, c, c) of the columns of all runs: random, shared, then each of the `laws`, and the residual last.

    Coefficients of laws are raw. The residual is that of the model at 0.
    """

    recorded: Recorded
    values: np.ndarray
    sizes: tuple[int, ...]

    @property
    def first(self) -> int:
        """The place of the first coefficient of a law."""
        return len(self.recorded.random) + len(self.recorded.shared)

    def gram(self, roots: Sequence[np.ndarray]) -> tuple[Gram, np.ndarray]:
        """Return the linear mixed model with these roots (m, r) of the laws' priors, and the map (c, c') to raw
        ones."""
        random, shared = self.recorded.random, self.recorded.shared
        precision = 1 / np.array([term.std for term in (*random, *shared)]) ** 2
        target = np.array([term.target for term in (*random, *shared)])
        turn = scipy.linalg.block_diag(np.eye(len(precision)), *roots, np.ones((1, 1)))
        free = turn.shape[1] - 1 - len(precision)
        return Gram(turn.T @ self.values @ turn, len(random), np.append(precision, np.ones(free)),
                    np.append(target, np.zeros(free)), _BEYOND * np.array([term.widest for term in random])), turn

    def places(self, number: int, roots: Sequence[np.ndarray]) -> np.ndarray:
        """Return the places of a law's coefficients in the model with these roots."""
        first = self.first + sum(root.shape[1] for root in roots[:number])
        return np.arange(first, first + roots[number].shape[1])

    def join(self, cross: np.ndarray, own: np.ndarray) -> "Products":
        """Return the products with a further law: `cross` (n, m, c) with all columns, and `own` (n, m, m)."""
        n, m, c = cross.shape
        joined = np.empty((n, c + m, c + m))
        joined[:, :c - 1, :c - 1] = self.values[:, :-1, :-1]
        joined[:, :c - 1, -1] = joined[:, -1, :c - 1] = self.values[:, :-1, -1]
        joined[:, -1, -1] = self.values[:, -1, -1]
        rows = slice(c - 1, c - 1 + m)
        joined[:, rows, :c - 1] = cross[:, :, :-1]
        joined[:, :c - 1, rows] = cross[:, :, :-1].transpose(0, 2, 1)
        joined[:, rows, -1] = joined[:, -1, rows] = cross[:, :, -1]
        joined[:, rows, rows] = own
        return Products(self.recorded, joined, (*self.sizes, m))


@dataclass(frozen=True, eq=False)
class Fit:
    """A machine's parts with `laws` at a `state`: the linear `models` of the parts, the mixed model, and its evidence.

    `evidence` is the log marginal likelihood in nats, up to a constant of data and noise. `turn` maps the coefficients
    of the mixed model to raw ones. `promised` are the nats that another step promises; `converged` tells that these are
    few enough.
    """

    recorded: Recorded
    laws: Mapping[Pair, Candidate]
    priors: Mapping[Pair, Prior]
    state: State
    models: Mapping[str, PartModel]
    products: Products
    fitted: Fitted
    turn: np.ndarray
    evidence: float
    promised: float
    converged: bool

    @property
    def roots(self) -> list[np.ndarray]:
        """The roots of the laws' priors, in their order."""
        return [self.priors[pair].root(law) for pair, law in self.laws.items()]

    @cached_property
    def onto(self) -> dict[str, np.ndarray]:
        """The maps (n, r + 1, c) from all coefficients to the rows of each part."""
        return {name: expand(self.recorded, model, self.laws, self.state) for name, model in self.models.items()}

    @cached_property
    def squares(self) -> dict[str, np.ndarray]:
        """Sum of squares (n,) of the whitened residuals of each part, at the estimated parameters of each run."""
        coefficients, squares = coefficients_of(self.fitted, self.turn, self.recorded), dict[str, np.ndarray]()
        for name, model in self.models.items():
            onto = self.onto[name]
            left = onto[:, :, -1] - np.einsum("nrc,nc->nr", onto[:, :, :-1], coefficients)
            squares[name] = np.einsum("nr,nrq,nq->n", left, model.rows @ model.rows.transpose(0, 2, 1), left)
        return squares

    @property
    def chi_square(self) -> dict[str, np.ndarray]:
        """Reduced chi-square (n,) of each part, over the variances of the noise alone."""
        return {name: squares * model.part.temper / np.maximum(model.part.counted.sum(axis=(1, 2)), 1)
                for (name, squares), model in zip(self.squares.items(), self.models.values(), strict=True)}

    @property
    def means(self) -> np.ndarray:
        """Means (r,) of the random terms over the runs."""
        return self.fitted.coefficients[:len(self.recorded.random)]

    def again(self, recorded: Recorded) -> "Fit":
        """Return the fit of the same runs with another noise, or with signals that are explained anew, from here on."""
        laws = {pair: law.renew(recorded) for pair, law in self.laws.items()}
        return fit(recorded, laws, self.priors, self.state, self.fitted.variance)

    def beside(self, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior], state: State | None = None,
               settled: float = _SETTLED, needed: float = -np.inf) -> "Fit":
        """Return the fit with further laws from here on, or from another state."""
        return fit(self.recorded, {**self.laws, **laws}, {**self.priors, **priors}, state or self.state,
                   self.fitted.variance, settled, needed)


def begin(recorded: Recorded) -> State:
    """Return the state of nominal parameters."""
    shared = np.array([term.target for term in recorded.shared])
    return State(np.zeros((len(recorded), len(recorded.random))), np.zeros(len(recorded.random)), shared, {})


def fit(recorded: Recorded, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior], state: State | None = None,
        variance: np.ndarray | None = None, settled: float = _SETTLED, needed: float = -np.inf) -> Fit:
    """Fit the parts with laws from a state on, where laws that it lacks are 0; some priors are kept.

    The fit ends where a step promises less than `settled` nats, or where it will stay short of the evidence that is
    `needed`. Columns are kept over the steps as long as each promises much less than the one before (a chord method:
    Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995, section 5.4.1), and are those of the state where
    it ends.
    """
    state = state or begin(recorded)
    variance = np.full(len(recorded.random), _FIRST) if variance is None else np.maximum(variance, _FIRST * 1e-4)
    state = replace(state, laws={pair: state.laws.get(pair, np.zeros(law.count)) for pair, law in laws.items()})
    best: Fit | None = None
    for _ in range(_BUILDS):
        models = {part.name: build_part(recorded, part, state, laws) for part in recorded.parts}
        solved = _solve(recorded, models, laws, priors, variance, state)
        if solved is None:
            break
        evidence = restricted_likelihood(solved.fitted.gram, solved.fitted.variance) - solved.promised
        current = Fit(recorded, dict(laws), solved.priors, solved.state, models, solved.products, solved.fitted,
                      solved.turn, evidence, solved.promised, solved.promised < settled)
        if best is None or current.evidence > best.evidence:
            best = current
        if current.converged or evidence + HOPED * current.promised < needed:
            return best
        following = _follow(recorded, models, laws, solved, settled)
        if following is None:  # no way leads on
            break
        state, priors, variance = following.state, following.priors, following.variance
    if best is None:
        raise InvalidValue("The equations have no finite solution at the parameters at which a fit begins",
                           "Check the nominal values of the parameters, and the equations at the largest inputs")
    return best


@dataclass(frozen=True, eq=False)
class _Solved:
    """The linear mixed model about a `state`, solved, with the `priors` and the `variance` of the largest evidence.

    `promised` are the nats that a step to the solution promises.
    """

    state: State
    products: Products
    priors: dict[Pair, Prior]
    fitted: Fitted
    turn: np.ndarray
    variance: np.ndarray
    promised: float


def _solve(recorded: Recorded, models: Mapping[str, PartModel], laws: Mapping[Pair, Candidate],
           priors: Mapping[Pair, Prior], variance: np.ndarray, state: State) -> _Solved | None:
    """Solve the linear mixed model of models about a state; None where it is not finite."""
    state = replace(state, tracks={name: model.trajectory.x for name, model in models.items()})
    products = assemble(recorded, models, laws, state)
    if not np.isfinite(products.values).all():
        return None
    adapted = adapt_priors(products, laws, priors, variance)
    gram, turn = products.gram([adapted[pair].root(law) for pair, law in laws.items()])
    fitted, widest = estimate(gram, variance), _BEYOND * np.array([term.widest for term in recorded.random])
    promised = fitted.posterior - fitted.at(_inside(turn, fitted, state, laws)).posterior
    return _Solved(state, products, adapted, fitted, turn, np.clip(fitted.variance, _LEAST * widest**2, widest**2),
                   promised)


def _follow(recorded: Recorded, models: Mapping[str, PartModel], laws: Mapping[Pair, Candidate], solved: _Solved,
            settled: float) -> _Solved | None:
    """Step on with the columns of the models as long as each step promises much less than the one before.

    The last solved model is returned, at the state to which the steps lead, and None where the first one leads nowhere.
    """
    for number in range(_STEPS):
        there = _descend(recorded, models, laws, solved.priors, solved.variance, solved.state,
                         _moved(recorded, laws, solved.fitted, solved.turn, solved.state), solved.products, settled)
        if there is None:
            return solved if number else None
        state, models = there
        following = _solve(recorded, models, laws, solved.priors, solved.variance, state)
        if following is None:
            return replace(solved, state=state)
        if following.promised < settled or following.promised > _SHRUNK * solved.promised:
            return following
        solved = following
    return solved


def _descend(recorded: Recorded, models: Mapping[str, PartModel], laws: Mapping[Pair, Candidate],
             priors: Mapping[Pair, Prior], variance: np.ndarray, here: State, there: State, products: Products,
             settled: float) -> tuple[State, dict[str, PartModel]] | None:
    """Return the state on the way from `here` to `there` at which the posterior is not lower, with models there.

    The models have the columns of those that are given. None is returned where no halved step is good enough.
    """
    least = _posterior_at(products, laws, priors, here, variance) - settled
    for _ in range(_TRIALS):
        moved = {name: move_part(recorded, model, there) for name, model in models.items()}
        reached = assemble(recorded, moved, laws, there)
        if np.isfinite(reached.values).all() and _posterior_at(reached, laws, priors, there, variance) >= least:
            return there, moved
        there = _halfway(here, there)
    return None


def join_recorded(groups: Sequence[Recorded]) -> Recorded:
    """Return groups of parts that share nothing as one."""
    return replace(groups[0], parts=tuple(part for each in groups for part in each.parts),
                   random=tuple(term for each in groups for term in each.random),
                   shared=tuple(term for each in groups for term in each.shared))


def join(fits: Sequence[Fit]) -> Fit:
    """Return the fits of groups of parts that share nothing as one, at the same state."""
    if len(fits) == 1:
        return fits[0]
    recorded = join_recorded([each.recorded for each in fits])
    laws, priors = dict[Pair, Candidate](), dict[Pair, Prior]()
    models, tracks = dict[str, PartModel](), dict[str, np.ndarray]()
    for each in fits:
        laws, priors, models = {**laws, **each.laws}, {**priors, **each.priors}, {**models, **each.models}
        tracks = {**tracks, **each.state.tracks}
    state = State(np.concatenate([each.state.points for each in fits], axis=1),
                  np.concatenate([each.state.means for each in fits]),
                  np.concatenate([each.state.shared for each in fits]),
                  {pair: c for each in fits for pair, c in each.state.laws.items()}, tracks)
    products = assemble(recorded, models, laws, state)
    gram, turn = products.gram([priors[pair].root(law) for pair, law in laws.items()])
    variance = np.concatenate([each.fitted.variance for each in fits])
    return Fit(recorded, laws, priors, state, models, products, estimate(gram, variance, fixed=True), turn,
               sum(each.evidence for each in fits), sum(each.promised for each in fits),
               all(each.converged for each in fits))


def assemble(recorded: Recorded, models: Mapping[str, PartModel], laws: Mapping[Pair, Candidate],
             state: State) -> Products:
    """Return the products of all parts."""
    sizes = tuple(law.count for law in laws.values())
    count = len(recorded.random) + len(recorded.shared) + sum(sizes) + 1
    total = np.zeros((len(recorded), count, count))
    for model in models.values():
        gram = model.rows @ model.rows.transpose(0, 2, 1)
        onto = expand(recorded, model, laws, state)
        total += onto.transpose(0, 2, 1) @ gram @ onto
    return Products(recorded, total, sizes)


def expand(recorded: Recorded, model: PartModel, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
    """Return the map (n, r + 1, c) from all coefficients, and 1 for the residual at 0, to the rows of a part."""
    n, terms = len(recorded), (*recorded.random, *recorded.shared)
    count = len(terms) + sum(law.count for law in laws.values()) + 1
    onto = np.zeros((n, model.rows.shape[1], count))
    for place, term in enumerate(terms):
        if touches(term, model.part):
            onto[:, model.keys.index(key_of_term(term)), place] = term.size * term.values
    first = len(terms)
    for pair, law in laws.items():
        places = slice(first, first + law.count)
        if pair in model.places:
            rows = np.arange(model.places[pair].start, model.places[pair].stop)
            onto[:, rows, np.arange(first, first + law.count)] = 1.0
        elif model.part.name in law.variables:
            row = model.keys.index(key_of_law(law, model.part))
            onto[:, row, places] += law.size * law.variables[model.part.name].basis(None, 1)[:, :, 0]
        first += law.count
    shared = np.concatenate([state.shared, *(state.laws[pair] for pair in laws)])
    values = np.concatenate([state.points, np.broadcast_to(shared, (n, len(shared)))], axis=1)
    onto[:, :, -1] = np.einsum("nrc,nc->nr", onto[:, :, :-1], values)
    onto[:, -1, -1] += 1.0
    return onto


def law_products(fit_: Fit, candidate: Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Return the products of a candidate's columns with all columns of a fit (n, m, c), and with each other (n, m,
    m)."""
    recorded, count = fit_.recorded, fit_.products.values.shape[1]
    cross = np.zeros((len(recorded), candidate.count, count))
    own = np.zeros((len(recorded), candidate.count, candidate.count))
    for name, variable in candidate.variables.items():
        model = fit_.models[name]
        white = model.white(model.law_columns(candidate))
        against = white @ model.rows.transpose(0, 2, 1) @ fit_.onto[name]
        square = white @ white.transpose(0, 2, 1)
        if variable.kind == "between":
            factors = candidate.size * variable.basis(None, 1)[:, :, 0]
            cross += factors[:, :, None] * against
            own += factors[:, :, None] * factors[:, None, :] * square
        else:
            cross += against
            own += square
    return cross, own


def adapt_priors(products: Products, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior],
                 variance: np.ndarray) -> dict[Pair, Prior]:
    """Return the priors with amplitude and smoothness of each law of the largest evidence, beside the others."""
    adapted = dict(priors)
    for number, (pair, law) in enumerate(laws.items()):
        if not adapted[pair].is_kept:
            roots = [np.eye(law.count) if other == pair else adapted[other].root(each)
                     for other, each in laws.items()]
            gram, _ = products.gram(roots)
            adapted[pair] = choose_prior(gram, law, products.places(number, roots), variance,
                                         adapted[pair].known_up_to)[1]
    return adapted


def count_replaced(products: Products, law: Candidate, places: np.ndarray) -> int:
    """Return up to how many flat forms a law with raw coefficients at `places` is known: those that terms replace.

    A form is replaced where the terms, with their priors, leave less than `_INDEPENDENT` of its information.
    """
    if len(places) > sum(law.families[:1]):
        return 0
    total, count = products.values.sum(axis=0), products.first
    terms = (*products.recorded.random, *products.recorded.shared)
    inner = total[:count, :count] + np.diag([1 / term.std**2 for term in terms])
    forms = flat_forms(len(places))
    for number, form in enumerate(forms.T):
        # A line is replaced beside the constant, which is among the terms then.
        cross, whole = total[:count, places] @ form, float(form @ total[np.ix_(places, places)] @ form)
        if whole - cross @ np.linalg.solve(inner, cross) > _INDEPENDENT * whole:
            return number
    return int(forms.shape[1])


def choose_prior(gram: Gram, law: Candidate, places: np.ndarray, variance: np.ndarray,
                 known_up_to: int = 0) -> tuple[float, Prior]:
    """Return the gain in evidence and the prior of a law whose raw coefficients have these `places` in a model."""
    marginal = marginalise(gram, variance)[0].sum(axis=0)
    others = np.setdiff1d(np.arange(len(gram.precision)), places)
    inner = marginal[np.ix_(others, others)] + np.diag(gram.precision[others])
    solved = np.linalg.solve(inner, np.column_stack([
        marginal[others, -1] + gram.precision[others] * gram.target[others], marginal[np.ix_(others, places)]]))
    pull = marginal[places, -1] - marginal[np.ix_(places, others)] @ solved[:, 0]
    information = marginal[np.ix_(places, places)] - marginal[np.ix_(places, others)] @ solved[:, 1:]
    best = 0.0, Prior(float(AMPLITUDES[0]), known_up_to=known_up_to)
    for walk in WALKS if len(places) > 2 else WALKS[:1]:
        root = form_root(law.families, walk, known_up_to)
        if not root.shape[1]:
            continue
        values, axes = np.linalg.eigh(root.T @ information @ root)
        along = (axes.T @ (root.T @ pull)) ** 2
        square = AMPLITUDES[:, None] ** 2
        spread = square * np.maximum(values, 0)
        gain = 0.5 * (square * along / (1 + spread) - np.log1p(spread)).sum(axis=1)
        place = int(np.argmax(gain))
        if gain[place] > best[0]:
            best = float(gain[place]), Prior(float(AMPLITUDES[place]), walk, known_up_to)
    return best


def coefficients_of(fitted: Fitted, turn: np.ndarray, recorded: Recorded) -> np.ndarray:
    """Return all raw coefficients (n, c - 1) of each run."""
    random = len(recorded.random)
    raw = np.tile(turn[:-1, :-1] @ fitted.coefficients, (len(recorded), 1))
    raw[:, :random] += fitted.each
    return raw


def _inside(turn: np.ndarray, fitted: Fitted, state: State, laws: Mapping[Pair, Candidate]) -> np.ndarray:
    """Return the coefficients of the mixed model at a state."""
    random = fitted.gram.random
    raw = np.concatenate([state.means, state.shared, *(state.laws[pair] for pair in laws)])
    inside = np.linalg.lstsq(turn[random:-1, random:-1], raw[random:], rcond=None)[0]
    return np.concatenate([raw[:random], inside])


def _posterior_at(products: Products, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior], state: State,
                  variance: np.ndarray) -> float:
    gram, turn = products.gram([priors[pair].root(law) for pair, law in laws.items()])
    fitted = estimate(gram, variance, fixed=True)
    return fitted.at(_inside(turn, fitted, state, laws)).posterior


def _halfway(here: State, there: State) -> State:
    laws = {pair: 0.5 * (c + there.laws[pair]) for pair, c in here.laws.items()}
    points, means, shared = (0.5 * (getattr(here, name) + getattr(there, name))
                             for name in ("points", "means", "shared"))
    return State(points, means, shared, laws, here.tracks)


def _moved(recorded: Recorded, laws: Mapping[Pair, Candidate], fitted: Fitted, turn: np.ndarray, state: State) -> State:
    raw = coefficients_of(fitted, turn, recorded)
    random, shared = len(recorded.random), len(recorded.shared)
    ends = np.cumsum([random + shared, *(law.count for law in laws.values())])
    values = {pair: raw[0, first:last] for pair, first, last in zip(laws, ends[:-1], ends[1:], strict=True)}
    furthest = np.maximum(_FURTHEST, [_WIDTHS * term.widest for term in recorded.random])
    return replace(state, points=np.clip(raw[:, :random], -furthest, furthest),
                   means=fitted.coefficients[:random],
                   shared=raw[0, random:random + shared], laws=values)
