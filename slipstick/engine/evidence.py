"""What a law gains: in log marginal likelihood, and held out in each run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.engine.fit import Fit
from slipstick.engine.laws import Candidate
from slipstick.engine.linear_model import Fitted, estimate, restricted_likelihood, solve
from slipstick.engine.part_fit import PartFit
from slipstick.engine.priors import Prior, choose_prior, count_replaced
from slipstick.engine.products import Products
from slipstick.engine.recordings import Pair

FEWEST = 3
"""Runs of which it can be said that they agree: with fewer, nothing would ever be named or unexplained."""
_WORTH = 2.0
"""Nats at fixed variances below which a candidate is not compared further."""


@dataclass(frozen=True, eq=False)
class Screened:
    """The gain in nats of a candidate in the linear model about a fit, and the prior with which it has this gain."""

    candidate: Candidate
    nats: float
    prior: Prior


Multiplied = dict[tuple[str, Pair], tuple[np.ndarray, np.ndarray]]
"""The products of the columns of a law with all rows of a part, and with each other, by the names of both."""


def multiply(models: Mapping[str, PartFit], candidates: Sequence[Candidate]) -> Multiplied:
    """Return the products of candidates with few coefficients in each part on which they act."""
    multiplied: Multiplied = {}
    for name, model in models.items():
        acting = [each.coarse() for each in candidates if name in each.variables and each.pair not in model.laws]
        if acting:
            products = model.multiply(acting)
            multiplied |= {(name, each.pair): product for each, product in zip(acting, products, strict=True)}
    return multiplied


def screen(fit: Fit, candidates: Sequence[Candidate], multiplied: Multiplied) -> list[Screened]:
    """Return the gains of candidates with few coefficients about a fit, the largest first.

    `multiplied` are their products, which are used up.
    """
    onto = {name: fit.onto(name) for name in fit.models}
    screened = [_screen(fit, candidate, few, _join(fit, few, onto, multiplied)) for candidate in candidates
                if candidate.pair not in fit.laws for few in [candidate.coarse()]]
    return sorted(screened, key=lambda each: -each.nats)


def _screen(fit: Fit, candidate: Candidate, coarse: Candidate, products: Products) -> Screened:
    if not np.isfinite(products.values).all():  # no linear response
        return Screened(candidate, 0.0, Prior())
    roots = [*fit.roots, np.eye(coarse.count)]
    raw_gram, _ = products.gram(roots)
    places = products.places(len(roots) - 1, roots)
    known_up_to = count_replaced(raw_gram, coarse, places)
    variance = fit.fitted.variance
    for _ in range(2):  # the prior at the variances without the law, and then at those with it
        gain, prior = choose_prior(raw_gram, coarse, places, variance, known_up_to)
        if gain < _WORTH:
            return Screened(candidate, gain, prior)
        gram, _ = products.gram([*fit.roots, prior.root(coarse)])
        variance = estimate(gram, np.maximum(variance, 1e-8)).variance
        gain = restricted_likelihood(gram, variance) - fit.evidence
    return Screened(candidate, gain, prior)


def _join(fit: Fit, candidate: Candidate, onto: Mapping[str, np.ndarray], multiplied: Multiplied) -> Products:
    """Return the products of all columns of a fit, joined by those of a candidate."""
    n, count = len(fit.recorded), fit.products.values.shape[1]
    cross, own = np.zeros((n, candidate.count, count)), np.zeros((n, candidate.count, candidate.count))
    for name, variable in candidate.variables.items():
        rows, square = multiplied.pop((name, candidate.pair))
        against = rows @ onto[name]
        if variable.kind == "between":
            factors = candidate.size * variable.basis()[:, :, 0]
            cross += factors[:, :, None] * against
            own += factors[:, :, None] * factors[:, None, :] * square
        else:
            cross += against
            own += square
    return fit.products.join(cross, own)


def hold_out(fitted: Fitted) -> np.ndarray:
    """Return the log density (n,) of each run given all others: coefficients are integrated out, variances are kept."""
    marginal, logdet, total = fitted.marginal, fitted.logdet, fitted.marginal.sum(axis=0)
    _, _, precision, target = solve(fitted.gram, total)  # with what holds a coefficient at the end of its reach
    prior = np.zeros_like(total)
    prior[:-1, :-1] = np.diag(precision)
    prior[:-1, -1] = prior[-1, :-1] = precision * target
    prior[-1, -1] = precision @ target**2

    def density(products: np.ndarray, logdets: np.ndarray) -> np.ndarray:
        scale = 1 / np.sqrt(np.diagonal(products[..., :-1, :-1], axis1=-2, axis2=-1))
        scaled = products[..., :-1, :-1] * scale[..., :, None] * scale[..., None, :]
        pull = products[..., :-1, -1] * scale
        quadratic = products[..., -1, -1] - (pull * np.linalg.solve(scaled, pull[..., None])[..., 0]).sum(axis=-1)
        return np.asarray(-0.5 * (logdets + quadratic + np.linalg.slogdet(scaled)[1] - 2 * np.log(scale).sum(axis=-1)))

    whole = density((total + prior)[None], logdet.sum())[0]
    return np.asarray(whole - density((total + prior)[None] - marginal, logdet.sum() - logdet))


def expect(fit: Fit, candidate: Candidate) -> np.ndarray:
    """Return the standard errors (n,) by which each run shows a law of a fit, if it is right."""
    places = fit.products.places(list(fit.laws).index(candidate.pair), fit.roots)
    c = fit.fitted.coefficients[places]
    square = np.einsum("p,npq,q->n", c, fit.fitted.marginal[:, places][:, :, places], c)
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def agree(gains: np.ndarray, expected: np.ndarray) -> float:
    """Return the agreement of the runs in standard errors, from their held-out `gains` (n,) in nats.

    The signed root of twice a gain is normal, with the `expected` (n,) mean where the law is right. These roots are
    regressed on it: runs in which a law does not act do not count, a run counts at most as much as all others together,
    and a few runs are not the agreement of all.
    """
    roots = np.sign(gains) * np.sqrt(2 * np.abs(gains))
    expected = np.minimum(expected, np.linalg.norm(np.sort(expected)[:-1]))
    square = float(expected @ expected)
    if square <= 0:
        return 0.0
    slope = float(expected @ roots) / square
    spread = float(((roots - slope * expected) ** 2).sum()) / (len(roots) - 1)
    return float(slope / max(np.sqrt(spread / square), 1e-9))


def agree_without_best(gains: np.ndarray, _: np.ndarray) -> float:
    """Return the agreement of few runs in standard errors: the signed root of twice the gain of all but the best one.

    Gains of some three runs hardly tell how much they scatter.
    """
    left = float(gains.sum() - gains.max())
    return float(np.sign(left) * np.sqrt(2 * abs(left)))
