"""Eqs. 2-4: film and friction torque, torque converter, and the shafts in the rest, slip and stick states."""

import numpy as np

from slipstick.clutch import converter
from slipstick.clutch.fastmath import compiled, kernel
from slipstick.clutch.hooks import hook, memory_rates
from slipstick.clutch.lanes import (
    BRAKE,
    BREAKAWAY,
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
    RELEASE,
    RIGID,
    SLIPPING,
    STICK,
)

# The curves on a uniform grid that contains all their points, so that a cell is found by one multiplication.
_CELLS = 20
_GRID = np.linspace(0.0, 1.0, _CELLS + 1)
_TORQUE_RATIO = np.interp(_GRID, converter.SPEED_RATIO, converter.TORQUE_RATIO)
_CAPACITY = np.interp(_GRID, converter.SPEED_RATIO, converter.CAPACITY_FACTOR)
_TORQUE_RATIO_RISE, _CAPACITY_RISE = np.diff(_TORQUE_RATIO), np.diff(_CAPACITY)

_friction_effects, _film_effects = hook("friction coefficient"), hook("film torque")
_converter_effects, _load_effects, _stick_effects = hook("converter torque"), hook("load torque"), hook("stick torque")
_memory_rates = memory_rates()


@compiled
def converter_torque(speed_ratio, motor_speed):
    """Converter output torque in N m, motor_speed^2 f_st / f_sk^2, at a motor speed in rad/s."""
    position = min(float(_CELLS), max(0.0, speed_ratio * _CELLS))
    cell = np.uint64(min(_CELLS - 1.0, position))
    fraction = position - cell
    ratio = _TORQUE_RATIO[cell] + fraction * _TORQUE_RATIO_RISE[cell]
    capacity = motor_speed / (_CAPACITY[cell] + fraction * _CAPACITY_RISE[cell])
    return ratio * capacity * capacity


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
        b[LOAD + i] = b[BRAKE + i] + b[OUTPUT_VISCOUS + i] * b[OUTPUT_SPEED + i]
    for i in range(LANES):
        b[CONVERTER + i] = converter_torque(b[INPUT_SPEED + i] * b[INVERSE_MOTOR_SPEED + i], b[MOTOR_SPEED + i])
    _friction_effects(b, active)
    _film_effects(b, active)
    _converter_effects(b, active)
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
