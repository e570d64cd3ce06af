"""The model cut at the measured signals, held against the same cut of its own simulation.

What `locate` finds in recordings it also finds in a simulation of the fitted model, where it is the effects that the
equations of the cut do not know, and no more. The difference of the two is what the model cannot say, with an effect in
it or without. The same simulation with noise on its sensors tells how much of that is noise: while the oil film is
squeezed out, torque follows the measured pressure so steeply that its noise counts many times over.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipstick.clutch import ensemble
from slipstick.recordings import Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.study import locate
from slipstick.study.comparison import WIDTH, Comparison
from slipstick.study.mixed import MixedFit

_FEWEST = 12  # values that tell a noise level


@dataclass(frozen=True, eq=False)
class Cut:
    """A fitted model's cut of the recordings, `measured`, and of its own simulation, `modelled`.

    `left` is what the model leaves of the recordings, in units of what noise would leave in the same block and phase;
    its phase is -1 around the lock-up of either. `simulated` are the signals of the simulation, each run with its own
    scatter.
    """

    measured: locate.Blocks
    modelled: locate.Blocks
    left: locate.Blocks
    simulated: Signals


def cut(comparison: Comparison, found: MixedFit, seed: int) -> Cut | None:
    """Cut the recordings and the simulation of a fitted model; None without signals."""
    measured = locate.blocks(comparison, found)
    if measured is None:
        return None
    simulated, lock = _simulated(comparison, found)
    modelled, noisy = (_blocks(comparison, found, signals, lock)
                       for signals in (simulated, _noisy(comparison, simulated, seed)))
    noise = {name: noisy.residual[name] - values for name, values in modelled.residual.items()}
    left = {name: (values - modelled.residual[name]) / _level(noise[name], modelled.phase, measured.phase)
            for name, values in measured.residual.items()}
    apart = (measured.phase < 0) | (modelled.phase < 0)
    return Cut(measured, modelled, replace(measured, residual=left, phase=np.where(apart, -1, measured.phase)),
               simulated)


def _simulated(comparison: Comparison, found: MixedFit) -> tuple[Signals, np.ndarray]:
    """Signals and shifting times of the fitted model, an engagement that never locks at the end of its profile."""
    signals, conditions = comparison.recordings.signals, comparison.recordings.conditions
    assert signals is not None
    curves = comparison.bench.physics.curves
    response = ensemble.simulate(curves, *found.design.vectors(found.points), conditions, signals.time,
                                 paired=True, laws=found.design.laws)
    end = conditions.profile_time[conditions.current_profile, -1]
    # A failed engagement counts as standing still, and so as far from what was measured.
    return (Signals(signals.time, *(np.nan_to_num(getattr(response, name)) for name in SIGNAL_UNITS)),
            np.where(response.status == ensemble.LOCKED, response.shifting_time, end))


def _noisy(comparison: Comparison, signals: Signals, seed: int) -> Signals:
    """The signals as the sensors would give them: white noise, whose averages have the noise of the comparison."""
    rng = np.random.default_rng(seed)
    return Signals(signals.time, *(
        getattr(signals, name) + np.sqrt(WIDTH) * comparison.noise[name] * rng.standard_normal(signals.pressure.shape)
        for name in SIGNAL_UNITS))


def _blocks(comparison: Comparison, found: MixedFit, signals: Signals, lock: np.ndarray) -> locate.Blocks:
    recordings = replace(comparison.recordings, measured_time=lock, signals=signals)
    blocks = locate.blocks(replace(comparison, recordings=recordings), found)
    assert blocks is not None
    return blocks


def _level(noise: np.ndarray, phase: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """RMS noise of each value (n, k) by its `wanted` phase; 1 where too few values tell it."""
    level = np.ones(wanted.shape)
    for number in range(len(locate.PHASES)):
        values = noise[(phase == number) & np.isfinite(noise)]
        if len(values) >= _FEWEST:
            level[wanted == number] = np.sqrt(np.mean(values**2))
    return level
