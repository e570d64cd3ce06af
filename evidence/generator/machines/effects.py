"""Draws the law of an effect: a form of random shape over the range that the nominal runs visit."""

import numpy as np

from ..forms import Curve, draw_curve, draw_drift, draw_lag, draw_memory
from . import tanks
from .pairs import Pair
from .recordings import MACHINES, Reading
from .runs import PAST, SEQUENCE, Change, Runs
from .settings import TEMPERATURES

CONSTANT_IN_A_RUN = (SEQUENCE, "temperature", "winding temperature", "load torque")
LARGEST_RATIO = 3.0  # of a quantity with its effect to that without it
_CONSTANT = Curve("constant", np.array([0.0, 1.0]), np.ones(2))
_PARTS = {"voltage": 0.3, "brush voltage": 0.3, "leak 1": 0.4, "leak 2": 0.4, "friction torque": 3.0}
"""Largest change over the largest voltage, a flow at 6 V, and the dry torque."""
_SENSOR_PART, _PLAY_PART, _LAG_PART = 0.3, 0.2, 0.05  # largest error over a range, play over one, lag over a duration
_PACES = (0.02, 0.2)  # time constant of the averaged voltage over the duration


def draw_change(pair: Pair, nominal: Runs, reading: Reading, random: np.random.Generator) -> Change:
    """Draw a law for a pair of words on a machine with these nominal runs."""
    quantity, on = pair
    if on == "lag":
        return Change(pair, quantity, "time", lag=draw_lag(random))
    if on == "offset":
        return Change(pair, quantity, "time", _CONSTANT)
    if pair == ("voltage", PAST):
        kind = random.integers(2)
        return (Change(pair, quantity, PAST, memory=draw_memory(random)) if kind
                else Change(pair, quantity, PAST, lag=draw_lag(random)))
    abscissa = quantity.removesuffix(" sensor") if on == "gain" else on
    form = draw_drift(random) if on == SEQUENCE else draw_curve(
        random, smooth=on in ("position", "current") and not quantity.endswith("sensor"))  # faster than the integrator
    zero = float(form(np.array(random.random())))
    if on == "position" and random.random() < 0.7:
        turns, phase = int(random.integers(1, 3)), float(random.uniform(0, 2 * np.pi))
        return Change(pair, quantity, abscissa, form, zero=zero, turns=turns, phase=phase)
    pace = float(random.uniform(*_PACES) * nominal.time[-1]) if on == PAST else 0.0
    magnitude = on == "speed" and quantity in ("viscous friction", "dry friction")
    low, high = _find_bounds(quantity, abscissa, nominal, reading, magnitude)
    if on == "gain":
        zero = float(np.interp(-low / (high - low), form.nodes, form.values))  # no error at 0
    elif quantity.startswith("leak"):
        zero = 0.0
    return Change(pair, quantity, abscissa, form, low, high, zero, magnitude, pace=pace)


def _find_bounds(quantity: str, abscissa: str, nominal: Runs, reading: Reading,
                 magnitude: bool) -> tuple[float, float]:
    """Return the range in which nearly all abscissas are, of water above the brim for the weir."""
    if abscissa == SEQUENCE:
        return 0.0, 1.0
    if "temperature" in abscissa:
        return TEMPERATURES[nominal.machine]
    values = reading.abscissas[abscissa].ravel()
    if quantity == "overflow":
        values = values[reading.abscissas["level 1"].ravel() > tanks.BRIM]
    low, high = np.quantile(np.abs(values) if magnitude else values, (0.01, 0.99))
    return float(low), float(max(high, low + 1e-6))


def largest_amplitude(change: Change, nominal: Runs, reading: Reading) -> float:
    """Return the amplitude up to which a change is plausible: no quantity changes by too much."""
    quantity, machine = change.quantity, MACHINES[nominal.machine]
    if change.memory is not None:
        return _PLAY_PART * float(np.ptp(nominal.corner_value))
    if change.lag is not None:
        return _LAG_PART * float(nominal.time[-1])
    values = change(reading.abscissas[change.abscissa])
    if quantity in machine.RATIOS:
        rise, fall = max(values.max(), 1e-9), max(-values.min(), 1e-9)
        return float(min((LARGEST_RATIO - 1) / rise, (1 - 1 / LARGEST_RATIO) / fall))
    if quantity.endswith("sensor"):
        size = _SENSOR_PART * np.ptp(reading.signals[quantity.removesuffix(" sensor")])
    elif quantity.startswith("leak"):
        size = _PARTS[quantity] * 6.0 * nominal.values["pump gain"][0]
    else:
        whole = (nominal.values["dry torque"][0] if quantity == "friction torque"
                 else np.abs(nominal.corner_value).max())
        size = _PARTS[quantity] * whole
    return float(size / max(np.abs(values).max(), 1e-9))


def can_act_in_few_runs(change: Change) -> bool:
    """Return whether the effect may be absent in a run, and differs within a run."""
    return change.form is not None and change.form.family != "constant" and change.abscissa not in CONSTANT_IN_A_RUN
