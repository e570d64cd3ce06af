"""Clearance drift: the plates wear, and the piston has farther to go, from engagement to engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(clearance: float, signals: Signals, c: tuple[float, ...]) -> float:
    wear = c[0]
    return clearance + wear * signals.run


EFFECT = Effect(
    name="clearance_drift",
    title="Clearance drift",
    quantity="clearance",
    law="clearance + wear run / 100",
    coefficients=(
        Coefficient("wear", "m", 0.0, -8e-4, 8e-4, "clearance gained over 100 engagements", 4e-5),
    ),
    source="Archard, Journal of Applied Physics 24(8), 1953: wear in proportion to sliding distance, here to the count",
    signature="contact comes later with the place in the run order, by as much at every pressure",
    formula=_formula,
    uses_run_order=True,
)
