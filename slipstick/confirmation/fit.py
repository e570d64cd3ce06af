"""The fit of the whole simulation without and with what was named, from the estimates of the blocks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from slipstick.confirmation.simulated import RANDOM, SimulatedBench
from slipstick.confirmation.starts import About, search_start, shared_of
from slipstick.confirmation.terms import Terms
from slipstick.confirmation.traces import TIME, Traces
from slipstick.engine.linear_model import REACH
from slipstick.naming.curved import CurvedFit, fit_curved

_ITERATIONS = 40
_LEAST = 1e-6
"""Least mean squared residual of an engagement whose logarithm is taken."""
_AT_BOUND, _UNDETERMINED = 0.01, 0.8
"""Share of a bound within which a mean is at it, and standard error over what was known before, or over the most that a
parameter scatters, beyond which recordings have told next to nothing."""
_ROUNDING = 1e-6
"""Nats by which a fit may be below the one that is nested in it: rounding errors."""


@dataclass(frozen=True, eq=False)
class SimulationFit:
    """A fit of the simulation: `values` (p,) of the coefficients of its terms, and the mixed model about them.

    `points` (n, q) are the parameters of the engagements relative to nominal, `mean` and `variance` (q,) how they are
    distributed, `evidence` (n,) the log-likelihood of each engagement in nats with them integrated out.
    """

    block: SimulatedBench
    fitted: CurvedFit

    @property
    def values(self) -> np.ndarray:
        """Coefficients (p,) of the terms in their units."""
        return self.block.values(self.fitted.shared)

    @property
    def evidence(self) -> np.ndarray:
        """Log-likelihood (n,) of the engagements in nats."""
        return self.fitted.evidence

    @property
    def chi_square(self) -> dict[str, float]:
        """Mean squared residual of each signal and of the shifting time, in units of its noise."""
        squares = self.block.traces.mean_squares(self.block.measured - self.fitted.predicted)
        return {channel: square * self.block.traces.noise[channel] ** 2 for channel, square in squares.items()}

    @property
    def usual_chi_square(self) -> dict[str, float]:
        """The same of a usual engagement, which a few bad ones do not change.

        That is the geometric mean over the engagements of the mean squared residual of a signal. For the shifting time,
        of which an engagement has one value, it is the median, over that of chi-square with one degree of freedom.
        """
        traces, chi_squares = self.block.traces, {}
        squares = (self.block.measured - self.fitted.predicted) ** 2 * self.block.counted
        for name, columns in traces.columns.items():
            each = squares[:, columns].sum(axis=1) / np.maximum(self.block.counted[:, columns].sum(axis=1), 1)
            usual = np.median(each) / scipy.stats.chi2(1).median() if name == TIME else np.exp(
                np.log(np.maximum(each, _LEAST)).mean())
            chi_squares[name] = float(usual) * traces.noise[name] ** 2
        return chi_squares

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (p, p) of the coefficients: a sandwich estimator over engagements."""
        q, spans = len(self.block.random), np.array([unknown.span for unknown in self.block.terms.unknowns])
        ends = slice(q, q + len(spans))
        return np.asarray(self._sandwich[ends, ends] * np.outer(spans, spans))

    @property
    def errors(self) -> dict[str, float]:
        """Standard error of each mean, relative to nominal, by the same estimator."""
        return self._named(np.sqrt(np.diag(self._sandwich)[:len(self.block.random)]))

    @property
    def at_bound(self) -> list[str]:
        """Parameters and conditions whose mean is as far from nominal as the fit lets it."""
        bounds = REACH * self.block.random_std
        return [name for name, mean, bound in zip(self.block.random, self.fitted.mean, bounds, strict=True)
                if abs(mean) > (1 - _AT_BOUND) * bound]

    @property
    def undetermined(self) -> list[str]:
        """Parameters and conditions whose mean the engagements tell no better than was known before."""
        q = len(self.block.random)
        left = np.sqrt(np.diag(self.fitted.fitted.covariance)[:q])
        return [name for name, error in zip(self.block.random, left, strict=True)
                if error > _UNDETERMINED * min(RANDOM[name])]

    @property
    def _sandwich(self) -> np.ndarray:
        """Covariance of means and of what engagements share (q + p + c, q + p + c)."""
        gram, solution = self.fitted.fitted.marginal, self.fitted.fitted.coefficients
        bread, scores = self.fitted.fitted.covariance, gram[:, :-1, -1] - gram[:, :-1, :-1] @ solution
        return np.asarray(bread @ (scores.T @ scores) @ bread)

    def _named(self, values: np.ndarray) -> dict[str, float]:
        return dict(zip(self.block.random, values.tolist(), strict=True))

    @property
    def parameters(self) -> dict[str, float]:
        """Mean of each parameter and condition, relative to nominal."""
        return self._named(self.fitted.mean)

    @property
    def scatter(self) -> dict[str, float]:
        """Standard deviation of each parameter and condition between engagements, relative to nominal."""
        return self._named(np.sqrt(self.fitted.variance))


def fit_simulation(traces: Traces, terms: Terms, points: np.ndarray, shared: np.ndarray | None = None,
                   widest: np.ndarray | None = None) -> SimulationFit:
    """Fit from `points` (n, q), and from coefficients that are searched where no `shared` values (p + c,) are given.

    Standard deviations of the parameters between engagements are at most `widest` (q,).
    """
    return _continued(_fit_roughly(traces, terms, points, shared, widest), traces, terms)


def _fit_roughly(traces: Traces, terms: Terms, points: np.ndarray, shared: np.ndarray | None = None,
                 widest: np.ndarray | None = None) -> SimulationFit:
    """The same by long steps of differences, which lead over kinks but do not end at the largest likelihood."""
    block = SimulatedBench(traces, terms, widest, rough=True)
    if shared is None:
        points, shared = search_start(block, points)
    return SimulationFit(block, fit_curved(block, points=points, shared=shared, iterations=_ITERATIONS))


def _continued(fit: SimulationFit, traces: Traces, terms: Terms) -> SimulationFit:
    """The fit with `terms` from where another one has ended; the coefficients that it does not have begin neutral."""
    block = SimulatedBench(traces, terms, fit.block.widest)
    shared = shared_of(fit.block, fit.fitted.shared, block)
    return SimulationFit(block, fit_curved(block, start=fit.fitted, shared=shared, iterations=_ITERATIONS))


def fit_extended(nested: SimulationFit, terms: Terms, points: np.ndarray) -> SimulationFit:
    """The fit with `terms`, of which the `nested` fit has none, from `points` (n, q) beside measured laws of the terms.

    They hold the constant up to which a law is known: the mean of the parameters gives it back.
    """
    traces, widest = nested.block.traces, nested.block.widest
    about = About(SimulatedBench(traces, nested.block.terms, widest), nested.fitted)
    block = SimulatedBench(traces, terms, widest)
    return fit_simulation(traces, terms, *search_start(block, points, about.taken(terms).mean(axis=0)), widest)


def confirmed(traces: Traces, terms: Terms, points: np.ndarray,
              is_enough: Callable[[np.ndarray], bool]) -> tuple[SimulationFit, SimulationFit]:
    """The fits without any of `terms`, and with those of them that the simulation asks for as well.

    Terms are added one after the other, each time that which gains most of those whose gain (n,) in nats is enough:
    blocks may need two names for what is one effect in the simulation. Fits may end too early: one whose gain is not
    enough also starts from the fit nested in it, and the fit without terms also starts where that with them ended.
    Noise is that which the fit with all terms leaves, in all of them.
    """
    def refit_unless_enough(after: SimulationFit, nested: SimulationFit) -> SimulationFit:
        return after if is_enough(after.evidence - nested.evidence) else refit_above(after, nested)

    bare = replace(terms, effects=(), laws=())
    whole = first = _fit_roughly(traces, bare, points)
    if terms.names:
        whole = fit_extended(first, terms, points)
        if not is_enough(whole.evidence - first.evidence):
            whole = best([whole, _continued(first, traces, terms)])
    traces = traces.with_noise(traces.mean_squares(traces.measured - whole.fitted.predicted))
    before = now = _continued(first, traces, bare)
    left = list(terms.names)
    while left:
        tried = {}
        for name in left:
            more = terms.only((*now.block.terms.names, name))
            tried[name] = refit_unless_enough(_continued(whole, traces, more), now)
        enough = [name for name in left if is_enough(tried[name].evidence - now.evidence)]
        if not enough:
            break
        name = max(enough, key=lambda term: float(tried[term].evidence.sum()))
        now = tried[name]
        left.remove(name)
    if now is before:
        return before, now
    again = fit_simulation(traces, bare, now.fitted.points)
    return (before, now) if best([before, again]) is before else (again, refit_unless_enough(now, again))


def with_scatter_of(after: SimulationFit, before: SimulationFit) -> list[SimulationFit]:
    """Fits of the model of `before` with no more scatter of the parameters than the fit `after` has found.

    Scatter belongs to the bench. A model that lacks an effect, free to scatter as it likes, explains each engagement by
    itself and predicts none. Its likelihood has many maxima: there is a fit from the mean parameters of either.
    """
    own, widest = after.fitted.points - after.fitted.mean, np.sqrt(after.fitted.variance)
    return [fit_simulation(after.block.traces, before.block.terms, own + mean, widest=widest)
            for mean in (after.fitted.mean, before.fitted.mean)]


def refit_above(after: SimulationFit, before: SimulationFit) -> SimulationFit:
    """The fit `after`, or a better one that starts where `before` ended, whose model is nested in it.

    Raises `AssertionError` if both are below `before`.
    """
    again = _continued(before, before.block.traces, after.block.terms)
    highest = best([after, again])
    if highest.evidence.sum() < before.evidence.sum() - _ROUNDING:
        raise AssertionError("A fit with more terms is below the fit without them, which is nested in it")
    return highest


def best(fits: Sequence[SimulationFit]) -> SimulationFit:
    """The fit of the largest evidence."""
    return max(fits, key=lambda fit: float(fit.evidence.sum()))
