"""Fits of the closing piston from several places: it is far from linear, and its likelihood has local maxima."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipstick.naming.block import Laws, Pair, SearchedBlock, changed
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.search import relocated, retimed

_RESTARTS, _RISE = 4, 1.0
"""Restarts of a fit from its own means, and the nats that one must gain for another one."""
_MISFIT = 1.5
"""Reduced chi-square of an engagement from which its piston is searched again."""
_REGAININGS = 3
"""Searches for the engagements that a fit misses."""
_LOUDER = (100.0, 30.0, 10.0, 3.0)
"""Noise of the first steps of a fit, relative to that of the sensor."""


def evidence_of(fit: CurvedFit) -> float:
    """Evidence of all engagements in nats."""
    return float(fit.evidence.sum())


def settled(block: SearchedBlock, points: np.ndarray, shared: np.ndarray, laws: tuple[Pair, ...] = (),
            coefficients: Mapping[Pair, np.ndarray] | None = None) -> CurvedFit:
    """The best fit from `points` (n, q) and `shared` values, from searches where it fails, and from its own means."""
    known = coefficients or {}
    timed = retimed(block, points, shared, [(law, known[law]) for law in laws])
    best = fit_curved(block, laws, points=timed, coefficients=known, shared=shared, iterations=8)
    rows = _missed(best)
    if rows.any():
        located = relocated(block, best.points, best.shared, best.held, rows)
        again = fit_curved(block, laws, points=located, coefficients=best.coefficients, shared=best.shared,
                           iterations=8)
        best = max(best, again, key=evidence_of)
    for _ in range(_RESTARTS):
        again = from_common(block, best.mean, best.shared, best.held, iterations=8)
        if not evidence_of(again) > evidence_of(best) + _RISE:
            break
        best = again
    return best


def from_common(block: SearchedBlock, means: np.ndarray, shared: np.ndarray, held: Laws, iterations: int) -> CurvedFit:
    """A fit with the laws `held` that begins where all engagements have the parameters `means` (q,).

    Points that a fit without a law has scattered to explain what it cannot do not come back by steps of their own.
    """
    points = np.tile(means, (len(block.measured), 1))
    return fit_curved(block, [law for law, _ in held], points=retimed(block, points, shared, held),
                      coefficients=dict(held), shared=shared, iterations=iterations)


def regained(block: SearchedBlock, start: CurvedFit) -> CurvedFit:
    """The best fit, from `start` on, in which engagements that it misses are searched again about the other ones.

    A few engagements that are far off decide what all have in common. Means and laws are therefore fitted to the others
    alone, until a search with these finds them.
    """
    best = now = start
    for _ in range(_REGAININGS):
        missed = _missed(now)
        if not missed.any():
            break
        points = np.where(missed[:, None], np.median(now.points[~missed], axis=0), now.points)
        others = fit_curved(changed(block, counted=block.counted & ~missed[:, None]), now.laws, points=points,
                            coefficients=now.coefficients, shared=now.shared, iterations=8)
        points = np.where(missed[:, None], others.mean, others.points)
        points = relocated(block, points, others.shared, others.held, missed)
        now = fit_curved(block, now.laws, points=points, coefficients=others.coefficients, shared=others.shared,
                         iterations=8)
        best = max(best, now, key=evidence_of)
    return best


def annealed(block: SearchedBlock, now: CurvedFit, pair: Pair) -> CurvedFit:
    """A fit with a further pair from nominal points on, as if the noise were large at first, and less step by step.

    A fit without the law has parameters that stand for it, from which no step leads back. With little weight on the
    data engagements stay near what they have in common, and the law explains what they show alike.
    """
    (std, rho), scene = block.scene.noise[block.signal], block.scene
    points, shared, known = np.zeros_like(now.points), now.shared, now.coefficients
    for louder in _LOUDER:
        noise = {**scene.noise, block.signal: (std * louder, rho)}
        fit = fit_curved(changed(block, scene=replace(scene, noise=noise)), (*now.laws, pair), points=points,
                         coefficients=known, shared=shared, iterations=4)
        points, shared, known = retimed(fit.block, fit.points, fit.shared, fit.held), fit.shared, fit.coefficients
    return fit_curved(block, (*now.laws, pair), points=points, coefficients=known, shared=shared, iterations=3)


def _missed(fit: CurvedFit) -> np.ndarray:
    """Engagements (n,) with a far larger chi-square than the others."""
    return np.asarray(fit.chi2 > max(_MISFIT, 2 * float(np.median(fit.chi2))))
