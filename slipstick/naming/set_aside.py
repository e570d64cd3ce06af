"""Engagements with errors of the recording, which are set aside before anything is asked."""

from collections.abc import Callable, Sequence

import numpy as np

from slipstick.naming.block import Block
from slipstick.naming.fit import BlockFit, fit_together
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.lock import LockBlock
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from slipstick.numerics.deviations import from_median
from slipstick.numerics.threads import mapped
from slipstick.recordings.signals import open_blocks

_LEAST_SPREAD = 0.15
"""Least standard deviation of the logarithm of chi-square of good engagements: that of some 100 independent samples."""
_EXPLAINED = 0.5
"""Share of the typical variance of a signal below which it has nothing to do with the inputs of its block."""
_BELIEVED = 3.0
"""Multiples of the widest scatter beyond which a parameter may be that of an error of the recording."""
_LEAST_NOISE = 1e-12
"""Least size of third differences, in the unit of a signal, by which others are divided."""


def outlying(chi_squares: Sequence[np.ndarray], settings: NamingSettings) -> np.ndarray:
    """Engagements (n,) far worse than the others in one of some blocks, the worst first; none without blocks."""
    if not chi_squares:
        return np.zeros(0, int)
    off = np.max([_misfit(chi_square, settings) for chi_square in chi_squares], axis=0)
    return np.asarray(np.argsort(-off, kind="stable")[:int((off > 1).sum())])


def own_noise(scene: Scene) -> np.ndarray:
    """Power of the noise of each engagement (n,) over the median one, in the signal where it is largest; at least 1.

    Third differences are noise: what a model lacks is slower. An engagement with more noise is not described worse.
    """
    power = np.ones(len(scene))
    for name in scene.smooth:
        size = np.median(np.abs(np.diff(scene.measured(name), 3, axis=1)), axis=1)
        power = np.maximum(power, (size / max(float(np.median(size)), _LEAST_NOISE)) ** 2)
    return power


def foreign(scene: Scene, fits: Sequence[BlockFit] = ()) -> np.ndarray:
    """Engagements (n,) with a signal that its block does not explain at all, such as a swapped channel.

    No effect does that, so that they may be many. If they are most, the bench is another one, and none is meant. The
    `fits` are those of `bare`, if they are known.
    """
    bad = _worst_first(scene, lambda fit: _unexplained(fit) / (1 - _EXPLAINED), 1.0, fits)
    return bad if bad.mean() < 0.5 else np.zeros(len(scene), bool)


def implausible(scene: Scene, fits: Sequence[BlockFit] = ()) -> np.ndarray:
    """Engagements (n,) that are outlying in a block without laws, or have parameters that are; not too many.

    The `fits` are those of `bare`, if they are known.
    """
    settings = scene.settings
    return _worst_first(scene, lambda fit: np.maximum(_misfit(fit.chi2, settings), _unbelievable(fit, settings)),
                        settings.most_outlying, fits)


def bare(scene: Scene) -> list[BlockFit]:
    """The blocks that are linear in their parameters, fitted without laws, and not to the end."""
    return mapped(lambda block: fit_together([block], [()], [None], iterations=3)[0], _without_laws(scene))


def _worst_first(scene: Scene, doubt_of: Callable[[BlockFit], np.ndarray], most: float,
                 fits: Sequence[BlockFit]) -> np.ndarray:
    """Engagements (n,) with a doubt above 1 in a block without laws, a share of `most` at most.

    The worst are left out before the others are judged, because they distort what all engagements share.
    """
    bad = np.zeros(len(scene), bool)
    while not bad.all():
        kept = np.flatnonzero(~bad)
        kept_fits = fits if fits and not bad.any() else bare(scene.take(kept))
        doubt = np.max([doubt_of(fit) for fit in kept_fits], axis=0)
        worst = kept[doubt > max(1.0, doubt.max() / 2)]
        if not len(worst) or bad.sum() + len(worst) > most * len(scene):
            break
        bad[worst] = True
    return bad


def _unexplained(fit: BlockFit) -> np.ndarray:
    """What a block does not explain (n,), over the typical variance of its signal; 0 where that is a difference.

    The variance of one engagement would be small where its signal hardly changes.
    """
    if fit.block.name == "lock":
        return np.zeros(len(fit.predicted))
    measured, left = (np.where(fit.block.counted, values, np.nan)
                      for values in (fit.block.measured, fit.block.measured - fit.predicted))
    return np.asarray(np.nanmean(left**2, axis=1) / np.median(np.nanvar(measured, axis=1)))


def _misfit(chi_square: np.ndarray, settings: NamingSettings) -> np.ndarray:
    """How far chi-squares (n,) are above those of the others, 1 where an engagement is outlying."""
    off, spread = from_median(np.log(np.maximum(chi_square, 1e-3)))
    return np.asarray(off / (settings.outlying * np.maximum(_LEAST_SPREAD, spread)))


def _unbelievable(fit: BlockFit, settings: NamingSettings) -> np.ndarray:
    """How far the parameters of engagements (n,) are from those of the others, 1 where they are beyond belief.

    By such parameters a valve explains a reversed sensor, and a load inertia a speed sensor that froze.
    """
    off, spread = from_median(fit.fitted.each)  # a single one may pull the mean of all
    far = np.abs(off) / np.maximum(_BELIEVED * fit.block.widest, settings.outlying * spread)
    return np.asarray(far.max(axis=1))


def _without_laws(scene: Scene) -> list[Block]:
    """The blocks that are linear in their parameters."""
    can, blocks = open_blocks(tuple(scene.smooth)), list[Block]()
    if "load" in can:
        blocks.append(load := LoadBlock(scene))
        if "lock" in can:
            blocks.append(LockBlock(scene, load.clean(np.zeros((len(scene), len(load.random))))))
    if "input" in can:
        blocks.append(InputBlock(scene))
    if "valve" in can:
        blocks.append(ValveBlock(scene))
    return blocks
