"""Temperature drift of the piston gain: the oil warms up from engagement to engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(gain: float, signals: Signals, c: tuple[float, ...]) -> float:
    drift = c[0]
    return gain * (1.0 + drift * signals.run)


EFFECT = Effect(
    name="temperature_drift",
    title="Temperature drift of the piston gain",
    quantity="piston gain",
    depends_on="run order",
    law="k_T (1 + drift run / 100)",
    coefficients=(
        Coefficient("drift", "1", 0.0, -0.8, 0.8, "relative change of k_T over 100 engagements", 0.03),
    ),
    source="Tod et al., eq. 1: k_T represents the oil temperature, which drifts here",
    signature="contact comes steadily earlier or later with increasing run order, in all conditions",
    formula=_formula,
    shape=Shape("either"),
    uses_run_order=True,
)
