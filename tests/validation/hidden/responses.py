"""Dynamic responses of sensors other than poles in series.

Each takes the signals (n, k), a strength in s that is zero for an ideal sensor, the name of the signal and the bench.
"""

import numpy as np
from scipy.signal import bilinear, lfilter

from .nominal import Setup

RANGE = {"pressure": 18.0, "input_speed": 165.0, "output_speed": 60.0, "output_torque": 1400.0}  # of the heavy bench
RESONANCE_DAMPING = 0.55


def delay(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay by `strength`, linear between samples, as of a bus with a fixed dead time."""
    time = setup.time
    late = time - strength * _slowness(setup)
    return np.array([np.interp(late, time, row) for row in signal])


def ring(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Filter by an underdamped second-order system, whose delay of slow signals is `strength`."""
    w = 2 * RESONANCE_DAMPING / (strength * _slowness(setup))
    r, angle = np.exp(-RESONANCE_DAMPING * w * setup.period), w * np.sqrt(1 - RESONANCE_DAMPING**2) * setup.period
    a = np.array([1, -2 * r * np.cos(angle), r * r])
    start = signal[:, :1]
    return start + lfilter([0, a.sum()], a, signal - start)


def slew(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Limit the rate to the range of the signal in 10 times `strength`."""
    largest = size(name, setup) * setup.period / (10 * strength * _slowness(setup))
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        filtered[:, k] = filtered[:, k - 1] + np.clip(signal[:, k] - filtered[:, k - 1], -largest, largest)
    return filtered


def count(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by more at low values, as a speed from the time between pulses; by `strength` at a third of the range."""
    third = size(name, setup) / 3
    lag = strength * _slowness(setup) * third / (np.abs(signal) + 0.15 * third)
    return _lagged_by(signal, lag, setup)


def hold(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read every 2 times `strength` and hold the value in between, as a slow bus."""
    interval = 2 * strength * _slowness(setup)
    read = np.floor(setup.time / interval + 1e-9) * interval
    return np.array([np.interp(read, setup.time, row) for row in signal])


def fall(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow a rise at once, and lag by `strength` while the signal falls, as a peak detector."""
    falling = 1 - np.exp(-setup.period / (strength * _slowness(setup)))
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        difference = signal[:, k] - filtered[:, k - 1]
        filtered[:, k] = filtered[:, k - 1] + np.where(difference > 0, 1.0, falling) * difference
    return filtered


def rise(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow a fall at once, and lag by `strength` while the signal rises, as a line with a check valve."""
    return -fall(-signal, strength, name, setup)


def average(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Average over the last 2 times `strength`, as a counter with a gate; before the command all is as at it."""
    time, period = setup.time, setup.period
    width = 2 * strength * _slowness(setup)
    integral = np.zeros_like(signal)
    integral[:, 1:] = np.cumsum((signal[:, 1:] + signal[:, :-1]) / 2, axis=1) * period
    start = time - width
    earlier = np.array([np.interp(start, time, row) for row in integral])
    return (integral - earlier - np.minimum(start, 0) * signal[:, :1]) / width


def carry(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay by 0.6 times `strength` and lag by the rest, as a long line with a filter behind it."""
    late = delay(signal, 0.6 * strength, name, setup)
    return late[:, :1] + lagged(late - late[:, :1], 0.4 * strength * _slowness(setup), setup)


def window(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Weigh the last 2 times `strength` with a squared sine, most in the middle, as a digital filter does."""
    ages = (np.arange(16) + 0.5) / 16
    weights = np.sin(np.pi * ages) ** 2
    return sum(weight * delay(signal, 2 * strength * age, name, setup)
               for age, weight in zip(ages, weights / weights.sum(), strict=True))


def creep(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow with 85 % of a change at once, and with the rest slowly, so that the mean delay is `strength`."""
    change = signal - signal[:, :1]
    return signal[:, :1] + 0.85 * change + 0.15 * lagged(change, strength / 0.15 * _slowness(setup), setup)


def strain(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag in proportion to the square of the value; by `strength` at a third of the range."""
    lag = strength * _slowness(setup) * np.maximum(np.abs(signal) / (size(name, setup) / 3), 0.1) ** 2
    return _lagged_by(signal, lag, setup)


def friction(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow only once the signal has moved by the range in 0.3 s times `strength`, as a gauge with play."""
    band = size(name, setup) * strength / 0.3
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        filtered[:, k] = np.clip(filtered[:, k - 1], signal[:, k] - band, signal[:, k] + band)
    return filtered


def switch(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 1.8 times `strength` until 0.45 s, and by a tenth of it later, as a filter that is switched over."""
    slowness = _slowness(setup)
    lag = strength * slowness * np.where(setup.time < 0.45 * slowness, 1.8, 0.1)
    return _lagged_by(signal, np.broadcast_to(lag, signal.shape), setup)


def turns(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay by `strength` on average, most every 0.3 s and hardly in between, as a bus that others use by turns."""
    time, slowness = setup.time, _slowness(setup)
    late = 3.2 * strength * slowness * np.sin(np.pi * time / (0.3 * slowness)) ** 6
    return np.array([np.interp(time - late, time, row) for row in signal])


def changes(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Hold until the signal has changed by the range in 0.3 s times `strength`, then follow, as a bus to save load."""
    band = size(name, setup) * strength / 0.3
    sent = signal.copy()
    for k in range(1, signal.shape[1]):
        sent[:, k] = np.where(np.abs(signal[:, k] - sent[:, k - 1]) < band, sent[:, k - 1], signal[:, k])
    return sent


def sludge(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by half of `strength` what exceeds the range in 0.4 s times `strength`, as behind a plug that yields."""
    decay = np.exp(-setup.period / (0.5 * strength * _slowness(setup)))
    band, filtered = size(name, setup) * strength / 0.4, signal.copy()
    for k in range(1, signal.shape[1]):
        difference = signal[:, k] - filtered[:, k - 1]
        filtered[:, k] = filtered[:, k - 1] + (1 - decay) * (difference - np.clip(difference, -band, band))
    return filtered


def band(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by up to 6 times `strength` from 0.35 to 0.55 of the range, and by little elsewhere, as a shaken pickup."""
    shares = 0.05 + 6 * np.maximum(1 - np.abs(np.abs(signal) / size(name, setup) - 0.45) / 0.1, 0)
    return _lagged_by(signal, strength * _slowness(setup) * shares, setup)


def adapt(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 2.5 times `strength` while the reading is near the signal, and by less beyond 0.5 % of the range."""
    near, filtered = size(name, setup) / 200, signal.copy()
    for k in range(1, signal.shape[1]):
        difference = signal[:, k] - filtered[:, k - 1]
        lag = 2.5 * strength * _slowness(setup) / (1 + (difference / near) ** 2)
        filtered[:, k] = filtered[:, k - 1] + (1 - np.exp(-setup.period / lag)) * difference
    return filtered


def echo(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay an eighth of the value by 8 times `strength`, as a part that comes by way of a soft frame."""
    return 0.875 * signal + 0.125 * delay(signal, 8 * strength, name, setup)


def collapse(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 5 times `strength` below a quarter of the range and by a twentieth above, as of a hose that is flat."""
    flat = 1 / (1 + np.exp(np.clip(40 * (np.abs(signal) / size(name, setup) - 0.25), -30, 30)))
    return _lagged_by(signal, strength * _slowness(setup) * (0.05 + 5 * flat), setup)


def lead(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay by 7 times `strength`, and overshoot by thrice a sudden change, so that a ramp is late by `strength`."""
    late = delay(signal, 7 * strength, name, setup)
    change = late - late[:, :1]
    return late + 3 * (change - lagged(change, 2 * strength * _slowness(setup), setup))


def slip(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Stick until the range in 0.2 s times `strength` is missing, then lag by half of `strength` until an eighth is."""
    band = size(name, setup) * strength / 0.2
    share = 1 - np.exp(-setup.period / (0.5 * strength * _slowness(setup)))
    filtered, slipping = signal.copy(), np.zeros(len(signal), bool)
    for k in range(1, signal.shape[1]):
        difference = signal[:, k] - filtered[:, k - 1]
        slipping = np.abs(difference) > np.where(slipping, band / 8, band)
        filtered[:, k] = filtered[:, k - 1] + np.where(slipping, share, 0) * difference
    return filtered


def clock(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay in proportion to time, by `strength` at 0.4 s, as a recorder whose clock is set at the command and slow."""
    return np.array([np.interp(setup.time * (1 - strength / 0.4), setup.time, row) for row in signal])


def wake(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read ever more often since the command, at 0.3 s every 2 times `strength`, and hold the value until then."""
    share = (setup.time / _slowness(setup)) ** 2 / (1.2 * strength)
    read = np.sqrt(np.floor(share + 1e-9) * 1.2 * strength) * _slowness(setup)
    return np.array([np.interp(read, setup.time, row) for row in signal])


def tooth(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read the mean between the last two teeth; a tooth takes 2 times `strength` at a third of the range."""
    time, filtered = setup.time, np.zeros_like(signal)
    pitch = 2 * strength * _slowness(setup) * size(name, setup) / 3
    for row, reading in zip(signal, filtered, strict=True):
        turns = np.concatenate([[0], np.cumsum((row[1:] + row[:-1]) / 2)]) * setup.period / pitch
        teeth = np.arange(1, int(turns.max()) + 1)
        passed = np.interp(teeth, np.maximum.accumulate(turns) + 1e-9 * time, time)
        means = np.concatenate([[row[0]], pitch / np.diff(passed, prepend=0.0)])
        reading[:] = means[np.searchsorted(passed, time, side="right")]
    return filtered


def hammer(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Run to and fro in a hose, which takes 6 times `strength`; 0.7 is reflected, so that a slow ramp is late by it."""
    return sum(1.7 * (-0.7) ** k * delay(signal, 6 * (2 * k + 1) * strength, name, setup) for k in range(40))


def divide(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag in inverse proportion to speed, 16 times as much above a quarter of the range; 3 times `strength` at it."""
    behind = np.mod(np.log(np.maximum(np.abs(signal) / size(name, setup), 0.01) / 0.25) / np.log(16), 1.0)
    return _lagged_by(signal, 3 * strength * _slowness(setup) * 16.0**-behind, setup)


def peak(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read the highest value of the last 6 times `strength`, as a transmitter that is not to miss a pulse."""
    filtered = signal.copy()
    for k in range(1, max(round(6 * strength * _slowness(setup) / setup.period), 1) + 1):
        filtered[:, k:] = np.maximum(filtered[:, k:], signal[:, :-k])
    return filtered


def blind(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Hold the reading for 8 times `strength` when the range changes, at an eighth, a quarter, half and all of it."""
    samples = max(round(8 * strength * _slowness(setup) / setup.period), 1)
    ranges = np.searchsorted(size(name, setup) * 2.0 ** np.arange(-3, 1), np.abs(signal))
    filtered, left = signal.copy(), np.zeros(len(signal), int)
    for k in range(1, signal.shape[1]):
        left = np.where((left == 0) & (ranges[:, k] != ranges[:, k - 1]), samples, np.maximum(left - 1, 0))
        filtered[:, k] = np.where(left > 0, filtered[:, k - 1], signal[:, k])
    return filtered


def paste(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 10 times `strength`, but by far less once half of it in ranges per second is missing, as behind a paste.

    The rate is that of a flow that is set free by heat and drawn by what is missing: its hyperbolic sine.
    """
    band = size(name, setup) * strength / 2
    decay = np.exp(-setup.period / (10 * strength * _slowness(setup)))
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        missing = np.clip((signal[:, k] - filtered[:, k - 1]) / (2 * band), -15, 15)
        filtered[:, k] = signal[:, k] - 2 * band * np.arctanh(np.tanh(missing) * decay)
    return filtered


def share(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Hold until 8 times `strength` of the value have changed, and 0.5 % of the range, then follow, to save a bus."""
    least, sent = size(name, setup) / 200, signal.copy()
    for k in range(1, signal.shape[1]):
        band = np.maximum(8 * strength * np.abs(sent[:, k - 1]), least)
        sent[:, k] = np.where(np.abs(signal[:, k] - sent[:, k - 1]) < band, sent[:, k - 1], signal[:, k])
    return sent


def relax(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow with 88 % at once, and with three equal parts over decades of time, so that the mean delay is `strength`.

    The lags of the parts are 0.6, 3.6 and 20.8 times `strength`, as of a resin that has no relaxation time of its own.
    """
    change = signal - signal[:, :1]
    return signal - 0.12 * change + 0.04 * sum(
        lagged(change, part * strength * _slowness(setup), setup) for part in (0.6, 3.6, 20.8))


def opens(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 4 times `strength` at the command, by ever less over 0.3 s, and by a tenth of it at last."""
    slowness = _slowness(setup)
    lag = strength * slowness * (0.1 + 4 * np.exp(-setup.time / (0.3 * slowness)))
    return _lagged_by(signal, np.broadcast_to(lag, signal.shape), setup)


def warms(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Miss a part of each change for a while: a quarter of what a lag of 2 has and one of 6 times `strength` has not.

    The reading follows at once, falls behind, and comes back, so that a ramp is late by `strength` at last.
    """
    slow, fast = (lagged(signal, part * strength * _slowness(setup), setup) for part in (6, 2))
    return signal + 0.25 * (slow - fast)


def swings(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read a fifth of the value by way of a part on a spring, which swings once in 25 times `strength` and long."""
    w, damping = 2 * np.pi / (25 * strength * _slowness(setup)), 0.04
    r, angle = np.exp(-damping * w * setup.period), w * np.sqrt(1 - damping**2) * setup.period
    a = np.array([1, -2 * r * np.cos(angle), r * r])
    start = signal[:, :1]
    return 0.8 * signal + 0.2 * (start + lfilter([0, a.sum()], a, signal - start))


def clings(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow a rise at once, and a fall only once the range in 0.3 s times `strength` is left, as if glued."""
    band = size(name, setup) * strength / 0.3
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        filtered[:, k] = np.clip(filtered[:, k - 1], signal[:, k], signal[:, k] + band)
    return filtered


def locks(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow by a loop that locks on the phase, swings once in 30 times `strength`, and is not late on a long ramp."""
    w, damping = 2 * np.pi / (30 * strength * _slowness(setup)), 0.1
    b, a = bilinear([2 * damping * w, w**2], [1, 2 * damping * w, w**2], 1 / setup.period)
    start = signal[:, :1]
    return start + lfilter(b, a, signal - start)


def silts(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by `strength` once the signal has moved by its range, before by far less, and later by up to 20 times it.

    What counts is how far it has moved up and down since the command, by its sixth power, as oil fills up a screen.
    """
    moved = np.zeros_like(signal)
    moved[:, 1:] = (np.cumsum(np.abs(np.diff(signal, axis=1)), axis=1) / size(name, setup)) ** 6
    return _lagged_by(signal, strength * _slowness(setup) * (0.05 + 20 * moved / (moved + 20)), setup)


def doubts(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Repeat the reading while the signal changes faster than by its range in 1 s, for 14 times `strength` at most.

    What is fast for longer is then believed until it is slow again, as of a receiver that takes a jump for an error.
    """
    longest = max(round(14 * strength * _slowness(setup) / setup.period), 1)
    largest = size(name, setup) * setup.period / _slowness(setup)
    filtered, left = signal.copy(), np.full(len(signal), longest)
    for k in range(1, signal.shape[1]):
        fast = np.abs(signal[:, k] - signal[:, k - 1]) > largest
        filtered[:, k] = np.where(fast & (left > 0), filtered[:, k - 1], signal[:, k])
        left = np.where(fast, np.maximum(left - 1, 0), longest)
    return filtered


def bubbles(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by `strength` at an eighth of the range, by up to 25 times it below, and by far less above.

    It is in inverse proportion to the cube of the value, as of a bubble that is pressed together and dissolves.
    """
    small = np.clip((0.155 / (np.abs(signal) / size(name, setup) + 0.03)) ** 3, 0.02, 25)
    return _lagged_by(signal, strength * _slowness(setup) * small, setup)


def waits(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Delay each run by another time, on average by `strength`: most hardly, and a few by up to 6 times it.

    The times are those of a golden section of the number of the run, to its fifth power.
    """
    late = 6 * strength * _slowness(setup) * np.mod(0.618034 * np.arange(1, len(signal) + 1), 1.0) ** 5
    return np.array([np.interp(setup.time - by, setup.time, row) for by, row in zip(late, signal, strict=True)])


def chokes(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow at a rate that goes with the root of what is missing, as through a narrow bore whose flow is turbulent.

    The whole range would take 10 times `strength`.
    """
    step = np.sqrt(size(name, setup)) * setup.period / (10 * strength * _slowness(setup))
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        missing = signal[:, k] - filtered[:, k - 1]
        left = np.maximum(np.sqrt(np.abs(missing)) - step, 0) ** 2
        filtered[:, k] = signal[:, k] - np.sign(missing) * left
    return filtered


def wipes(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 6 times `strength` until the part has turned, by ever less, and by a fifth of `strength` at last.

    What counts is the integral of the value since the command, relative to that of the range over 0.08 s.
    """
    turned = np.cumsum(np.abs(signal), axis=1) * setup.period / (0.08 * size(name, setup) * _slowness(setup))
    return _lagged_by(signal, strength * _slowness(setup) * (0.2 + 6 * np.exp(-turned)), setup)


def tracks(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Follow during the first half of every 8 times `strength`, and hold in the second, as an amplifier that is shared.

    A ramp is late by `strength` on average.
    """
    turn = 8 * strength * _slowness(setup)
    share = setup.time / turn + 1e-9
    read = np.minimum(setup.time, (np.floor(share) + 0.5) * turn)
    return np.array([np.interp(read, setup.time, row) for row in signal])


def gaps(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Hold the reading while a gap of the wheel passes, and follow in between, as long as three gaps.

    A gap passes in 8 times `strength` at a third of the range, and ever more slowly at lower values; the first one
    comes after half of its length.
    """
    gap = 8 * strength * _slowness(setup) * size(name, setup) / 3
    passed = np.cumsum(np.abs(signal), axis=1) * setup.period / gap
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        filtered[:, k] = np.where(np.mod(passed[:, k] + 2.5, 4.0) < 3, signal[:, k], filtered[:, k - 1])
    return filtered


def sets(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by 6 times `strength` behind oil that has set, and hardly where it is stirred: by a fifth of `strength`.

    It is set at the command, is stirred by each change of a twelfth of the range, and sets again over 0.1 s of rest.
    """
    slowness = _slowness(setup)
    again, twelfth = np.exp(-setup.period / (0.1 * slowness)), size(name, setup) / 12
    filtered, stirred = signal.copy(), np.zeros(len(signal))
    for k in range(1, signal.shape[1]):
        lag = strength * slowness * (0.2 + 6 * np.exp(-stirred))
        step = (1 - np.exp(-setup.period / lag)) * (signal[:, k] - filtered[:, k - 1])
        filtered[:, k] = filtered[:, k - 1] + step
        stirred = again * stirred + np.abs(step) / twelfth
    return filtered


def predicts(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read every 4 times `strength`, and go on meanwhile as straight as between the last two readings."""
    time, interval = setup.time, 4 * strength * _slowness(setup)
    number = np.floor(time / interval + 1e-9)
    last, before = (np.array([np.interp(np.maximum(number - back, 0) * interval, time, row) for row in signal])
                    for back in (0, 1))
    return last + (last - before) * (time / interval - number)


def bleeds(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Lag by a third of `strength` behind a rise, and fall at most by the range in 25 times `strength`.

    It is a line with a ball, which a rise lifts, and beside which a leak of constant flow lets out a fall.
    """
    share = 1 - np.exp(-3 * setup.period / (strength * _slowness(setup)))
    largest = size(name, setup) * setup.period / (25 * strength * _slowness(setup))
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        missing = signal[:, k] - filtered[:, k - 1]
        filtered[:, k] = filtered[:, k - 1] + np.where(missing > 0, share * missing, np.maximum(missing, -largest))
    return filtered


def queues(signal: np.ndarray, strength: float, name: str, setup: Setup) -> np.ndarray:
    """Read pulses from a queue, which takes up more than it gives above an eighth of the range.

    The reading is that of the pulse whose turn it is. Once it is late by 12 times `strength`, the queue is thrown away.
    """
    time, longest = setup.time, 12 * strength * _slowness(setup)
    source, readings = np.zeros(len(signal)), signal.copy()
    for k in range(1, signal.shape[1]):
        rate = np.abs(readings[:, k - 1]) / (size(name, setup) / 8)
        source = np.minimum(source + setup.period / np.maximum(rate, 1e-3), time[k])
        source = np.where(time[k] - source > longest, time[k], source)
        readings[:, k] = [np.interp(at, time, row) for at, row in zip(source, signal, strict=True)]
    return readings


def lagged(signal: np.ndarray, lag: float, setup: Setup) -> np.ndarray:
    """Filter (n, k) by a first-order lag, exact for signals that are linear between samples and initially constant."""
    decay = np.exp(-setup.period / lag)
    weight = 1 - (1 - decay) * lag / setup.period
    initial = (1 - weight) * signal[:, :1]
    return lfilter([weight, 1 - decay - weight], [1, -decay], signal, zi=initial)[0]


def _lagged_by(signal: np.ndarray, lag: np.ndarray, setup: Setup) -> np.ndarray:
    """Filter (n, k) by first-order lags (n, k) that change from sample to sample."""
    decay = np.exp(-setup.period / lag)
    filtered = signal.copy()
    for k in range(1, signal.shape[1]):
        filtered[:, k] = signal[:, k] + decay[:, k] * (filtered[:, k - 1] - signal[:, k])
    return filtered


def size(name: str, setup: Setup) -> float:
    """Return the range of a signal on a bench."""
    return RANGE[name] * setup.scale.get(name, 1.0)


def _slowness(setup: Setup) -> float:
    return setup.scale.get("time", 1.0)


RESPONSES = {"delay": delay, "ring": ring, "slew": slew, "count": count, "hold": hold, "fall": fall,
             "rise": rise, "average": average, "carry": carry, "window": window, "creep": creep, "strain": strain,
             "friction": friction, "switch": switch, "turns": turns, "changes": changes,
             "sludge": sludge, "band": band, "adapt": adapt, "echo": echo,
             "collapse": collapse, "lead": lead, "slip": slip, "clock": clock,
             "wake": wake, "tooth": tooth,
             "hammer": hammer, "divide": divide,
             "peak": peak, "blind": blind,
             "paste": paste, "share": share,
             "relax": relax, "opens": opens,
             "warms": warms, "swings": swings,
             "clings": clings, "locks": locks,
             "silts": silts, "doubts": doubts,
             "bubbles": bubbles, "waits": waits,
             "chokes": chokes, "wipes": wipes,
             "tracks": tracks, "gaps": gaps,
             "sets": sets, "predicts": predicts,
             "bleeds": bleeds, "queues": queues}
