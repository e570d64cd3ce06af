"""Eqs. 2-4: film and friction torque, torque converter, and the shafts in the rest, slip and stick states."""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook, memory_rates
from slipstick.clutch.lanes import (
    BRAKE,
    BRAKING,
    BREAKAWAY,
    CAPACITY,
    CLEARANCE,
    CLUTCH_TORQUE,
    CONTACT,
    CONVERTER,
    CURVES,
    DIRECTION,
    FILM,
    FILM_COEFFICIENT,
    FRICTION,
    FRICTION_COEFFICIENT,
    GEAR,
    INPUT_COULOMB,
    INPUT_INERTIA,
    INPUT_SPEED,
    INPUT_TORQUE,
    INPUT_VISCOUS,
    INVERSE_GEAR,
    INVERSE_INPUT_INERTIA,
    INVERSE_LOAD_INERTIA,
    INVERSE_MOTOR_SPEED,
    INVERSE_RAMP_WIDTH,
    INVERSE_TOTAL_INERTIA,
    LANES,
    LOAD,
    MOTOR_SPEED,
    MOVING,
    OUTPUT_SPEED,
    OUTPUT_VISCOUS,
    RAMP,
    RATE,
    RATIO,
    RELEASE,
    RIGID,
    SEGMENT_TIME,
    SEGMENT_TORQUE,
    SEGMENT_TORQUE_SLOPE,
    SLIPPING,
    STAGE_TIME,
    STICK,
    TORQUE_RATIO,
)

_friction_effects, _film_effects = hook("friction coefficient"), hook("film torque")
_converter_effects, _stick_effects = hook("converter torque"), hook("stick torque")
_brake_effects, _load_effects = hook("brake torque"), hook("load torque")
_memory_rates = memory_rates()


@kernel
def converter_torque(b):
    """Fill the row CONVERTER in N m: motor_speed^2 f_st / f_sk^2, and the given input torque.

    Each curve is a line and a sum of hinges, max(0, ratio - position): unlike a look-up in a table passed as an
    argument, that is turned into vector instructions for any number of points.
    """
    first, last = b[CURVES + 1], b[CURVES + 2]
    torque_ratio, torque_slope, capacity, capacity_slope = b[CURVES + 3], b[CURVES + 4], b[CURVES + 5], b[CURVES + 6]
    for i in range(LANES):
        ratio = min(last, max(first, b[INPUT_SPEED + i] * b[INVERSE_MOTOR_SPEED + i]))
        b[RATIO + i] = ratio
        b[TORQUE_RATIO + i] = torque_ratio + torque_slope * (ratio - first)
        b[CAPACITY + i] = capacity + capacity_slope * (ratio - first)
    for group in range(int(b[CURVES])):  # of four hinges, so that the rows are read and written less often
        k = CURVES + 7 + 12 * group
        p0, t0, c0, p1, t1, c1 = b[k], b[k + 1], b[k + 2], b[k + 3], b[k + 4], b[k + 5]
        p2, t2, c2, p3, t3, c3 = b[k + 6], b[k + 7], b[k + 8], b[k + 9], b[k + 10], b[k + 11]
        for i in range(LANES):
            ratio = b[RATIO + i]
            h0, h1, h2, h3 = max(0.0, ratio - p0), max(0.0, ratio - p1), max(0.0, ratio - p2), max(0.0, ratio - p3)
            b[TORQUE_RATIO + i] += t0 * h0 + t1 * h1 + t2 * h2 + t3 * h3
            b[CAPACITY + i] += c0 * h0 + c1 * h1 + c2 * h2 + c3 * h3
    for i in range(LANES):
        speed = b[MOTOR_SPEED + i] / b[CAPACITY + i]
        given = b[SEGMENT_TORQUE + i] + b[SEGMENT_TORQUE_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i])
        b[CONVERTER + i] = b[TORQUE_RATIO + i] * speed * speed + b[INPUT_TORQUE + i] + given


@kernel
def driveline(b, active):
    """Compute the torque rows in N m, the rates of Omega and omega, and the event functions."""
    for i in range(LANES):
        # f_reg, and (1 - f_reg)/clearance in a form without division by zero at contact.
        s = min(1.0, max(0.0, 1.0 - b[CLEARANCE + i] * b[INVERSE_RAMP_WIDTH + i]))
        b[RAMP + i] = s * s * (3.0 - 2.0 * s)
        closing = (1.0 - s) * (1.0 + 2.0 * s) * b[INVERSE_RAMP_WIDTH + i]
        clearance = b[CLEARANCE + i]
        per_gap = closing if s > 0.0 else 1.0 / clearance
        slip = b[INPUT_SPEED + i] * b[INVERSE_GEAR + i] - b[OUTPUT_SPEED + i]
        b[FILM + i] = b[FILM_COEFFICIENT + i] * per_gap * slip
        b[FRICTION + i] = b[FRICTION_COEFFICIENT + i]
        b[BRAKING + i] = b[BRAKE + i]
    converter_torque(b)
    _friction_effects(b, active)
    _film_effects(b, active)
    _converter_effects(b, active)
    _brake_effects(b, active)
    for i in range(LANES):
        b[LOAD + i] = b[BRAKING + i] + b[OUTPUT_VISCOUS + i] * b[OUTPUT_SPEED + i]
    _load_effects(b, active)
    for i in range(LANES):
        drive = b[CONVERTER + i] - b[INPUT_VISCOUS + i] * b[INPUT_SPEED + i] - b[INPUT_COULOMB + i]
        stick_rate = (drive - b[LOAD + i] * b[INVERSE_GEAR + i]) * b[INVERSE_TOTAL_INERTIA + i]
        b[RIGID + i] = drive - b[INPUT_INERTIA + i] * stick_rate
        b[STICK + i] = b[RIGID + i]
    _stick_effects(b, active)
    for i in range(LANES):
        capacity = b[RAMP + i] * b[FRICTION + i] * b[CONTACT + i]
        slip_torque = capacity * b[DIRECTION + i] + b[FILM + i]
        drive = b[CONVERTER + i] - b[INPUT_VISCOUS + i] * b[INPUT_SPEED + i] - b[INPUT_COULOMB + i]
        stick_rate = (drive - b[LOAD + i] * b[INVERSE_GEAR + i]) * b[INVERSE_TOTAL_INERTIA + i]
        stick_torque = b[STICK + i]
        slipping = b[SLIPPING + i] > 0.0
        # Sticking plates couple the shafts rigidly unless an effect changes the stick torque. The torque of a rigid
        # coupling decides about release in either case.
        uncoupled = slipping | (stick_torque != b[RIGID + i])
        torque = slip_torque if slipping else stick_torque
        b[CLUTCH_TORQUE + i] = torque
        net = b[GEAR + i] * torque - b[LOAD + i]
        b[BREAKAWAY + i] = net
        b[RELEASE + i] = abs(b[RIGID + i]) - capacity
        slip_rate = (drive - torque) * b[INVERSE_INPUT_INERTIA + i]
        load_rate = net * b[INVERSE_LOAD_INERTIA + i] * b[MOVING + i]
        b[RATE + 3 * LANES + i] = slip_rate if uncoupled else stick_rate
        b[RATE + 4 * LANES + i] = load_rate if uncoupled else stick_rate * b[INVERSE_GEAR + i]
    _memory_rates(b, active)
