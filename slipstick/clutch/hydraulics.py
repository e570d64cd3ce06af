"""Eq. 1: pressure, piston position and contact pressure from the valve current."""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook
from slipstick.clutch.lanes import (
    CHAMBER,
    CLEARANCE,
    CLEARANCE_CHANGE,
    CONTACT,
    CONTACT_FACTOR,
    CONTACT_POSITION,
    CURRENT_BIAS,
    LANES,
    LAW_FLAG,
    PISTON_GAIN,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RATE,
    PISTON_RETURN,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_BIAS,
    PRESSURE_CHANGE,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_RATE,
    PRESSURE_STIFFNESS,
    QUANTITY_FLAG,
    RATE,
    SEGMENT_CURRENT,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    SLOPE_GAIN,
    STAGE_TIME,
    TEMPERATURE_GAIN,
)
from slipstick.clutch.law_kernels import evaluate_laws, evaluate_rate_laws
from slipstick.clutch.valve import valve

_VALVE_CURRENT, _LINE_PRESSURE = QUANTITY_FLAG["valve current"], QUANTITY_FLAG["line pressure"]
_chamber_effects, _gain_effects = hook("chamber pressure"), hook("piston gain")
_piston_rate_effects, _clearance_effects = hook("piston rate"), hook("clearance")
_contact_effects = hook("contact pressure")


@kernel
def hydraulics(b, active):
    """Compute CHAMBER (bar), CLEARANCE (m), CONTACT (Pa) and the rates of x1, x2, x3, for all lanes."""
    valve_changes = active[_VALVE_CURRENT] | active[_LINE_PRESSURE]
    if valve_changes:
        valve(b, active)
    if active[LAW_FLAG]:
        if valve_changes:
            evaluate_rate_laws(b)
        else:
            evaluate_laws(b)
    for i in range(LANES):
        current = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
        # (1,2) Pade approximation of a pure delay; its step response starts in the wrong direction.
        b[RATE + i] = b[PRESSURE_RATE + i]
        b[RATE + LANES + i] = (
            b[PRESSURE_GAIN + i] * (current - b[CURRENT_BIAS + i]) - b[SLOPE_GAIN + i] * b[SEGMENT_SLOPE + i]
            - b[PRESSURE_STIFFNESS + i] * (b[PRESSURE + i] - b[PRESSURE_CHANGE + i])
            - b[PRESSURE_DAMPING + i] * b[PRESSURE_RATE + i])
        b[CHAMBER + i] = b[PRESSURE + i]
        b[PISTON_GAIN + i] = b[TEMPERATURE_GAIN + i]
    _chamber_effects(b, active)
    _gain_effects(b, active)
    for i in range(LANES):
        b[PISTON_RATE + i] = (
            b[PISTON_PRESSURE + i] * (b[CHAMBER + i] - b[PRESSURE_BIAS + i])
            + b[PISTON_PRESSURE_RATE + i] * b[PRESSURE_RATE + i] - b[PISTON_RETURN + i] * b[PISTON_STATE + i])
        b[CLEARANCE + i] = b[CONTACT_POSITION + i] - max(0.0, b[PISTON_GAIN + i] * b[PISTON_STATE + i])
        b[CLEARANCE_CHANGE + i] = b[CLEARANCE + i]
    _piston_rate_effects(b, active)
    _clearance_effects(b, active)
    for i in range(LANES):
        b[RATE + 2 * LANES + i] = b[PISTON_RATE + i]
        b[CLEARANCE_CHANGE + i] = b[CLEARANCE + i] - b[CLEARANCE_CHANGE + i]
        b[CLEARANCE + i] = max(0.0, b[CLEARANCE + i])
        travel = b[CONTACT_POSITION + i] - b[CLEARANCE + i]
        b[CONTACT + i] = max(0.0, travel * b[CONTACT_FACTOR + i]) * 1e5 * max(0.0, b[CHAMBER + i])
    _contact_effects(b, active)
