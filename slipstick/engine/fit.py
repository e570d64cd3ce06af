"""The nonlinear mixed model of a machine's parts with laws: Gauss-Newton steps, random effects by REML, laws by
evidence.

Each step solves the linear mixed model about the parameters of every run (linear_model.py), in which the coefficients
of a law have the prior of its amplitude and smoothness; these are those of the largest marginal likelihood.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from slipstick.engine.columns import Columns, fit_columns, join_columns
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import Fitted, estimate, restricted_likelihood
from slipstick.engine.model import State
from slipstick.engine.part_fit import PartFit
from slipstick.engine.priors import Prior, adapt_priors
from slipstick.engine.products import Products, list_shared
from slipstick.engine.recordings import Pair, Recorded, pose_nominal
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue

_BUILDS, _STEPS, _TRIALS = 10, 10, 4
"""Most times that columns are computed, most steps with the same ones, and most trials of a step, each half as long."""
_PATIENCE = 3
"""Builds without more evidence after which a fit ends: where a state meets a surface, derivatives jump with the
instants of a grid, and steps go to and fro about a solution."""
_SHRUNK = 0.5
"""Share of what the step before has promised above which columns are computed anew."""
HOPED = 3.0
"""Times what a step promises that a fit may still gain."""
SETTLED = 0.1
"""Nats that a step promises, or by which it may lower the posterior, at which a fit ends: no decision depends on it."""
_FIRST, _LEAST = 1e-4, 1e-10
"""Variances of random effects, relative to their scale: to begin with, and at least."""
_FURTHEST, _WIDTHS = 0.8, 6.0
"""Largest magnitude of a change of a parameter in its scale, so that a positive one stays positive, or in its widest
scatter where that is more."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A machine's parts with `laws` at a `state`: the `columns` of the parts, the mixed model, and its evidence.

    `evidence` is the log marginal likelihood in nats, without the determinant of the noise. `turn` maps the
    coefficients of the mixed model to raw ones. `promised` are the nats that another step promises, less than 0 where
    the state is beyond the reach of the prior; `converged` tells that these are few enough.
    """

    recorded: Recorded
    laws: Mapping[Pair, Candidate]
    priors: Mapping[Pair, Prior]
    state: State
    columns: Columns
    products: Products
    fitted: Fitted
    turn: np.ndarray
    evidence: float
    promised: float
    converged: bool

    @property
    def models(self) -> Mapping[str, PartFit]:
        """The linear models of the parts."""
        return self.columns.models

    @property
    def roots(self) -> list[np.ndarray]:
        """The roots of the laws' priors, in their order."""
        return [self.priors[pair].root(law) for pair, law in self.laws.items()]

    def onto(self, name: str) -> np.ndarray:
        """Return the map (n, r + 1, c) from all coefficients to the rows of a part."""
        return self.columns.expand(self.recorded, name, self.laws, self.state)

    @cached_property
    def squares(self) -> dict[str, np.ndarray]:
        """Sum of squares (n,) of the whitened residuals of each part, at the estimated parameters of each run.

        Where its state is held at the end of what it may have, they are those: no step gets further.
        """
        coefficients, squares = coefficients_of(self.fitted, self.turn, self.recorded), dict[str, np.ndarray]()
        points = _locate(coefficients, self.columns, self.laws, self.state)
        nearest = _reach(points, self.recorded)
        coefficients[:, :points.shape[1]] += np.where(nearest == self.state.points, nearest - points, 0.0)
        for name, model in self.models.items():
            onto = self.onto(name)
            left = onto[:, :, -1] - np.einsum("nrc,nc->nr", onto[:, :, :-1], coefficients)
            squares[name] = np.einsum("nr,nrq,nq->n", left, model.gram, left)
        return squares

    @property
    def chi_square(self) -> dict[str, np.ndarray]:
        """Reduced chi-square (n,) of each part, over the variances of the noise alone."""
        return {name: squares * model.part.temper / np.maximum(model.part.counted.sum(axis=(1, 2)), 1)
                for (name, squares), model in zip(self.squares.items(), self.models.values(), strict=True)}

    @property
    def solution(self) -> State:
        """The state to which the linear model leads."""
        return _moved(self.recorded, self.columns, self.laws, self.fitted, self.turn, self.state)

    @property
    def means(self) -> np.ndarray:
        """Means (r,) of the random terms over the runs."""
        return self.fitted.coefficients[:len(self.recorded.random)]

    def take(self, rows: np.ndarray) -> "Fit":
        """Return the linear model of the runs `rows` about the state of all, solved anew."""
        recorded, state = self.recorded.take(rows), self.state.take(rows)
        laws = {pair: law.take(rows) for pair, law in self.laws.items()}
        columns = self.columns.take(rows, recorded, laws)
        solved = _solve(recorded, columns, laws, self.priors, self.fitted.variance, state)
        assert solved is not None  # as that of all runs
        return Fit(recorded, laws, solved.priors, state, columns, solved.products, solved.fitted, solved.turn,
                   solved.evidence, solved.promised, self.converged)

    def again(self, recorded: Recorded, origin: State | None = None) -> "Fit":
        """Return the fit of the same runs with another noise, or with signals that are explained anew: from here on, or
        from an `origin`."""
        laws = {pair: law.renew(recorded) for pair, law in self.laws.items()}
        return fit(recorded, laws, self.priors, origin or self.state, self.fitted.variance if origin is None else None)

    def beside(self, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior], state: State | None = None,
               settled: float = 0.0, needed: float = -np.inf) -> "Fit":
        """Return the fit with further laws from here on, or from another state."""
        return fit(self.recorded, {**self.laws, **laws}, {**self.priors, **priors}, state or self.state,
                   self.fitted.variance, settled, needed)

    def restart(self, state: State | None = None, variance: np.ndarray | None = None) -> "Fit":
        """Return the better one of this fit and of one from another state: that of all runs at the means of their
        parameters, if no other one is given.

        Where something was missing, those of some runs may have been driven to another optimum, and the scatter with
        them.
        """
        state = state or replace(self.state, points=np.tile(self.state.means, (len(self.state.points), 1)))
        try:
            anew = fit(self.recorded, self.laws, self.priors, state, variance)
        except InvalidValue:  # no finite solution there
            return self
        return max(self, anew, key=lambda each: each.evidence)


def begin(recorded: Recorded) -> State:
    """Return the state where all terms are at their targets: that of nominal parameters, if no other runs are known."""
    means, shared = (np.array([term.target for term in terms]) for terms in (recorded.random, recorded.shared))
    return State(np.tile(means, (len(recorded), 1)), means, shared, {})


def fit(recorded: Recorded, laws: Mapping[Pair, Candidate], priors: Mapping[Pair, Prior], state: State | None = None,
        variance: np.ndarray | None = None, settled: float = 0.0, needed: float = -np.inf) -> Fit:
    """Fit the parts with laws from a state on, where laws that it lacks are 0; some priors are kept.

    The fit ends where a step promises less than `settled` nats, of which SETTLED are the least, and fewer where the
    last columns have gained more than they promised; where it gains nothing any more, or where it will stay short of
    the evidence that is `needed`. Columns are kept over the steps as long as each promises much less than the one
    before (a chord method: Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995, section 5.4.1), and are
    those of the state where it ends. With the columns, the noise that a model carries changes as well, so that the
    solution is the fixed point of these steps: where they lead away from it, or past it and back, half of the way is
    gone (under-relaxation).
    """
    state, settled = state or begin(recorded), max(settled, SETTLED)
    variance = np.full(len(recorded.random), _FIRST) if variance is None else np.maximum(variance, _FIRST * 1e-4)
    state = replace(state, laws={pair: state.laws.get(pair, np.zeros(law.count)) for pair, law in laws.items()})
    best: Fit | None = None
    last: Fit | None = None
    worse = 0
    for _ in range(_BUILDS):
        columns = fit_columns(recorded, laws, state)
        solved = _solve(recorded, columns, laws, priors, variance, state)
        if solved is None or not np.isfinite(evidence := solved.evidence):  # squares may overflow where values do not
            break
        # What the last columns have gained beside what they promised tells how far these can be believed.
        trusted = 1.0 if last is None else min(1.0, max(last.promised, 0.0) / max(evidence - last.evidence, SETTLED))
        current = Fit(recorded, dict(laws), solved.priors, solved.state, columns.release(), solved.products,
                      solved.fitted, solved.turn, evidence, solved.promised,
                      abs(solved.promised) < max(trusted * settled, SETTLED))
        if current.converged:  # at the fixed point, and not where steps to it happened to pass
            return current
        worse += 1
        if best is None or current.evidence > best.evidence:
            best, worse = current, 0
        if worse == _PATIENCE or current.evidence + HOPED * current.promised < needed:
            return best
        if last is not None and current.promised >= last.promised and current.evidence <= last.evidence:
            state = _halfway(last.state, state)
            continue
        last = current
        following = _follow(recorded, columns, laws, solved, settled)
        if following is None:  # no way leads on
            break
        state, priors, variance = following.state, following.priors, following.variance
    if best is None:
        raise _lack_solution("The equations have no finite solution at the parameters at which a fit begins")
    return best


def require_solutions(recorded: Recorded) -> None:
    """Raise `InvalidValue` where the equations of a part have no finite solution at nominal parameters."""
    for part in recorded.parts:
        outputs = solve(pose_nominal(part)).outputs[:, :, ::part.fine]
        if not np.isfinite(outputs[part.counted]).all():
            raise _lack_solution(f"The equations of “{part.name}” have no finite solution at nominal parameters")


def _lack_solution(cause: str) -> InvalidValue:
    return InvalidValue(cause, "Check the units, signs and channels of the recordings, the nominal values of the "
                               "parameters, and the equations at the largest inputs")


@dataclass(frozen=True, eq=False)
class _Solved:
    """The linear mixed model about a `state`, solved, with the `priors` and the `variance` of the largest evidence.

    `restricted` is the log-likelihood of the solution in nats, up to a constant; a step to it promises `promised` nats.
    """

    state: State
    products: Products
    priors: dict[Pair, Prior]
    fitted: Fitted
    turn: np.ndarray
    variance: np.ndarray
    restricted: float
    promised: float

    @property
    def evidence(self) -> float:
        """Log marginal likelihood in nats at the state, up to a constant."""
        return self.restricted - self.promised


def _solve(recorded: Recorded, columns: Columns, laws: Mapping[Pair, Candidate],
           priors: Mapping[Pair, Prior], variance: np.ndarray, state: State) -> _Solved | None:
    """Solve the linear mixed model of columns about a state; None where it has no finite solution."""
    products = columns.assemble(recorded, laws, state)
    if not np.isfinite(products.values).all():
        return None
    try:
        # Adapted priors may be worse: those of a law that parameters replace, if they are far beyond their reach.
        adapted = adapt_priors(products, laws, priors, variance)
        chosen = [adapted, *([dict(priors)] if any(adapted[pair] is not priors[pair] for pair in laws) else [])]
        return max((_solve_with(each, products, laws, variance, state) for each in chosen),
                   key=lambda each: each.restricted)
    except np.linalg.LinAlgError:  # of values so large that no digit of the priors is left
        return None


def _solve_with(priors: dict[Pair, Prior], products: Products, laws: Mapping[Pair, Candidate], variance: np.ndarray,
                state: State) -> _Solved:
    """Solve the linear mixed model of products with these priors."""
    gram, turn = products.gram([priors[pair].root(law) for pair, law in laws.items()])
    fitted = estimate(gram, variance)
    promised = fitted.posterior - fitted.at(_inside(turn, fitted, state, laws)).posterior
    variance = np.clip(fitted.variance, _LEAST * gram.widest**2, gram.widest**2)
    return _Solved(state, products, priors, fitted, turn, variance, restricted_likelihood(gram, fitted.variance),
                   promised)


def _follow(recorded: Recorded, columns: Columns, laws: Mapping[Pair, Candidate], solved: _Solved,
            settled: float) -> _Solved | None:
    """Step on with the same columns as long as each step promises much less than the one before.

    The last solved model is returned, at the state to which the steps lead, and None where the first one leads nowhere.
    """
    for number in range(_STEPS):
        there = _descend(recorded, columns, laws, solved, settled)
        if there is None:
            return solved if number else None
        state, columns = there
        following = _solve(recorded, columns, laws, solved.priors, solved.variance, state)
        if following is None:
            return replace(solved, state=state)
        if following.promised < settled or following.promised > _SHRUNK * solved.promised:
            return following
        solved = following
    return solved


def _descend(recorded: Recorded, columns: Columns, laws: Mapping[Pair, Candidate], solved: _Solved,
             settled: float) -> tuple[State, Columns] | None:
    """Return the state on the way to the solution at which the posterior is not lower, with the same columns there.

    None is returned where no halved step is good enough.
    """
    here, there = solved.state, _moved(recorded, columns, laws, solved.fitted, solved.turn, solved.state)
    least = solved.fitted.posterior - solved.promised - settled
    for _ in range(_TRIALS):
        moved = columns.move(there)
        reached = moved.assemble(recorded, laws, there)
        if np.isfinite(reached.values).all() and _posterior_at(reached, laws, solved, there) >= least:
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
    for each in fits:
        laws, priors = {**laws, **each.laws}, {**priors, **each.priors}
    state = State(np.concatenate([each.state.points for each in fits], axis=1),
                  np.concatenate([each.state.means for each in fits]),
                  np.concatenate([each.state.shared for each in fits]),
                  {pair: c for each in fits for pair, c in each.state.laws.items()})
    columns = join_columns([each.columns for each in fits], [len(each.recorded.shared) for each in fits])
    products = columns.assemble(recorded, laws, state)
    gram, turn = products.gram([priors[pair].root(law) for pair, law in laws.items()])
    variance = np.concatenate([each.fitted.variance for each in fits])
    return Fit(recorded, laws, priors, state, columns, products, estimate(gram, variance, fixed=True), turn,
               sum(each.evidence for each in fits), sum(each.promised for each in fits),
               all(each.converged for each in fits))


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


def _posterior_at(products: Products, laws: Mapping[Pair, Candidate], solved: _Solved, state: State) -> float:
    """Return the posterior at a state, with the priors and variances of a solved model."""
    gram, turn = products.gram([solved.priors[pair].root(law) for pair, law in laws.items()])
    fitted = estimate(gram, solved.fitted.variance, fixed=True)
    return fitted.at(_inside(turn, fitted, state, laws)).posterior


def _halfway(here: State, there: State) -> State:
    laws = {pair: 0.5 * (c + there.laws[pair]) for pair, c in here.laws.items()}
    points, means, shared = (0.5 * (getattr(here, name) + getattr(there, name))
                             for name in ("points", "means", "shared"))
    return State(points, means, shared, laws)


def _moved(recorded: Recorded, columns: Columns, laws: Mapping[Pair, Candidate], fitted: Fitted, turn: np.ndarray,
           state: State) -> State:
    raw = coefficients_of(fitted, turn, recorded)
    random, shared = len(recorded.random), len(recorded.shared)
    points = _locate(raw, columns, laws, state)
    ends = np.cumsum([random + shared, *(law.count for law in laws.values())])
    values = {pair: raw[0, first:last] for pair, first, last in zip(laws, ends[:-1], ends[1:], strict=True)}
    return replace(state, points=_reach(points, recorded), means=fitted.coefficients[:random],
                   shared=raw[0, random:random + shared], laws=values)


def _locate(raw: np.ndarray, columns: Columns, laws: Mapping[Pair, Candidate], state: State) -> np.ndarray:
    """Return the parameters (n, q) of each run of raw coefficients (n, c - 1) about a state."""
    random = columns.shift.shape[1]
    return np.asarray(raw[:, :random] + columns.shift @ (raw[0, random:] - list_shared(laws, state)))


def _reach(points: np.ndarray, recorded: Recorded) -> np.ndarray:
    """Return the parameters (n, q), or the nearest ones that a run may have."""
    furthest = np.maximum(_FURTHEST, _WIDTHS * recorded.widest)
    return np.asarray(np.clip(points, -furthest, furthest))
