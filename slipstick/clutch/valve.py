"""Eq. 1 with effects or laws on the valve current or the line pressure; unused without them.

Eq. 1 contains the time derivative of the line pressure k (u - a). With effects the line pressure is k (u - a) + c,
where c may jump. The second state is therefore w = x2 + 2/tau c: w' equals x2' of eq. 1 plus 6/tau^2 c, and contains
no derivative of c.
"""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook
from slipstick.clutch.lanes import (
    CURRENT,
    CURRENT_BIAS,
    LANES,
    LAW_FLAG,
    LINE_PRESSURE,
    PRESSURE_CHANGE,
    PRESSURE_DAMPING,
    PRESSURE_RATE,
    SEGMENT_CURRENT,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    STAGE_TIME,
    START,
    VALVE_GAIN,
)
from slipstick.clutch.law_kernels import evaluate_laws

_current_effects, _line_pressure_effects = hook("valve current"), hook("line pressure")


@kernel
def valve(b, active):
    """Compute c in bar, and x2 from w. At t = 0, where x2 is zero, initialize w."""
    for i in range(LANES):
        b[CURRENT + i] = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
        b[PRESSURE_CHANGE + i] = b[VALVE_GAIN + i] * (b[CURRENT + i] - b[CURRENT_BIAS + i])
    if active[LAW_FLAG]:
        evaluate_laws(b)
    _current_effects(b, active)
    for i in range(LANES):
        b[LINE_PRESSURE + i] = b[VALVE_GAIN + i] * (b[CURRENT + i] - b[CURRENT_BIAS + i])
    _line_pressure_effects(b, active)
    for i in range(LANES):
        change = b[LINE_PRESSURE + i] - b[PRESSURE_CHANGE + i]
        offset, start = 0.5 * b[PRESSURE_DAMPING + i] * change, b[START + LANES + i]
        is_initial = b[STAGE_TIME + i] <= 0.0
        b[PRESSURE_CHANGE + i] = change
        b[START + LANES + i] = offset if is_initial else start
        rate = b[PRESSURE_RATE + i] - offset
        b[PRESSURE_RATE + i] = 0.0 if is_initial else rate
