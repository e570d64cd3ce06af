"""Valve deadband: about its centre the spool moves without opening or closing anything."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(current: float, signals: Signals, c: tuple[float, ...]) -> float:
    width, centre = c[0], c[1]
    x = signals.current - centre
    return current - width * x / (abs(x) + width + 1e-9)


EFFECT = Effect(
    name="valve_deadband",
    title="Valve deadband",
    quantity="valve current",
    law="u - width x / (|x| + width), x = u - centre",
    coefficients=(
        Coefficient("width", "A", 0.0, 0.0, 0.05, "half the band, and how far it shifts the current beyond", 0.01),
        Coefficient("centre", "A", 0.3, 0.2, 0.5, "current at the middle of the band", 0.3, True),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on spool valves: overlap, here with rounded corners",
    signature="near its centre the pressure hardly answers to the current; to either side it is offset",
    formula=_formula,
)
