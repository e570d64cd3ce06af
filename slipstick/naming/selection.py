"""Which pairs of quantity and dependence the recordings ask for in a block, one after the other."""

from dataclasses import dataclass

import numpy as np

from slipstick.naming.curved import fit_curved
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import fit
from slipstick.naming.search import retimed

NATS = 12.0
ERRORS = 4.5
APART = 2.5
FURTHER = 0.03
"""Share of what the first finding of a block explains that a further one must add: less may be no more than what a free
law with few knots leaves of the first."""
MOST = 3
STRONG, FINER = 2.0, 17
"""Reduced chi-square from which a law has more knots: what few leave of a strong one would look like another."""
RIVALS = 3


@dataclass(frozen=True, eq=False)
class Finding:
    """A pair that a block asks for: gain (n,) in nats an engagement, and the `rivals` that are not told apart from it."""

    block: str
    pair: tuple
    gain: np.ndarray
    rivals: tuple = ()

    @property
    def nats(self) -> float:
        return float(self.gain.sum())

    @property
    def errors(self) -> float:
        return in_errors(self.gain)


def in_errors(gain: np.ndarray) -> float:
    """Mean of gains (n,) in its standard errors."""
    return float(gain.mean() / (gain.std(ddof=1) / np.sqrt(len(gain)) + 1e-12))


def is_enough(gain: np.ndarray) -> bool:
    return bool(gain.sum() > NATS and in_errors(gain) > ERRORS)


def is_rival(best: np.ndarray, gain: np.ndarray) -> bool:
    """Whether a pair of gain (n,) is not told apart from the best one: by nats and by standard errors over engagements."""
    ahead = best - gain
    return is_enough(gain) and (ahead.sum() < NATS or in_errors(ahead) < APART)


def realised(before: dict, after: dict, size: int) -> np.ndarray:
    """Gain (n,) of fits of blocks over those before, at the price of BIC."""
    gain = sum(after[name].fitted.likelihood - before[name].fitted.likelihood for name in after)
    return np.asarray(gain - 0.5 * size * np.log(len(gain)) / len(gain))


def forward(fits: dict, most: int = MOST, log=lambda *_: None):
    """Add pairs to the blocks `fits` while the recordings ask for them: fits with their laws, and the findings."""
    fits, findings, done = dict(fits), [], set()
    first: dict = {}
    for one in fits.values():
        one.block.fine = FINER if one.chi2.mean() > STRONG else one.block.fine
    for _ in range(most + 1):
        tables = {name: table(one) for name, one in fits.items()}
        current = list(dict.fromkeys(law for one in fits.values() for law in one.laws))
        pairs = [pair for pair in dict.fromkeys(p for t in tables.values() for p in t.places) if pair not in current]
        found = gains(list(tables.values()), current, pairs)
        ranked = sorted(((pair, *its) for pair, its in found.items()), key=lambda one: -one[1].sum())
        log({name: round(float(one.chi2.mean()), 3) for name, one in fits.items()},
            [(" ~ ".join(pair), round(gain.sum(), 1), round(in_errors(gain), 1)) for pair, gain, *_ in ranked[:5]])
        taken: set = set()
        added = False
        for pair, gain, _, _, key in ranked:
            if set(key) & (taken | done) or not is_enough(gain):
                continue
            taken |= set(key)
            close = [one for one in ranked if one[0] != pair and set(one[4]) & set(key) and not set(one[4]) & (done | (taken - set(key)))
                     and is_enough(one[1]) and (in_errors(gain - one[1]) < 2 * APART or one[1].sum() > 0.5 * gain.sum())][:RIVALS]
            if any(len(one[4]) > 1 for one in [(pair, gain, None, None, key), *close]):
                # Several blocks share a coefficient, which only the joint linear model knows: its gains decide.
                close = [one for one in close if is_rival(gain, one[1])]
            tried = []
            for one in [(pair, gain, None, None, key), *close]:
                its = {name: fit(fits[name].block, (*fits[name].laws, one[0]), start=fits[name], iterations=12) for name in one[4]}
                size = len(tables[one[4][0]].places[one[0]])
                # Blocks that a rival does not touch count as they are.
                everything = {name: fits[name] for name in {*key, *(n for c in close for n in c[4])}} | its
                before = {name: fits[name] for name in everything}
                tried.append((realised(before, everything, size), one[0], its))
            if any(len(one[4]) > 1 for one in [(pair, gain, None, None, key), *close]):
                tried = [(one[1], one[0], t[2]) for one, t in zip([(pair, gain, None, None, key), *close], tried, strict=True)]
            tried.sort(key=lambda one: -one[0].sum())
            best, name, its = tried[0]
            log("   refitted", [(" ~ ".join(p), round(g.sum(), 1), round(in_errors(g), 1)) for g, p, _ in tried])
            blocks = set(its)
            if not is_enough(best) or any(best.sum() < FURTHER * first.get(b, 0) for b in blocks):
                done |= blocks
                continue
            for b in blocks:
                first.setdefault(b, best.sum())
            rivals = tuple((p, float(g.sum()), in_errors(best - g)) for g, p, _ in tried[1:] if is_rival(best, g))
            findings.append(Finding("+".join(its), name, best, rivals))
            fits |= its
            added = True
        if not added:
            break
    return fits, findings


PISTON = (("piston gain", "run order"), ("clearance", "run order"), ("film torque", "run order"), ("clearance", "pressure"),
          ("piston rate", "pressure"), ("piston rate", "piston rate"), ("piston rate", "piston position"),
          ("piston rate", "direction"), ("chamber pressure", "input speed"))
_SHARES = (0.15, 0.6)


def piston(block, start, least: float = 0.0, most: int = 2, log=lambda *_: None):
    """Add pairs to the closing piston: fits by Laplace's approximation, each from several starts."""
    fit_now, findings = start, []
    for _ in range(most):
        its = table(fit_now, PISTON)
        known = [pair for pair in its.places if pair in PISTON and pair not in fit_now.laws]
        linear = gains([its], list(fit_now.laws), known)
        held = [(law, fit_now.coefficients[law]) for law in fit_now.laws]
        tried = []
        for pair, (gain, fitted, at, _) in sorted(linear.items(), key=lambda one: -one[1][0].sum())[:6]:
            if gain.sum() < 3:
                break
            laws = (*fit_now.laws, pair)
            starts = [fit_curved(block, laws, start=fit_now, iterations=3)]
            for share in _SHARES:
                law = [*held, (pair, share * fitted.coefficients[at])]
                starts.append(fit_curved(block, laws, points=retimed(block, fit_now.points, law), coefficients=dict(law), iterations=3))
            one = fit_curved(block, laws, start=max(starts, key=lambda f: f.evidence.sum()), iterations=10)
            size = block.size(pair)
            tried.append((one.evidence - fit_now.evidence - 0.5 * size * np.log(len(one.points)) / len(one.points), pair, one))
        tried.sort(key=lambda one: -one[0].sum())
        log("piston", round(float(fit_now.chi2.mean()), 3), [(" ~ ".join(p), round(g.sum(), 1), round(in_errors(g), 1)) for g, p, _ in tried])
        if tried and is_enough(tried[0][0]):
            # A fit without the law may only have stopped early: it begins again where the one with it ended.
            again = fit_curved(block, fit_now.laws, points=retimed(block, tried[0][2].points, held), coefficients=fit_now.coefficients,
                               iterations=12)
            if again.evidence.sum() > fit_now.evidence.sum():
                tried = [(gain - again.evidence + fit_now.evidence, pair, one) for gain, pair, one in tried]
                fit_now = again
        if not tried or not is_enough(tried[0][0]) or tried[0][0].sum() < max(least, FURTHER * sum(f.nats for f in findings)):
            break
        best, pair, fit_now = tried[0]
        findings.append(Finding("clutch", pair, best, tuple((p, float(g.sum()), in_errors(best - g)) for g, p, _ in tried[1:]
                                                              if is_rival(best, g))))
    return fit_now, findings
