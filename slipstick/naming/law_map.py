"""How the coefficients of a law become values: what a block states about the basis of each of its pairs."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from slipstick.clutch.effects.effect import QUANTITIES, SCALAR_DEPENDENCES, SENSORS
from slipstick.naming import bases, sensor_errors
from slipstick.naming.lags import lag_points, lags_about
from slipstick.naming.scene import Pair, Scene
from slipstick.naming.sensor_errors import NOT_TOLD_FROM_GAIN
from slipstick.naming.sensor_lags import lag_scale, sizes_over_runs
from slipstick.numerics import piecewise

UpTo = Literal["nothing", "constant", "line"]
"""What a block cannot tell from its own parameters: it may be added to a law without a change of the prediction."""

UNITS = {**QUANTITIES, **SENSORS, "input torque": "N m", "valve delay": "s", "friction lag": "s",
         "converter lag": "s"}
"""Units of the quantities of all pairs. Blocks have four that no effect changes."""
_X_UNITS = {**SCALAR_DEPENDENCES, "output position": "rad"}
_GAIN_POINTS = 5
"""Points of the relative error of a sensor over its signal, which is a line: enough to draw its error."""


@dataclass(frozen=True, eq=False)
class LawMap:
    """The values of a law with coefficients (c,): onto @ coefficients, with `onto` (m, c).

    They are changes in `unit` at `x` (m,) in `x_unit`, or a single number (m = 1) where `x` is None. Where `relative`
    they are shares of the quantity, and the unit is "1". The law is known `up_to` what it states. Where x are
    `at_levels`, the recordings have no other values.
    """

    onto: np.ndarray
    unit: str
    relative: bool = False
    x: np.ndarray | None = None
    x_unit: str = ""
    up_to: UpTo = "nothing"
    at_levels: bool = False


def over(pair: Pair, x: np.ndarray, onto: np.ndarray, relative: bool = False, up_to: UpTo = "nothing",
         x_unit: str = "") -> LawMap:
    """A law at points x (m,) of what a quantity depends on; without `relative` in the unit of the quantity.

    A further recorded channel has its own `x_unit`.
    """
    return LawMap(onto, "1" if relative else UNITS[pair[0]], relative, x, x_unit or _X_UNITS[pair[1]], up_to)


def over_runs(pair: Pair, scene: Scene, finer: int, size: float = 1.0, relative: bool = False,
              centred: bool = True) -> LawMap:
    """A law over one of `scene.of_runs`, of mean 0 over the runs where `centred`; coefficients are in units of `size`.

    Its resolution is doubled `finer` times. Its columns are those of `Scene.between`: none where all runs are alike.
    """
    values = scene.constant_in_run(pair[1])
    knots = bases.between_knots(values, bases.doubled(scene.settings.knots, finer))
    onto = size * np.eye(len(knots))
    if centred or len(knots) < 2:
        onto = onto[:, 1:] - size * piecewise.hats(values, knots)[:, 1:].mean(axis=0)
    law = over(pair, knots, onto, relative, "constant" if centred else "nothing", unit_of(pair[1], scene))
    return replace(law, at_levels=bool(np.isin(values, knots).all()))


def refined(coarse: LawMap, coefficients: np.ndarray, fine: LawMap) -> np.ndarray:
    """Coefficients of the `fine` law that has the values of a `coarse` one, between whose points it is linear."""
    assert coarse.x is not None
    assert fine.x is not None
    values = np.interp(fine.x, coarse.x, coarse.onto @ coefficients)
    return np.asarray(np.linalg.lstsq(fine.onto, values, rcond=None)[0])


def unit_of(depends_on: str, scene: Scene) -> str:
    """The unit of what a law over one of `scene.of_runs` depends on."""
    return scene.channels[depends_on][1] if depends_on in scene.channels else _X_UNITS[depends_on]


def single(row: np.ndarray | float, unit: str) -> LawMap:
    """A single number: the sum of the coefficients, weighted with `row` (c,) in `unit`."""
    return LawMap(np.atleast_2d(row), unit)


def of_sensor(pair: Pair, scene: Scene, finer: int = 0) -> LawMap:
    """The error of a sensor, with the columns of `Scene.reading`.

    An offset is a number in the unit of the signal. A lag is a number in s: the mean of the impulse response, by which
    a slow ramp is read late. A gain is the relative error over the signal, constant for a sensor whose slope is wrong.
    An error over another signal is 0 where that is 0, where it would be an offset. Over the run order, a channel and
    time it is an offset that drifts. That of the pressure sensor is known up to a constant gain, which the gain of the
    valve compensates.
    """
    sensor, on = pair
    if on in scene.of_runs:
        return over_runs(pair, scene, finer, sensor_errors.drift(scene, sensor), centred=False)
    if on == "offset":
        return single(1.0, UNITS[sensor])
    if on == "lag":
        times = lags_about(lag_scale(scene))
        if not finer:
            return single(times, "s")
        middle = piecewise.hats(np.array([[0.5]]), lag_points(finer))[0, :, 0]  # at half of the range, or of the time
        row = np.concatenate([times, np.outer(middle, times).ravel(), np.outer(middle[1:], times).ravel()])
        own = len(times) * sizes_over_runs(scene, finer).shape[1]
        return single(np.pad(row, (0, own)), "s")  # what changes over the runs has mean 0
    if on == "gain":
        share = bases.gain_points(finer) if finer else np.linspace(0, 1, _GAIN_POINTS)
        onto = np.eye(len(share)) if finer else np.stack([np.ones_like(share), share], axis=1)
        x = sensor_errors.largest(scene, sensor) * share
        if sensor in NOT_TOLD_FROM_GAIN:
            return LawMap(onto[:, 1:], "1", True, x, UNITS[sensor], "constant")
        return LawMap(onto, "1", True, x, UNITS[sensor])
    knots = sensor_errors.error_knots(scene, on, finer)
    return over(pair, knots, sensor_errors.drift(scene, sensor) * np.eye(len(knots))[:, 0 if on == "time" else 1:])
