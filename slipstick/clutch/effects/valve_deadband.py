"""Valve deadband: near its centre the spool moves without changing the opening."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(current: float, signals: Signals, c: tuple[float, ...]) -> float:
    width, centre, rounding = c[0], c[1], c[2]
    x = signals.current - centre
    return current - width * x / (abs(x) + rounding)


EFFECT = Effect(
    name="valve_deadband",
    title="Valve deadband",
    quantity="valve current",
    depends_on="current",
    law="u - width x / (|x| + rounding), x = u - centre",
    coefficients=(
        Coefficient("width", "A", 0.0, 0.0, 0.12, "half-width of the band, and current shift beyond it", 0.012,
                    scale={"current": 1}),
        Coefficient("centre", "A", 0.2, 0.062, 0.62, "current at the centre of the band", 0.25, True, {"current": 1}),
        Coefficient("rounding", "A", 0.05, 0.0062, 0.38, "width of the rounded corners of the band", 0.062, True,
                    {"current": 1}),
    ),
    source="Merritt, Hydraulic Control Systems, chapter on spool valves: overlap, here with rounded corners",
    signature="near the centre the pressure hardly responds to the current; on either side it is offset",
    formula=_formula,
    shape=Shape("falls"),
)
