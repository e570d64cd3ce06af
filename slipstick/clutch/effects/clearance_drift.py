"""Clearance drift: plate wear lengthens the piston travel from engagement to engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(clearance: float, signals: Signals, c: tuple[float, ...]) -> float:
    wear = c[0]
    return clearance + wear * signals.run


EFFECT = Effect(
    name="clearance_drift",
    title="Clearance drift",
    quantity="clearance",
    depends_on="run order",
    law="clearance + wear run / 100",
    coefficients=(
        Coefficient("wear", "m", 0.0, -0.4, 0.4, "increase of the clearance over 100 engagements", 0.02,
                    scale={"stroke": 1}),
    ),
    source="Archard, J. Appl. Phys. 24(8), 1953: wear proportional to sliding distance, here to the number of runs",
    signature="contact comes later with increasing run order, by the same amount at every pressure",
    formula=_formula,
    shape=Shape("rises"),
    uses_run_order=True,
)
