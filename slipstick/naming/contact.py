"""The clutch block over a part of the engagement: around the onset of the torque, or in full contact.

At the onset friction is nearly constant, whatever it depends on, and the torque determines the parameters of the
piston. In full contact the piston rests, and torque over pressure is the friction coefficient.
"""

from collections.abc import Mapping
from typing import Self

import numpy as np
import scipy

from slipstick.blocks.sensor_noise import power
from slipstick.blocks.whitening import BlockNoise
from slipstick.naming.block import Laws, Pair, changed
from slipstick.naming.piston import OWN, ClutchBlock, Late, last_of
from slipstick.naming.scene import Scene
from slipstick.numerics.piecewise import hats

_AFTER = 0.02
"""Time in s after the onset that is counted."""
WAIT, LONG_WAIT = 0.02, 0.05
"""Times in s after full contact from which on it is counted: the piston may be late by less. The long one is for
recordings whose onset is not explained, so that the piston is known less well."""
_HALF, _VISIBLE = 0.5, 5
"""The onset is where the torque exceeds this share of that in full contact, and so many noise levels."""
_QUIET = 0.01
"""Time in s after the command before which no plates meet."""
_AVERAGED = 2
"""Standard deviation in samples of the kernel that averages the torque to find the onset."""
_CONTACT_LAWS = ("friction coefficient", "chamber pressure", "contact pressure", "output torque sensor")


class OnsetBlock(ClutchBlock):
    """The clutch until shortly after the plates meet."""

    name = "onset"

    def __init__(self, scene: Scene, pressure: np.ndarray, late: Late | None = None, after: float = _AFTER,
                 contact: np.ndarray | None = None, laws: Laws = (), finer: Mapping[Pair, int] | None = None) -> None:
        """`contact` (n, k) in s is the time in contact, from an earlier fit: the window then ends after it begins.

        `laws` are those that the block will have, `finer` as it says: an offset among them is not taken off as well.
        """
        super().__init__(scene, pressure, late)
        self.finer = finer or {}
        self.measured = self.measured - self._zero([(pair, c) for pair, c in laws if pair[0] == "output torque sensor"])
        first = self._onset()
        if contact is not None:
            first = np.maximum(first, np.where((contact > 0).any(axis=1), np.argmax(contact > 0, axis=1), 0))
        self.counted = self.counted & (np.arange(len(scene.time)) < (first + int(after / scene.step))[:, None])
        self.end = last_of(self.counted)
        # Wider in friction: it is that of the onset alone, and a law may change it by more than runs scatter.
        self.widest = np.concatenate([[0.6], self.widest[1:]])

    def _zero(self, errors: Laws) -> np.ndarray:
        """What the sensor reads too much before the plates close (n, 1), in N m, beside its `errors`: no friction.

        It may drift over the test. As far as readings of the engagements differ by no more than their noise explains,
        they have the median in common. Nothing is known of it where the signals begin later.
        """
        quiet = self.scene.time < _QUIET
        if not quiet.any():
            return np.zeros((len(self.measured), 1))
        film = self.base(np.zeros((len(self.measured), len(self.random))), errors)
        left = (self.measured - film)[:, quiet]
        each, common = left.mean(axis=1), np.median(left)
        of_noise = power(self.scene.noise[self.signal]) / quiet.sum()
        between = max(float(scipy.stats.median_abs_deviation(each, scale="normal")) ** 2 - of_noise, 0.0)
        return np.asarray(common + between / (between + of_noise) * (each - common))[:, None]

    def _onset(self) -> np.ndarray:
        """First sample (n,) whose torque exceeds half of that in full contact."""
        noise, full = self.scene.noise[self.signal][0], self.torque_per_bar * np.maximum(self.pressure, 0)
        torque = scipy.ndimage.gaussian_filter1d(self.measured, _AVERAGED, axis=1)
        loaded = (torque > _HALF * full) & (torque > _VISIBLE * noise) & (self.scene.time > _QUIET)
        return np.where(loaded.any(axis=1), np.argmax(loaded, axis=1), len(self.scene.time))


class ContactBlock(ClutchBlock):
    """The clutch in full contact, where the piston drops out; its parameter is the friction coefficient.

    What the valve block leaves of the pressure is the same in all engagements with a profile, so that no noise could
    stand for it: it is a function of time that they share, as large as what is left. An error of the means of the
    valve's parameters is one of all engagements.
    """

    name = "contact"
    random: tuple[str, ...] = ("friction_coefficient",)

    def __init__(self, scene: Scene, pressure: np.ndarray, points: np.ndarray, late: Late | None = None,
                 wait: float = WAIT) -> None:
        """`points` (n, 7) are those of the clutch or onset block."""
        super().__init__(scene, pressure, late)
        self._piston = points[:, 1:].copy()
        self.in_contact = ClutchBlock(scene, pressure).contact(points)
        self.counted = self.counted & (self.in_contact.full > wait)
        self.widest = np.array([0.2])
        self.random_std = np.array([np.inf])
        profiles, means = self._of_profiles(), scene.pressure_means
        means = np.zeros((len(scene), 0, len(scene.time))) if means is None else self.torque_per_bar * means
        self._unknown = np.concatenate([profiles, means], axis=1)
        self._off = np.zeros(self._unknown.shape[1])
        self.fixed = ("clock", *(f"pressure {i}" for i in range(len(self._off))))
        self.fixed_std = np.array([scene.step, *[scene.pressure_error[0]] * profiles.shape[1], *[1.0] * means.shape[1]])
        self.modes = self._modes_at(points[:, :1])

    def at(self, shared: np.ndarray) -> Self:
        """The block with the clock, in s, and the errors (m,) of the pressure in bar: the `shared` values (1 + m,)."""
        return changed(super().at(shared[:1]), _off=shared[1:])

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """Torque (n, k) in N m as the sensor reads it, at `points` (n, 1)."""
        return np.asarray(super().base(points, laws) + self._off @ self._unknown)

    def shared_columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, p, k) in N m/s with the clock, and in N m/bar with the errors of the pressure."""
        return np.concatenate([super().shared_columns(points, laws, predicted), self._unknown], axis=1)

    def noise(self, points: np.ndarray) -> BlockNoise:
        """That of the sensor, and how far the pressure is known: what it lacks are shared values."""
        return BlockNoise(*self.scene.noise[self.signal], modes=self.modes)

    def _of_profiles(self) -> np.ndarray:
        """Changes (n, m, k) in N m of the torque with errors of the pressure over time, for each current profile."""
        scene, seen = self.scene, self.counted.any(axis=0)
        if not (scene.pressure_error[0] > 0 and seen.any()):
            return np.zeros((len(scene), 0, len(scene.time)))
        knots = np.linspace(scene.time[seen][0], scene.time[seen][-1], scene.settings.finer_knots)
        over, profiles = hats(scene.time[None], knots)[0], scene.recordings.conditions.current_profile
        columns = np.concatenate([(profiles == profile)[:, None, None] * over for profile in np.unique(profiles)],
                                 axis=1)
        return np.asarray(self.torque_per_bar * columns[:, (columns * self.counted[:, None]).any(axis=(0, 2))])

    def pairs(self, rare: bool = False) -> list[Pair]:
        """Laws of what acts in full contact."""
        return [pair for pair in super().pairs(rare) if pair[0] in _CONTACT_LAWS]

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Changes (n, m, k) in N m with the coefficients of a law.

        At the mean friction coefficient: in a fit without a law that of each engagement has taken its part of the law.
        """
        return super().basis(pair, np.tile(points.mean(axis=0), (len(points), 1)), laws, predicted)

    def _all(self, points: np.ndarray) -> np.ndarray:
        """Relative changes (n, 7) of all parameters: the friction coefficients, and the piston as it was given."""
        assert OWN[0] == self.random[0]
        return np.concatenate([points, self._piston], axis=1)
