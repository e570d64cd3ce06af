"""Eq. 1: from valve current to pressure, piston position and contact pressure."""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook
from slipstick.clutch.lanes import (
    CHAMBER,
    CLEARANCE,
    CONTACT,
    CONTACT_FACTOR,
    CONTACT_POSITION,
    CURRENT,
    CURRENT_BIAS,
    LANES,
    LINE_CURRENT,
    LINE_SLOPE,
    LINE_TIME,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RATE,
    PISTON_RETURN,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_BIAS,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_RATE,
    PRESSURE_STIFFNESS,
    RATE,
    SLOPE_GAIN,
    STAGE_TIME,
    TEMPERATURE_GAIN,
)

_on_current, _on_chamber = hook("valve current"), hook("chamber pressure")
_on_piston_rate, _on_clearance, _on_contact = hook("piston rate"), hook("clearance"), hook("contact pressure")


@kernel
def hydraulics(b, active):
    """Fill the rows CHAMBER (bar), CLEARANCE (m), CONTACT (Pa) and the rates of x1, x2, x3, for all lanes."""
    for i in range(LANES):
        b[CURRENT + i] = b[LINE_CURRENT + i] + b[LINE_SLOPE + i] * (b[STAGE_TIME + i] - b[LINE_TIME + i])
        b[CHAMBER + i] = b[PRESSURE + i]
    _on_current(b, active)
    _on_chamber(b, active)
    for i in range(LANES):
        # The (1,2) Pade form of a pure delay: it answers a step by first going negative.
        b[RATE + i] = b[PRESSURE_RATE + i]
        b[RATE + LANES + i] = (
            b[PRESSURE_GAIN + i] * (b[CURRENT + i] - b[CURRENT_BIAS + i]) - b[SLOPE_GAIN + i] * b[LINE_SLOPE + i]
            - b[PRESSURE_STIFFNESS + i] * b[PRESSURE + i] - b[PRESSURE_DAMPING + i] * b[PRESSURE_RATE + i])
        b[PISTON_RATE + i] = (
            b[PISTON_PRESSURE + i] * (b[CHAMBER + i] - b[PRESSURE_BIAS + i])
            + b[PISTON_PRESSURE_RATE + i] * b[PRESSURE_RATE + i] - b[PISTON_RETURN + i] * b[PISTON_STATE + i])
        travel = min(b[CONTACT_POSITION + i], max(0.0, b[TEMPERATURE_GAIN + i] * b[PISTON_STATE + i]))
        b[CLEARANCE + i] = b[CONTACT_POSITION + i] - travel
    _on_piston_rate(b, active)
    _on_clearance(b, active)
    for i in range(LANES):
        b[RATE + 2 * LANES + i] = b[PISTON_RATE + i]
        travel = b[CONTACT_POSITION + i] - b[CLEARANCE + i]
        b[CONTACT + i] = max(0.0, travel * b[CONTACT_FACTOR + i]) * 1e5 * max(0.0, b[CHAMBER + i])
    _on_contact(b, active)
