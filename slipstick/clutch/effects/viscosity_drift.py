"""Temperature drift of the oil film: warming oil becomes thinner from engagement to engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled, exp


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    drift = c[0]
    return torque * exp(drift * signals.run)


EFFECT = Effect(
    name="viscosity_drift",
    title="Temperature drift of the oil film",
    quantity="film torque",
    depends_on="run order",
    law="film torque exp(drift run / 100)",
    coefficients=(
        Coefficient("drift", "1", 0.0, -6.0, 6.0, "change of the exponent over 100 engagements", -0.4),
    ),
    source="Stachowiak and Batchelor, Engineering Tribology, chapter on properties of lubricants: Reynolds law",
    signature="drag before contact falls with increasing run order; the slip phase does not change",
    formula=_formula,
    shape=Shape("either"),
    uses_run_order=True,
)
