"""How long the plates have touched, and what heats them: what laws of the closing clutch depend on."""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.naming.scene import Scene


@dataclass(frozen=True, eq=False)
class Contact:
    """Times (n, k) in s: `full` since full contact, and `time`, the integral of f_reg, on which laws depend.

    A low pressure after a fill pulse may part the plates again, at a time that is hardly known: `full` is the time
    until they part where that is shorter, and 0 while they are apart.

    f_reg is the share of the friction that acts, which rises from 0 to 1 before full contact. The difference of the two
    times is that of a slow or fast closing: engagements differ in it. `friction` (n, k) is the torque in N m
    that heats the plates, without that of the oil film, and `position` (n, k) that of the piston in m.
    """

    full: np.ndarray
    time: np.ndarray
    friction: np.ndarray
    position: np.ndarray

    @classmethod
    def of(cls, scene: Scene, position: np.ndarray, width: np.ndarray, end: np.ndarray, friction: np.ndarray,
           lacking: np.ndarray) -> "Contact":
        """That of plates whose piston is at a `position` (n, k) in m, known up to the samples `end` (n,).

        The friction rises over a `width` (n, 1) in m before full contact, to a torque `friction` (n, k) in N m, which
        lacks as much of the measured one.
        """
        stroke, step = scene.value("contact_position"), scene.step
        beyond = np.arange(position.shape[1]) >= end[:, None]  # where the plates, once locked, still touch
        share = np.where(beyond, 1.0, np.clip(1 - (stroke - position) / width, 0.0, 1.0))
        time = scipy.integrate.cumulative_trapezoid(share**2 * (3 - 2 * share), dx=step, axis=1, initial=0)
        # In full contact it is the stroke exactly, and after the samples that are integrated it is 0.
        touching = (position >= stroke) | beyond
        parts = np.logical_or.accumulate(~touching[:, ::-1], axis=1)[:, ::-1]
        left = np.where(parts, _run_length(touching[:, ::-1])[:, ::-1], position.shape[1])
        # Only what the model lacks is smoothed: the torque rises within few samples.
        smooth = scipy.ndimage.gaussian_filter1d(np.where(beyond, 0.0, lacking), scene.settings.smoothing, axis=1)
        heats = np.where(beyond, scene.smooth["output_torque"], np.where(share > 0, friction + smooth, 0.0))
        return cls(np.minimum(_run_length(touching), left) * step, time, np.maximum(heats, 0.0),
                   np.where(touching, stroke, position))


def _run_length(values: np.ndarray) -> np.ndarray:
    """For how many samples (n, k), this one included, values (n, k) have been true without a break."""
    count = np.cumsum(values, axis=1)
    return count - np.maximum.accumulate(np.where(values, 0, count), axis=1)
