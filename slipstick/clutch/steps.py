"""The step of each lane: long where the solution is smooth, and ending where f_reg has a kink.

Between its kinks, at the onset of friction and at contact, f_reg is smooth, so that a step may be a part of the ramp.
The times at which the piston passes the kinks are predicted from its speed and acceleration.
"""

import math

from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.lanes import (
    CLEARANCE_CHANGE,
    CONTACT_POSITION,
    DIRECTION,
    EFFECT_TIME,
    END_TIME,
    FIRST,
    FORCE,
    INVERSE_GEAR,
    LANES,
    LAW_FLAG,
    PISTON_GAIN,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RETURN,
    PRESSURE_DAMPING,
    PRESSURE_STIFFNESS,
    QUANTITY_FLAG,
    RAMP_WIDTH,
    SEGMENT_END,
    SEGMENT_SLOPE,
    SLIPPING,
    START,
    STEP,
    STIFFNESS,
    TIME,
    VALVE_GAIN,
    VALVE_TIME,
)

PRESSURE_ERROR = 1e-4
"""Error in bar that the steps may leave of a transient of the pressure, or of the torque that it causes."""

EFFECT_FRACTION = 0.3
"""Longest step as a fraction of the time constants of effects."""

STABLE = 1.5
"""Longest step times the stiffness of the speeds; the Runge-Kutta method is stable up to 2.8."""

FAST_PASSAGE = 5e-3
"""Time in s in which the piston passes the ramp of f_reg in steps of the fine length; slower, steps are longer."""

NEAR = 0.2
"""Fraction of the time constants of valve and piston in which a kink is predicted well enough."""

APPROACH = 0.6
"""Step toward lock-up, or to a kink that is not near, as a share of the predicted time."""

_CLEARANCE, _GAIN = QUANTITY_FLAG["clearance"], QUANTITY_FLAG["piston gain"]


@inlined
def _time_to(distance, speed, acceleration, limit):
    """First time in s at which `distance` >= 0 is covered with a constant acceleration, or `limit` if that is later."""
    square = speed * speed + 2.0 * acceleration * distance
    mean = 0.5 * (speed + math.sqrt(max(0.0, square)))
    return distance / mean if (square >= 0.0) & (distance < mean * limit) else limit


@inlined
def _in_transient(b, i, has_laws, is_open):
    """Longest step in s while the pressure oscillates about its steady rise.

    Of the change of speed by a torque in proportion to the pressure, the Runge-Kutta method loses (lambda h)^5 / 2880
    in a step (Simpson's rule), and of a pressure that it integrates itself, (lambda h)^5 / 120. The oscillation lasts
    1 / (lambda h) steps, with lambda^2 = 6/tau^2. No torque follows the pressure while the plates are open.
    """
    stiffness = b[PRESSURE_STIFFNESS + i]
    steady = b[VALVE_GAIN + i] * b[SEGMENT_SLOPE + i]
    size = abs(b[FIRST + LANES + i]) + 0.5 * b[PRESSURE_DAMPING + i] * abs(b[FIRST + i] - steady)
    # The share of what effects add to pressure and piston rate, which changes as the pressure does.
    valve, piston = abs(b[FORCE + LANES + i]), abs(b[FORCE + 2 * LANES + i])
    added = max(valve / (valve + stiffness * (abs(b[START + i]) + 1.0)),
                piston / (piston + abs(b[FIRST + 2 * LANES + i]) + 1e-9))
    share = (0.0 if is_open else 1 / 2880) + 1 / 120 * (1.0 if has_laws else added)
    return math.sqrt(math.sqrt(PRESSURE_ERROR / (share * size * stiffness + 1e-12)))


@inlined
def _to_kink(b, i, fine, position, onset, width, reach):
    """Step in s to the next kink of f_reg or toward it, or in the ramp a part of the ramp."""
    gain, rate, contact = b[PISTON_GAIN + i], b[FIRST + 2 * LANES + i], b[CONTACT_POSITION + i]
    speed = gain * rate
    acceleration = gain * (
        b[PISTON_PRESSURE + i] * b[FIRST + i] + b[PISTON_PRESSURE_RATE + i] * b[FIRST + LANES + i]
        - b[PISTON_RETURN + i] * rate)
    is_closing, is_closed = position >= onset, position >= contact
    upper, lower = contact if is_closing else onset, contact if is_closed else onset
    rises = _time_to(max(0.0, upper - position), speed, acceleration, reach)
    falls = _time_to(max(0.0, position - lower), -speed, -acceleration, reach)
    kink = min(reach if is_closed else rises, falls if is_closing else reach)
    step = kink if (kink < NEAR * b[VALVE_TIME + i]) | (kink >= reach) else APPROACH * kink
    part = fine / FAST_PASSAGE * width / (abs(speed) + fine * abs(acceleration))
    return min(step, part) if is_closing & (not is_closed) else step


@inlined
def _to_lock_up(b, i, reach):
    """Step in s toward lock-up, or `reach` if that is later."""
    direction, share = b[DIRECTION + i], b[INVERSE_GEAR + i]
    slip = direction * (b[START + 3 * LANES + i] * share - b[START + 4 * LANES + i])
    fall = direction * (b[FIRST + 4 * LANES + i] - b[FIRST + 3 * LANES + i] * share)
    is_locking = (b[SLIPPING + i] > 0.0) & (slip < fall * reach)
    return APPROACH * slip / fall if is_locking else reach


@kernel
def choose_steps(b, active, fine, coarse):
    """Set STEP and END_TIME in s of all lanes, from the rates at the start of the step."""
    # Laws have kinks. The rate of one that changes the travel of the piston is not known, so that the kinks of f_reg
    # cannot be predicted.
    has_laws = active[LAW_FLAG]
    is_unpredicted = has_laws & (active[_CLEARANCE] | active[_GAIN])
    most = fine if is_unpredicted else 0.5 * coarse if has_laws else coarse
    for i in range(LANES):
        width = b[RAMP_WIDTH + i]
        position = b[PISTON_GAIN + i] * b[START + 2 * LANES + i] - b[CLEARANCE_CHANGE + i]
        onset = b[CONTACT_POSITION + i] - width
        longest = min(most, _in_transient(b, i, has_laws, position < onset))
        reach = 1.25 * longest  # the piston may accelerate
        step = min(longest, _to_kink(b, i, fine, position, onset, width, reach), _to_lock_up(b, i, reach))
        # The lower limit bounds the run time; where it applies, the solution may diverge.
        limit = min(b[VALVE_TIME + i], EFFECT_FRACTION * b[EFFECT_TIME + i], STABLE / (b[STIFFNESS + i] + 1e-3))
        step = min(max(fine, step), max(limit, 0.02 * fine))
        remaining = b[SEGMENT_END + i] - b[TIME + i]
        b[STEP + i] = min(step, remaining)
        b[END_TIME + i] = b[SEGMENT_END + i] if step >= remaining else b[TIME + i] + step
