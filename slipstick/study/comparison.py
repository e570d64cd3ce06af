"""What a study compares of each experiment: averages of the signals' samples, and the shifting time.

An experiment is one row of N numbers, each divided by the standard deviation of its noise, so that a residual of 1 is
what the sensors explain.
"""

from dataclasses import dataclass, replace

import numpy as np

from slipstick.bench import Bench
from slipstick.clutch import ensemble
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.recordings.processing import blended_at_lock_up, block_means, noise_std
from slipstick.recordings.signals import SIGNAL_UNITS, Signals

CHANNELS = (*SIGNAL_UNITS, "shifting_time")
"""The signals, and the shifting time last."""

WIDTH = 8
"""Samples averaged to one compared value: 16 ms at 500 Hz."""
FEWEST = 12
"""Experiments without which a study has nothing to count."""
_FEWEST_AVERAGES = 8
BLIND = 1.5  # compared values of the torque around the measured lock-up that count nothing


@dataclass(frozen=True, eq=False)
class Comparison:
    """n recordings as `measured` (n, N) in the units of each channel, and the `noise` of each channel by name.

    `weights` (n, N) are 0 for what is left out, else 1: at lock-up the torque jumps, and how far a simulated jump is
    from a measured one says the shifting time, once, and not with the weight of a thousand noise levels.
    """

    bench: Bench
    recordings: Recordings
    channels: dict[str, slice]
    measured: np.ndarray
    weights: np.ndarray
    noise: dict[str, float]

    @property
    def times(self) -> np.ndarray | None:
        """When the simulation is sampled, in s; None without signals."""
        signals = self.recordings.signals
        if signals is None:
            return None
        # All of them: a few to each average are off by two noise levels where the torque comes on.
        return signals.time[:len(signals.time) // WIDTH * WIDTH]

    @property
    def scale(self) -> np.ndarray:
        """Noise of each of the N values, in the units of its channel: (N,)."""
        scale = np.empty(self.measured.shape[1])
        for name, columns in self.channels.items():
            scale[columns] = self.noise[name]
        return scale

    @property
    def counts(self) -> np.ndarray:
        """Values of each channel that count: (channels,)."""
        return np.array([self.weights[:, columns].sum() for columns in self.channels.values()])

    def take(self, places: np.ndarray) -> "Comparison":
        """Only the experiments at `places`."""
        recordings = self.recordings
        signals = recordings.signals
        part = None if signals is None else Signals(
            signals.time, *(getattr(signals, name)[places] for name in SIGNAL_UNITS))
        order = recordings.run_order
        some = Recordings(recordings.conditions.take(places), recordings.measured_time[places], part,
                          None if order is None else np.argsort(np.argsort(order[places])))
        return replace(self, recordings=some, measured=self.measured[places], weights=self.weights[places])

    def predicted(self, response: ensemble.Response) -> np.ndarray:
        """The same N values of simulated engagements, (..., N) in the units of each channel; NaN where one failed."""
        time, values = self.times, []
        if time is not None:
            signals = {name: getattr(response, name) for name in SIGNAL_UNITS}
            torque = signals["output_torque"]
            flat = blended_at_lock_up(torque.reshape(1, -1, torque.shape[-1]),
                                      response.shifting_time.reshape(1, -1), time)
            signals["output_torque"] = flat.reshape(torque.shape)
            values = [block_means(signals[name], WIDTH) for name in SIGNAL_UNITS]
        conditions = self.recordings.conditions
        latest = conditions.profile_time[conditions.current_profile, -1]
        locked = response.status == ensemble.LOCKED
        late = np.where(response.status == ensemble.FAILED, np.nan, np.resize(latest, locked.shape))
        return np.concatenate([*values, np.where(locked, response.shifting_time, late)[..., None]], axis=-1)

    def with_noise(self, residuals: np.ndarray) -> "Comparison":
        """The same with the noise that `residuals` (n, N), in the units of each channel, show.

        Of a signal it is the median third difference of successive values, which neither scatter between runs nor a
        missing effect reaches.
        """
        shown = {name: noise_std(name, residuals[:, columns]) for name, columns in self.channels.items()
                 if name != "shifting_time"}
        return replace(self, noise={**self.noise, **shown})


def compare(bench: Bench, recordings: Recordings, shifting_time_noise: float) -> Comparison:
    """The recordings of a bench as a comparison, with the noise of the signals as their own third differences show it.

    Raises `InvalidValue` where there are too few experiments or samples.
    """
    signals, time = recordings.signals, recordings.measured_time
    if len(time) < FEWEST:
        raise InvalidValue(f"{len(time)} experiments are too few for a study, which counts each as one observation",
                           f"Record {FEWEST} or more, under different conditions")
    if signals is not None and len(signals.time) < _FEWEST_AVERAGES * WIDTH:
        raise InvalidValue(f"Signals of {len(signals.time)} samples say nothing of their noise",
                           f"Record {_FEWEST_AVERAGES * WIDTH} samples or more, such as 500 a second")
    if signals is None:
        return Comparison(bench, recordings, {"shifting_time": slice(0, 1)}, time[:, None], np.ones((len(time), 1)),
                          {"shifting_time": shifting_time_noise})
    k = len(signals.time) // WIDTH
    channels = {name: slice(i * k, (i + 1) * k) for i, name in enumerate(SIGNAL_UNITS)}
    channels["shifting_time"] = slice(len(SIGNAL_UNITS) * k, len(SIGNAL_UNITS) * k + 1)
    values = [block_means(getattr(signals, name).astype(float), WIDTH) for name in SIGNAL_UNITS]
    measured = np.concatenate([*values, time[:, None]], axis=1)
    weights = np.ones_like(measured)
    centre = block_means(signals.time, WIDTH)
    near = np.abs(centre - time[:, None]) < BLIND * (centre[1] - centre[0])
    weights[:, channels["output_torque"]] = ~near
    blank = Comparison(bench, recordings, channels, measured, weights, {"shifting_time": shifting_time_noise})
    return blank.with_noise(measured)
