"""Eqs. 2-4: film and friction torque, torque converter, and the shafts at rest, in slip and in stick."""

from slipstick.clutch.fastmath import kernel
from slipstick.clutch.hooks import hook, memories
from slipstick.clutch.lanes import (
    BRAKE,
    BREAKAWAY,
    CAPACITY,
    CLEARANCE,
    CLUTCH_TORQUE,
    CONTACT,
    CONVERTER,
    DIRECTION,
    FILM,
    FILM_COEFFICIENT,
    FRICTION,
    FRICTION_COEFFICIENT,
    GEAR,
    INPUT_COULOMB,
    INPUT_INERTIA,
    INPUT_SPEED,
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
    SEGMENTS,
    SLIPPING,
    STICK,
    TORQUE_RATIO,
)

_on_friction, _on_film = hook("friction coefficient"), hook("film torque")
_on_converter, _on_load, _on_stick = hook("converter torque"), hook("load torque"), hook("stick torque")
_move_memories = memories()


@kernel
def converter_torque(b):
    """Fill the row CONVERTER: output torque in N m, motor_speed^2 f_st / f_sk^2."""
    first, last, at_torque, at_capacity = b[SEGMENTS + 1], b[SEGMENTS + 2], b[SEGMENTS + 3], b[SEGMENTS + 4]
    rise_torque, rise_capacity = b[SEGMENTS + 5], b[SEGMENTS + 6]
    for i in range(LANES):
        ratio = min(last, max(first, b[INPUT_SPEED + i] * b[INVERSE_MOTOR_SPEED + i]))
        b[RATIO + i] = ratio
        b[TORQUE_RATIO + i] = at_torque + rise_torque * (ratio - first)
        b[CAPACITY + i] = at_capacity + rise_capacity * (ratio - first)
    for part in range(int(b[SEGMENTS])):
        k = SEGMENTS + 7 + 12 * part
        s0, t0, c0, s1, t1, c1 = b[k], b[k + 1], b[k + 2], b[k + 3], b[k + 4], b[k + 5]
        s2, t2, c2, s3, t3, c3 = b[k + 6], b[k + 7], b[k + 8], b[k + 9], b[k + 10], b[k + 11]
        for i in range(LANES):
            ratio = b[RATIO + i]
            d0, d1, d2, d3 = max(0.0, ratio - s0), max(0.0, ratio - s1), max(0.0, ratio - s2), max(0.0, ratio - s3)
            b[TORQUE_RATIO + i] += t0 * d0 + t1 * d1 + t2 * d2 + t3 * d3
            b[CAPACITY + i] += c0 * d0 + c1 * d1 + c2 * d2 + c3 * d3
    for i in range(LANES):
        capacity = b[MOTOR_SPEED + i] / b[CAPACITY + i]
        b[CONVERTER + i] = b[TORQUE_RATIO + i] * capacity * capacity


@kernel
def driveline(b, active):
    """Fill the torque rows in N m, the rates of Omega and omega, and how far the modes are from their end."""
    for i in range(LANES):
        # f_reg, and (1 - f_reg)/clearance in the form that has no division by zero as the plates meet.
        s = min(1.0, max(0.0, 1.0 - b[CLEARANCE + i] * b[INVERSE_RAMP_WIDTH + i]))
        b[RAMP + i] = s * s * (3.0 - 2.0 * s)
        closing = (1.0 - s) * (1.0 + 2.0 * s) * b[INVERSE_RAMP_WIDTH + i]
        clearance = b[CLEARANCE + i]
        per_gap = closing if s > 0.0 else 1.0 / clearance
        slip = b[INPUT_SPEED + i] * b[INVERSE_GEAR + i] - b[OUTPUT_SPEED + i]
        b[FILM + i] = b[FILM_COEFFICIENT + i] * per_gap * slip
        b[FRICTION + i] = b[FRICTION_COEFFICIENT + i]
        b[LOAD + i] = b[BRAKE + i] + b[OUTPUT_VISCOUS + i] * b[OUTPUT_SPEED + i]
    converter_torque(b)
    _on_friction(b, active)
    _on_film(b, active)
    _on_converter(b, active)
    _on_load(b, active)
    for i in range(LANES):
        drive = b[CONVERTER + i] - b[INPUT_VISCOUS + i] * b[INPUT_SPEED + i] - b[INPUT_COULOMB + i]
        stick_rate = (drive - b[LOAD + i] * b[INVERSE_GEAR + i]) * b[INVERSE_TOTAL_INERTIA + i]
        b[RIGID + i] = drive - b[INPUT_INERTIA + i] * stick_rate
        b[STICK + i] = b[RIGID + i]
    _on_stick(b, active)
    for i in range(LANES):
        capacity = b[RAMP + i] * b[FRICTION + i] * b[CONTACT + i]
        slip_torque = capacity * b[DIRECTION + i] + b[FILM + i]
        drive = b[CONVERTER + i] - b[INPUT_VISCOUS + i] * b[INPUT_SPEED + i] - b[INPUT_COULOMB + i]
        stick_rate = (drive - b[LOAD + i] * b[INVERSE_GEAR + i]) * b[INVERSE_TOTAL_INERTIA + i]
        stick_torque = b[STICK + i]
        slipping = b[SLIPPING + i] > 0.0
        # Sticking plates join the shafts rigidly unless an effect says otherwise; rigid ones decide whether they hold.
        apart = slipping | (stick_torque != b[RIGID + i])
        torque = slip_torque if slipping else stick_torque
        b[CLUTCH_TORQUE + i] = torque
        net = b[GEAR + i] * torque - b[LOAD + i]
        b[BREAKAWAY + i] = net
        b[RELEASE + i] = abs(b[RIGID + i]) - capacity
        slip_rate = (drive - torque) * b[INVERSE_INPUT_INERTIA + i]
        load_rate = net * b[INVERSE_LOAD_INERTIA + i] * b[MOVING + i]
        b[RATE + 3 * LANES + i] = slip_rate if apart else stick_rate
        b[RATE + 4 * LANES + i] = load_rate if apart else stick_rate * b[INVERSE_GEAR + i]
    _move_memories(b, active)
