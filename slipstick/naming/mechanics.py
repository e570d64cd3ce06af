"""What the two blocks share that integrate the measured torque: the load and the input shaft."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.blocks.sensor_noise import power
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming import sensor_errors
from slipstick.naming.filters import smoothed_walk
from slipstick.naming.scene import Pair, Scene

KNOWN = 0.03
"""Relative standard deviation of parameters that a data sheet gives: inertias and losses."""
CONDITIONS_WITHIN = 0.02
"""Relative standard deviation of what the conditions state: inertia, brake torque and motor speed."""
TORQUE_GAIN = "output torque sensor", "gain"
"""The pair of a gain error of the sensor that drives both blocks."""
_ROUNDS = 6
"""Rounds in which the torque under a lag of its sensor is found."""
_FURTHEST, _TABLE = 2.0, 2**13 + 1
"""Range, in units of the largest torque, and length of the table by which a gain error is taken off: with 64 pieces
that differ by a tenth, the torque is then off by 4e-7 of the largest."""


def lock_spike(scene: Scene) -> np.ndarray:
    """1 at the sample (n, k) that follows lock-up.

    The torque jumps there between two samples. As it is taken as linear, its integral is off by up to half the jump
    times the sample time, which a torque at this one sample replaces.
    """
    time, lock = scene.time, scene.recordings.measured_time
    at = np.clip(np.searchsorted(time, lock), 1, len(time) - 2)
    spike = np.zeros((len(lock), len(time)))
    spike[np.arange(len(lock)), at] = 1.0
    return spike


def true_torque(scene: Scene, laws: Sequence[tuple[Pair, np.ndarray]], finer: Mapping[Pair, int]) -> np.ndarray:
    """Torque (n, k) in N m without noise and without the errors of its sensor that are among `laws`.

    The torque that reads as the smooth one is found by iteration. From lock-up on the smooth one is that of rigidly
    coupled shafts: without errors of a sensor but for the gain, which their parameters, fitted to the torque as it was
    read, have taken.
    """
    torque = smooth = scene.smooth["output_torque"]
    gain = [law for law in laws if law[0] == TORQUE_GAIN]
    others = [law for law in laws if law[0][0] == TORQUE_GAIN[0] and law[0] != TORQUE_GAIN]
    if gain or others:
        slipping = scene.time < scene.recordings.measured_time[:, None]
        # Of the other errors only a lag depends on the torque.
        for _ in range(_ROUNDS if any(pair[1] == "lag" for pair, _ in others) else 1):
            left = smooth - slipping * sensor_errors.error(scene, torque, others, TORQUE_GAIN[0], finer)
            torque = _without_gain(scene, left, gain, finer)
    return torque


def _without_gain(scene: Scene, read: np.ndarray, laws: Sequence[tuple[Pair, np.ndarray]],
                  finer: Mapping[Pair, int]) -> np.ndarray:
    """The torque (n, k) in N m that a sensor with these gain errors reads as `read` (n, k).

    By a table: a fixed-point iteration diverges where the error changes by more than the torque does.
    """
    if not laws:
        return read
    torque = sensor_errors.largest(scene, TORQUE_GAIN[0]) * np.linspace(-_FURTHEST, _FURTHEST, _TABLE)
    reading = torque + sensor_errors.error(scene, torque[None], laws, TORQUE_GAIN[0], finer)[0]
    return np.asarray(np.interp(read, np.maximum.accumulate(reading), torque))


def steepness(scene: Scene, torque: np.ndarray, laws: Sequence[tuple[Pair, np.ndarray]],
              finer: Mapping[Pair, int]) -> np.ndarray:
    """Change (n, k) of the reading of a `torque` (n, k) with this, from which `true_torque` is found.

    It is that of the gain errors among `laws`. What a law adds to an error moves the true torque, and the error there.
    """
    gains = [(pair, c) for pair, c in laws if pair == TORQUE_GAIN]
    return sensor_errors.as_read(scene, np.ones(torque.shape)[:, None], torque, gains, TORQUE_GAIN[0], finer)[:, 0]


def with_walk(predicted: np.ndarray, measured: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """The speed (n, k) in rad/s that includes the integrated noise of the torque, estimated from the residuals.

    The residual is a random walk, of variance (onto std)^2 (1 + rho) / (1 - rho) a step, and the noise of the sensor.
    """
    assert noise.onto is not None
    walk = noise.onto[:, -1] ** 2 * power((noise.input_std, noise.input_correlation))
    white = power((noise.std, noise.correlation))
    return np.asarray(predicted + smoothed_walk(np.where(counted, measured - predicted, 0.0), walk / white))
