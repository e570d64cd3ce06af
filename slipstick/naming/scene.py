"""What all blocks share: recordings, where the plates slip, sensor noise, and smooth versions of the signals."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter1d

from slipstick.bench import Bench, parameters
from slipstick.calibration.noise import sensor_noise
from slipstick.naming.bases import KNOTS, from_zero, hats, sensor_basis
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS

Pair = tuple[str, str]
"""The quantity that a law changes, and what it depends on."""


@dataclass(frozen=True, eq=False)
class Scene:
    """`recordings` of a `bench`, with the signals (n, k) that the blocks have explained so far in `smooth`."""

    bench: Bench
    recordings: Recordings
    smooth: dict[str, np.ndarray]
    noise: dict[str, tuple[float, float]]
    base: np.ndarray
    extra: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, bench: Bench, recordings: Recordings, base: np.ndarray | None = None) -> "Scene":
        signals = recordings.signals
        noise = {name: sensor_noise(name, getattr(signals, name)) for name in SIGNAL_UNITS}
        smooth = {name: gaussian_filter1d(getattr(signals, name).astype(float), 3, axis=1) for name in SIGNAL_UNITS}
        return cls(bench, recordings, smooth, noise, np.array(bench.physics.nominal) if base is None else base)

    def __len__(self):
        return len(self.recordings)

    def explained(self, name: str, values: np.ndarray) -> "Scene":
        """With the signal `name` as a block explains it, (n, k)."""
        from dataclasses import replace
        return replace(self, smooth={**self.smooth, name: values})

    def model_torque(self, predicted: np.ndarray) -> np.ndarray:
        """Output torque (n, k) without noise: as `predicted` up to lock-up, then that of rigidly coupled shafts.

        Columns of a linear model are computed from it: those from a measured torque would share noise with the residuals of
        the blocks that integrate it.
        """
        c = self.recordings.conditions
        curves = self.bench.physics.curves
        table = np.array([curves.speed_ratio, curves.torque_ratio, curves.capacity_factor])
        given = np.zeros(len(self)) if c.input_torque is None else c.input_torque
        lock = np.searchsorted(self.time, self.recordings.measured_time).astype(np.int64)
        torque = predicted.copy()
        losses = np.array([self.value("input_coulomb"), self.value("input_viscous"), self.value("output_viscous"),
                           self.value("input_inertia"), self.gear])
        _rigid(self.time, lock, self.smooth["input_speed"], c.motor_speed, c.load_inertia, c.brake_torque, given, losses, table, torque)
        return torque

    def torque_error(self, on: str, torque: np.ndarray) -> np.ndarray:
        """Basis (n, m, k) in N m of errors of the torque sensor that reads `torque` (n, k)."""
        if on == "pressure":
            x = np.maximum(0, self.smooth["pressure"])
            return hats(x, from_zero(x, np.ones(x.shape, bool), KNOTS))[:, 1:] * self.typical_torque
        return sensor_basis(on, torque, self.time, self.value("current_delay"))

    def take(self, rows: np.ndarray) -> "Scene":
        from dataclasses import replace
        r, s = self.recordings, self.recordings.signals
        from slipstick.recordings import Signals
        signals = Signals(s.time, *(np.asarray(getattr(s, name))[rows] for name in SIGNAL_UNITS))
        order = self.run
        kept = Recordings(r.conditions.take(rows), r.measured_time[rows], signals)
        return replace(self, recordings=kept, smooth={name: x[rows] for name, x in self.smooth.items()},
                       extra={**{name: x[rows] for name, x in self.extra.items() if name != "run"}, "run": order[rows]})

    @property
    def time(self):
        return self.recordings.signals.time

    @property
    def step(self) -> float:
        return float(self.time[1] - self.time[0])

    @property
    def gear(self) -> float:
        return float(self.base[parameters.index("gear_ratio")])

    @property
    def run(self) -> np.ndarray:
        if "run" in self.extra:
            return self.extra["run"]
        order = self.recordings.run_order
        if order is None:
            order = self.recordings.conditions.run_order
        return np.zeros(len(self)) if order is None else np.asarray(order, float)

    def value(self, name: str) -> float:
        return float(self.base[parameters.index(name)])

    def measured(self, name: str) -> np.ndarray:
        return np.asarray(getattr(self.recordings.signals, name), float)

    @property
    def typical_torque(self) -> float:
        """A torque behind the gear in N m, the unit of torques that laws add."""
        return 0.1 * self.bench.scales.load_torque

    @property
    def margin(self) -> float:
        return 4 * (self.bench.sensors["shifting_time"].noise or 0.003) + 2 * self.step

    @property
    def slipping(self) -> np.ndarray:
        return self.time < (self.recordings.measured_time - self.margin)[:, None]

    @property
    def locked(self) -> np.ndarray:
        return self.time > (self.recordings.measured_time + self.margin)[:, None]

    @property
    def slip(self) -> np.ndarray:
        """Plate slip (n, k) in rad/s, input side."""
        return np.maximum(self.smooth["input_speed"] - self.gear * self.smooth["output_speed"], 0.0)

    @property
    def heat(self) -> np.ndarray:
        """Friction energy (n, k) in kJ."""
        power = self.smooth["output_torque"] / self.gear * self.slip * (self.time < self.recordings.measured_time[:, None])
        return np.concatenate([np.zeros((len(self), 1)), np.cumsum(0.5 * (power[:, 1:] + power[:, :-1]) * np.diff(self.time), axis=1)], axis=1) / 1000


@njit(nogil=True, cache=True, error_model="numpy")
def _rigid(time, lock, speed, motor, inertia, brake, given, losses, curves, torque):  # type: ignore[no-untyped-def]
    coulomb, viscous, load_viscous, own, gear = losses
    for i in range(len(lock)):
        if lock[i] >= len(time):
            continue
        x = speed[i, min(lock[i] + 2, len(time) - 1)]
        for t in range(lock[i], len(time)):
            ratio = min(curves[0, -1], max(curves[0, 0], x / motor[i]))
            j = min(curves.shape[1] - 2, max(0, np.searchsorted(curves[0], ratio) - 1))
            share = (ratio - curves[0, j]) / (curves[0, j + 1] - curves[0, j])
            factor = motor[i] / (curves[2, j] + share * (curves[2, j + 1] - curves[2, j]))
            drive = (curves[1, j] + share * (curves[1, j + 1] - curves[1, j])) * factor * factor + given[i] - viscous * x - coulomb
            load = brake[i] + load_viscous * x / gear
            rate = (drive - load / gear) / (own + inertia[i] / (gear * gear))
            torque[i, t] = inertia[i] * rate / gear + load
            if t + 1 < len(time):
                x = x + (time[t + 1] - time[t]) * rate
