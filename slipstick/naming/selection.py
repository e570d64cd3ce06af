"""What counts as enough, as a tie and as unexplained: pure functions of the gains of engagements."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.settings import NamingSettings

CERTAIN = 3.0
"""Signed root of a gain from which on an engagement is beyond doubt by itself: noise exceeds it once in 400."""
_LEAST_SPREAD = 0.1 * CERTAIN
"""Least spread of such roots: where all engagements are beyond doubt, so is their mean."""
NEAR = 0.5
"""Share of the largest gain from which another pair may gain more when it is fitted in full, or with more knots."""
_ODD = 2
"""Engagements that may be odd although they were not set aside."""


@dataclass(frozen=True, eq=False)
class Rival:
    """A pair that is not told apart from the best one: its gain in nats, and by how many standard errors it trails."""

    pair: Pair
    nats: float
    behind: float


@dataclass(frozen=True, eq=False)
class Finding:
    """A pair that `blocks` ask for: `gain` (n,) in nats of each engagement, and the pairs not told apart from it.

    `next_best` is the pair that gains most after it in these blocks, of those that are another effect. `expected` (n,)
    are the standard errors in which engagements should show the law; without them all should show it alike. Their
    scores in its direction have an `agreement` of so many standard errors. A `rare` pair is one of those that compete
    only where the usual ones do not explain a block.
    """

    blocks: tuple[str, ...]
    pair: Pair
    gain: np.ndarray
    rivals: tuple[Rival, ...] = ()
    next_best: Rival | None = None
    expected: np.ndarray | None = None
    agreement: float = 0.0
    rare: bool = False

    @property
    def nats(self) -> float:
        """Gain of all engagements in nats."""
        return float(self.gain.sum())

    @property
    def errors(self) -> float:
        """Standard errors over engagements in which they show the law, by what they gain or by their scores."""
        shown = in_errors(self.gain) if self.expected is None else in_proportion(self.gain, self.expected)
        return max(shown, self.agreement)

    @property
    def lead(self) -> float:
        """Standard errors by which it leads the next best explanation: another pair, or no law at all."""
        over_none = in_errors(self.gain)
        return over_none if self.next_best is None else min(over_none, self.next_best.behind)


def is_further(finding: Finding, findings: Sequence[Finding]) -> bool:
    """Whether another one of the `findings` gains more in the same part of the bench: the clutch has full contact."""
    def parts(other: Finding) -> set[str]:
        return {"clutch" if name == "contact" else name for name in other.blocks}

    return any(other.nats > finding.nats and parts(other) & parts(finding) for other in findings)


def in_errors(gain: np.ndarray) -> float:
    """Mean of the signed roots of gains (n,), each at most `CERTAIN`, in its standard errors.

    A gain is quadratic in the size of what an engagement shows, and its root (of the deviance) nearly normal. A strong
    law gains much in some engagements and far more in others, and their spread must not speak against it.
    """
    return in_agreement(_roots(gain))


def in_proportion(gain: np.ndarray, expected: np.ndarray) -> float:
    """Slope of the signed roots of gains (n,) over those `expected` (n,), in its standard errors.

    A law may act on few engagements. Those in which it should not show say nothing about it, whatever they gain or lose
    by other values of what all share. The standard error is robust to a spread that differs between engagements
    (HC3; MacKinnon and White, J. Econometrics 29, 305, 1985). Student's t, with the degrees of freedom of the
    engagements that count, is given as the standard normal deviate of the same probability (Wallace, Ann. Math. Stat.
    30, 1124, 1959).
    """
    roots, expected = np.clip(_roots(gain), -CERTAIN, CERTAIN), np.minimum(expected, CERTAIN)
    weights = expected**2
    total = float(weights.sum())
    freedom = total**2 / max(float((weights**2).sum()), 1e-300) - 1
    if freedom < 1:
        return 0.0
    slope = float((expected * roots).sum()) / total
    left = np.maximum(np.abs(roots - slope * expected), _LEAST_SPREAD) / (1 - weights / total)
    t = slope * total / float(np.sqrt((weights * left**2).sum()))
    return float(np.copysign((8 * freedom + 1) / (8 * freedom + 3) * np.sqrt(freedom * np.log1p(t**2 / freedom)), t))


def _roots(gain: np.ndarray) -> np.ndarray:
    """Signed roots (n,) of twice the gains."""
    return np.asarray(np.sign(gain) * np.sqrt(2 * np.abs(gain)))


def in_agreement(scores: np.ndarray) -> float:
    """Mean of scores (n,), each at most `CERTAIN`, in its standard errors."""
    scores = np.clip(scores, -CERTAIN, CERTAIN)
    deviation = max(float(scores.std(ddof=1)), _LEAST_SPREAD)
    return float(scores.mean()) * float(np.sqrt(len(scores))) / deviation


def is_enough(gain: np.ndarray, settings: NamingSettings) -> bool:
    """Whether a gain (n,) is more than noise and single engagements give."""
    return bool(gain.sum() > settings.nats and in_errors(gain) > settings.errors)


def explains(gain: np.ndarray, before: np.ndarray, after: np.ndarray, settings: NamingSettings) -> bool:
    """Whether a law explains nearly all that its blocks lack, as one that acts on few engagements does.

    `gain` (n,) is in nats, `before` and `after` (b, n) are the chi-squares of b blocks without and with it. The
    engagements that gain most do not count, because one or two odd ones may give any gain.
    """
    most = np.argsort(gain)[:-_ODD]
    lacking, left = (float((chi_square[:, most] - 1).mean(axis=1).sum()) for chi_square in (before, after))
    return bool(gain.sum() > settings.nats and lacking > settings.errors * settings.noise
                and left < settings.few_leave * lacking)


def is_shown(gain: np.ndarray, expected: np.ndarray, agreement: float, settings: NamingSettings) -> bool:
    """Whether the engagements on which a law acts show it: a gain (n,) in nats, where (n,) errors are `expected`.

    They show that something acts in the direction of the law if their scores in it are in `agreement`, whatever its
    size in each. What they gain must then still be told from noise.
    """
    errors = in_proportion(gain, expected)
    return bool(gain.sum() > settings.nats
                and (errors > settings.errors or (agreement > settings.errors and errors > settings.apart)))


def is_finding(gain: np.ndarray, expected: np.ndarray, agreement: float, before: np.ndarray, after: np.ndarray,
               settings: NamingSettings) -> bool:
    """Whether a law that gains (n,) nats is named: it `is_shown`, or it `explains` what its blocks lack."""
    return is_shown(gain, expected, agreement, settings) or explains(gain, before, after, settings)


def rivals(best: np.ndarray, others: Sequence[tuple[np.ndarray, Pair]], settings: NamingSettings) -> tuple[Rival, ...]:
    """Those of `others`, which would do, that `best` (n,) leads by too little in nats or in standard errors."""
    return tuple(Rival(pair, float(gain.sum()), in_errors(best - gain)) for gain, pair in others
                 if not leads(best, gain, settings))


def leads(gain: np.ndarray, other: np.ndarray, settings: NamingSettings) -> bool:
    """Whether a gain (n,) exceeds an `other` one by enough nats and standard errors to be told apart from it."""
    ahead = gain - other
    return bool(ahead.sum() >= settings.nats and in_errors(ahead) >= settings.apart)


def is_unexplained(chi_square: np.ndarray, before: np.ndarray, settings: NamingSettings) -> bool:
    """Whether chi-squares (n,) of engagements exceed 1 by more than their spread and the noise's own error allow.

    `before` (n,) are those without laws: what is left of a strong law, as a share of it, is not something else.
    """
    logs = np.log(np.maximum(chi_square, 1e-3))
    error = np.hypot(settings.noise, logs.std(ddof=1) / np.sqrt(len(logs)))
    left = float(chi_square.mean()) - 1 > settings.further * (float(before.mean()) - 1)
    return bool(left and logs.mean() > settings.errors * error)


def priced(gain: np.ndarray, leverage: np.ndarray) -> np.ndarray:
    """A gain (n,) in maximised log-likelihood less the price of the coefficients, as BIC has it.

    Each engagement pays for its `leverage` (n,): one that does not determine the law neither gains nor pays.
    """
    return np.asarray(gain - 0.5 * np.log(len(gain)) * leverage)
