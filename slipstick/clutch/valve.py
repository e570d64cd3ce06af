"""What effects on the valve current and the line pressure change in eq. 1: the plain model never comes here.

Eq. 1 holds the slope of the line pressure k (u - a), and that of a changed one may jump. It is never taken: where the
line pressure is k (u - a) + c, the second state is w = x2 + 2/tau c, and w' is what x2' was but for 6/tau^2 c.
"""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook
from slipstick.clutch.lanes import (
    CURRENT,
    CURRENT_BIAS,
    LANES,
    SEGMENT_CURRENT,
    LINE_PRESSURE,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    PRESSURE_CHANGE,
    PRESSURE_DAMPING,
    PRESSURE_GAIN,
    PRESSURE_RATE,
    PRESSURE_STIFFNESS,
    STAGE_TIME,
    START,
)

_on_current, _on_line_pressure = hook("valve current"), hook("line pressure")


@kernel
def valve(b, active):
    """Fill the row of c in bar, and turn w into x2, which is zero at t = 0."""
    for i in range(LANES):
        b[CURRENT + i] = b[SEGMENT_CURRENT + i] + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
        gain = b[PRESSURE_GAIN + i] / b[PRESSURE_STIFFNESS + i]
        b[PRESSURE_CHANGE + i] = gain * (b[CURRENT + i] - b[CURRENT_BIAS + i])
    _on_current(b, active)
    for i in range(LANES):
        gain = b[PRESSURE_GAIN + i] / b[PRESSURE_STIFFNESS + i]
        b[LINE_PRESSURE + i] = gain * (b[CURRENT + i] - b[CURRENT_BIAS + i])
    _on_line_pressure(b, active)
    for i in range(LANES):
        change = b[LINE_PRESSURE + i] - b[PRESSURE_CHANGE + i]
        ahead, start, begins = 0.5 * b[PRESSURE_DAMPING + i] * change, b[START + LANES + i], b[STAGE_TIME + i] <= 0.0
        b[PRESSURE_CHANGE + i] = change
        b[START + LANES + i] = ahead if begins else start
        rate = b[PRESSURE_RATE + i] - ahead
        b[PRESSURE_RATE + i] = 0.0 if begins else rate
