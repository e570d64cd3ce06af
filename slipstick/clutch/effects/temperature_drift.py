"""Oil temperature drift of the piston gain: the oil warms up from engagement to engagement."""

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled


@compiled
def _formula(gain: float, signals: Signals, c: tuple[float, ...]) -> float:
    drift = c[0]
    return gain * (1.0 + drift * signals.run)


EFFECT = Effect(
    name="temperature_drift",
    title="Oil temperature drift of the piston",
    quantity="piston gain",
    law="k_T (1 + drift run / 100)",
    coefficients=(
        Coefficient("drift", "1", 0.0, -0.8, 0.8, "change over 100 engagements, as a share of k_T", 0.03),
    ),
    source="Tod et al., eq. 1: k_T stands for the oil temperature, here no longer constant",
    signature="contact comes earlier or later with the place in the run order, whatever the condition",
    formula=_formula,
    uses_run_order=True,
)
