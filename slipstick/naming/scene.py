"""What all blocks share: recordings, where the plates slip, sensor noise, and smooth versions of the signals.

Columns of a linear model are computed from smooth signals: a column that shares noise with the residual is biased.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
import scipy

from slipstick.bench import Bench, parameters
from slipstick.bench.converter import Converter
from slipstick.blocks.input import curves_of
from slipstick.blocks.sensor_noise import Noise, noise_of, sensor_noise
from slipstick.blocks.whitening import BlockNoise
from slipstick.clutch.effects.effect import DEPENDENCES
from slipstick.naming.bases import between, doubled
from slipstick.naming.release import released, slips_until
from slipstick.naming.rigid import couple
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS

Pair = tuple[str, str]
"""The quantity that a law changes, and what it depends on."""

_TIMER_NOISE = 0.003
"""Noise in s of the measured shifting time where the bench states none: one sample of a usual recording."""
_KERNEL = 4
"""Standard deviations of the smoothing kernel within which smooth signals still show the jump at lock-up."""
_ERRORS, _SAMPLES = 4, 2
"""Margin about lock-up, where the torque jumps: in standard errors of the shifting time, and in samples."""
TOLD_BY = {"pressure": ("pressure",), "input speed": ("input_speed",), "output speed": ("output_speed",),
           "output position": ("output_speed",), "slip": ("input_speed", "output_speed"), "current": ()}
"""Signals from which the values of a dependence come, for the dependences of blocks that may lack one."""
OF_PLATES = ("heat", "time in contact", "piston position")
"""What laws may depend on that no signal tells, but the blocks of the clutch."""
WITHIN = ("time", *TOLD_BY, *OF_PLATES)
"""All that changes within an engagement and that a law may depend on."""
_LOSSES = ("input_coulomb", "input_viscous", "output_viscous", "input_inertia")
TYPICAL = 0.1
"""Share of the largest friction torque that is the unit of torques that laws add, so that coefficients are about 1."""


@dataclass(frozen=True, eq=False)
class Scene:
    """`recordings` of n engagements on a `bench`, and what is known about their signals so far.

    `smooth` maps each measured signal to (n, k) without noise, `noise` to the standard deviation and autocorrelation of
    its sensor, which is not estimated again where `noise_is_known`. Laws have the knots of the `settings`. `base`
    (20,) are the nominal parameters. `order` (n,) is the run order among all recordings, where some are set aside.
    `pressure_error` is what all engagements with a profile leave of the pressure, in bar, and its autocorrelation;
    `pressure_modes` (n, r, k) in bar is how far the pressure of each engagement is known, along the axes of what is not
    known of the valve's parameters, and `pressure_means` (n, r, k) how far that of all is, along those of their means.
    `of_plates` are the values (n, k) of `OF_PLATES`, once the onset is known.
    """

    bench: Bench
    recordings: Recordings
    settings: NamingSettings
    smooth: dict[str, np.ndarray]
    noise: dict[str, Noise]
    base: np.ndarray
    order: np.ndarray | None = None
    noise_is_known: bool = False
    pressure_error: Noise = 0.0, 0.0
    pressure_modes: np.ndarray | None = None
    pressure_means: np.ndarray | None = None
    of_plates: Mapping[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, bench: Bench, recordings: Recordings, settings: NamingSettings) -> "Scene":
        """The scene of recordings, about the nominal parameters of the bench."""
        signals = recordings.signals
        measured = {} if signals is None else {name: signals[name].astype(float) for name in signals.names}
        noise = {name: sensor_noise(name, values) for name, values in measured.items()}
        smooth = {name: scipy.ndimage.gaussian_filter1d(values, settings.smoothing, axis=1)
                  for name, values in measured.items()}
        return cls(bench, recordings, settings, smooth, noise, np.array(bench.physics.nominal))

    def __len__(self) -> int:
        return len(self.recordings)

    def take(self, rows: np.ndarray) -> "Scene":
        """The engagements `rows`, with the run order that they had among all."""
        return replace(self, recordings=self.recordings.take(rows),
                       smooth={name: values[rows] for name, values in self.smooth.items()}, order=self.run[rows])

    @property
    def missing(self) -> list[str]:
        """The signals that were not measured."""
        return [name for name in SIGNAL_UNITS if name not in self.smooth]

    def has(self, *names: str) -> bool:
        """Whether all of these signals were measured."""
        return set(names) <= set(self.smooth)

    def knows(self, depends_on: str) -> bool:
        """Whether what was measured tells the values of what a law over signals depends on."""
        return depends_on in self.of_plates if depends_on in OF_PLATES else self.has(*TOLD_BY.get(depends_on, ()))

    def abscissa(self, depends_on: str) -> np.ndarray:
        """One of `WITHIN`, (n, k).

        Pressure, output speed and slip are 0 where they would be negative.
        """
        if depends_on == "time":
            return np.broadcast_to(self.time, (len(self), len(self.time)))
        if depends_on == "current":
            conditions = self.recordings.conditions
            profiles = zip(conditions.profile_time, conditions.profile_current, strict=True)
            currents = np.array([np.interp(self.time, *profile) for profile in profiles])
            return np.asarray(currents[conditions.current_profile])
        if depends_on == "output position":
            return np.asarray(np.cumsum(np.maximum(self.smooth["output_speed"], 0), axis=1) * self.step)
        if depends_on in OF_PLATES:
            return self.of_plates[depends_on]
        if depends_on == "slip":  # after lock-up it would be noise of the speeds, which their residuals contain
            return np.where(self.time < self.recordings.measured_time[:, None], self.slip, 0.0)
        values = self.smooth[depends_on.replace(" ", "_")]
        return values if depends_on == "input speed" else np.maximum(values, 0)

    def explained(self, name: str, values: np.ndarray) -> "Scene":
        """With the signal `name` as a block explains it, (n, k)."""
        return replace(self, smooth={**self.smooth, name: values})

    def with_noise(self, name: str, left: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> "Scene":
        """With the noise of the signal `name` that is `left` (n, k) by a block that assumes `noise`.

        Samples count where `counted` (n, k).
        """
        if self.noise_is_known:
            return self
        return replace(self, noise={**self.noise, name: noise_of(left, counted, noise)})

    def measured(self, name: str) -> np.ndarray:
        """The signal `name` (n, k) as it was measured."""
        return np.asarray(self.signals[name], float)

    def value(self, name: str) -> float:
        """The nominal value of a parameter."""
        return float(self.base[parameters.index(name)])

    def model_torque(self, predicted: np.ndarray, relative: Mapping[str, np.ndarray] = MappingProxyType({}),
                     converter: Converter | None = None) -> np.ndarray:
        """Output torque (n, k) in N m without noise: as `predicted` up to lock-up, then that of rigidly coupled shafts.

        The blocks that integrate the torque compute their columns from it, because those from the measured torque would
        share noise with their residuals. The shafts have the parameters (n,) `relative` to nominal and to what the
        conditions state, and this `converter`, where blocks have found them.
        """
        conditions, torque = self.recordings.conditions, predicted.copy()
        lock = np.searchsorted(self.time, self.recordings.measured_time).astype(np.int64)
        losses = np.array([*(self.value(name) * (1 + float(np.mean(relative.get(name, 0.0)))) for name in _LOSSES),
                           self.gear])
        motor, inertia, brake = (getattr(conditions, name) * (1 + relative.get(name, 0.0))
                                 for name in ("motor_speed", "load_inertia", "brake_torque"))
        # After lock-up the shafts turn together, so that either speed will do.
        speed = self.smooth["input_speed"] if self.has("input_speed") else self.gear * self.smooth["output_speed"]
        couple(self.time, lock, speed, motor, inertia, brake, self.given_torque, losses,
               curves_of(converter or self.bench.physics.curves), torque)
        return torque

    @cached_property
    def channels(self) -> dict[str, tuple[np.ndarray, str]]:
        """Further recorded channels in words: the mean (n,) of each engagement up to lock-up, and the unit.

        Gaps do not count. A channel that has no value in an engagement is not among them, but among `unused`.
        """
        slipping = (self.time >= 0) & (self.time < self.recordings.measured_time[:, None])
        constants = {}
        for name, channel in self.recordings.further.items():
            words, known = name.replace("_", " "), slipping & np.isfinite(channel.values)
            if known.any(axis=1).all():
                mean = np.where(known, channel.values, 0).sum(axis=1) / known.sum(axis=1)
                constants[f"recorded {words}" if words in DEPENDENCES else words] = mean, channel.unit
        return constants

    @property
    def unused(self) -> list[str]:
        """Names of further channels that have no value in some engagement."""
        words = {name.removeprefix("recorded ") for name in self.channels}
        return [name for name in self.recordings.further if name.replace("_", " ") not in words]

    @property
    def of_runs(self) -> tuple[str, ...]:
        """What laws may depend on that is one number in an engagement."""
        return ("motor speed", "run order", *self.channels)

    def constant_in_run(self, on: str) -> np.ndarray:
        """One of `of_runs` in each engagement, (n,): the motor speed in rad/s, channels in their unit."""
        if on in self.channels:
            return self.channels[on][0]
        return self.run if on == "run order" else self.recordings.conditions.motor_speed

    def between(self, on: str, centred: bool = True, finer: int = 0) -> np.ndarray:
        """Basis (n, m) of a law over one of `of_runs`, of mean 0 over the engagements where `centred`.

        Its resolution is doubled `finer` times.
        """
        return between(self.constant_in_run(on), doubled(self.settings.knots, finer), centred)

    @property
    def signals(self) -> Signals:
        """The signals of the recordings."""
        assert self.recordings.signals is not None
        return self.recordings.signals

    @property
    def time(self) -> np.ndarray:
        """Sample times (k,) in s; without signals the begin and the end of the longest current profile."""
        signals = self.recordings.signals
        return np.array([0.0, self.recordings.conditions.profile_time.max()]) if signals is None else signals.time

    @property
    def step(self) -> float:
        """Sample time in s."""
        return float(self.time[1] - self.time[0])

    @property
    def gear(self) -> float:
        """Gear ratio: input over output speed after lock-up."""
        return self.value("gear_ratio")

    @property
    def given_torque(self) -> np.ndarray:
        """Torque (n,) in N m on the input shaft that the conditions prescribe."""
        given = self.recordings.conditions.input_torque
        return np.zeros(len(self)) if given is None else given

    @property
    def run(self) -> np.ndarray:
        """Run order (n,), 0 where the recordings state none."""
        order = self.order
        if order is None:
            order = self.recordings.run_order
        if order is None:
            order = self.recordings.conditions.run_order
        return np.zeros(len(self)) if order is None else np.asarray(order, float)

    @property
    def typical_torque(self) -> float:
        """A torque behind the gear in N m, the unit of torques that laws add."""
        return TYPICAL * self.bench.scales.load_torque

    @property
    def margin(self) -> float:
        """Time in s before and after the measured lock-up whose samples are not counted."""
        return _ERRORS * self.timer_noise + _SAMPLES * self.step

    @property
    def timer_noise(self) -> float:
        """Standard deviation in s of the measured shifting time."""
        return self.bench.sensors["shifting_time"].noise or _TIMER_NOISE

    @property
    def slipping(self) -> np.ndarray:
        """Samples (n, k) that are certainly before lock-up, by the measured shifting time and by the speeds.

        The noise of the shifting time that a bench states may be too small.
        """
        before = np.asarray(self.time < (self.recordings.measured_time - self.margin)[:, None])
        if not self.has("input_speed", "output_speed"):
            return before
        return np.asarray(before & slips_until(self._difference, self._after))

    @property
    def locked(self) -> np.ndarray:
        """Samples (n, k) that are certainly after lock-up, and before the plates may slip again."""
        if not self.has("output_torque", "pressure"):
            return self._after
        torque, pressure = self.smooth["output_torque"], self.smooth["pressure"]
        settled = self.recordings.measured_time + self.margin + _KERNEL * self.settings.smoothing * self.step
        return np.asarray(self._after & ~released(torque, pressure, self.slipping, self.time > settled[:, None]))

    @property
    def slip(self) -> np.ndarray:
        """Plate slip (n, k) in rad/s, before the gear: input speed - gear * output speed."""
        return np.asarray(np.maximum(self._difference, 0.0))

    @property
    def _after(self) -> np.ndarray:
        """Samples (n, k) that are later than the measured lock-up by the margin."""
        return np.asarray(self.time > (self.recordings.measured_time + self.margin)[:, None])

    @property
    def _difference(self) -> np.ndarray:
        """Input speed - gear * output speed (n, k) in rad/s, of either sign."""
        return np.asarray(self.smooth["input_speed"] - self.gear * self.smooth["output_speed"])

    def heat(self, torque: np.ndarray) -> np.ndarray:
        """Energy (n, k) in kJ of a `torque` (n, k) in N m: the integral of torque / gear * slip up to lock-up."""
        before = self.time < self.recordings.measured_time[:, None]
        power = torque / self.gear * self.slip * before
        steps = 0.5 * (power[:, 1:] + power[:, :-1]) * np.diff(self.time)
        return np.concatenate([np.zeros((len(self), 1)), np.cumsum(steps, axis=1)], axis=1) / 1000
