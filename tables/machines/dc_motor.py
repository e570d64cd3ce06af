"""A motor with permanent magnets: voltage and speed drive the current, current the shaft with friction and a load."""

import numpy as np

from slipstick.machine import Block, Command, Condition, Machine, Output, Parameter, Quantity, Sensor

CONSTANT = Parameter("motor constant", "N m/A", value=0.05)
TORQUE_CONSTANT = Quantity("torque constant", relative=True)

winding = Block("winding", gives="current", reads=("voltage", "speed"), states=("current",),
                parameters=(Parameter("resistance value", "ohm", value=1.0),
                            Parameter("inductance", "H", value=3e-3, within=0.03), CONSTANT),
                quantities=(Quantity("voltage", "V"), Quantity("resistance", relative=True), TORQUE_CONSTANT,
                            Quantity("brush voltage", "V")))


@winding.rate
def change_current(x, u, q, p):
    """Return the rate of the current in A/s."""
    induced = p.motor_constant * (1 + q.torque_constant) * u.speed
    lost = p.resistance_value * (1 + q.resistance) * x.current + q.brush_voltage
    return (u.voltage + q.voltage - lost - induced) / p.inductance


shaft = Block("shaft", gives="speed", reads=("current", "load torque"), states=("speed", "position"),
              switches=("speed",), derived={"angle": lambda x, u, p: np.mod(x.position, 2 * np.pi)},
              parameters=(CONSTANT, Parameter("rotor inertia", "kg m^2", value=1e-4, within=0.03),
                          Parameter("viscous coefficient", "N m s", value=5e-5, scatter=0.1),
                          Parameter("dry torque", "N m", value=0.015)),
              quantities=(TORQUE_CONSTANT, Quantity("inertia", relative=True),
                          Quantity("viscous friction", relative=True), Quantity("dry friction", relative=True),
                          Quantity("friction torque", "N m", size=0.01)))


@shaft.rate
def turn(x, u, q, p):
    """Return the angular acceleration in rad/s^2, and the speed in rad/s."""
    driven = p.motor_constant * (1 + q.torque_constant) * u.current - q.friction_torque
    dry = p.dry_torque * (1 + q.dry_friction) + p.load_torque
    lost = p.viscous_coefficient * (1 + q.viscous_friction) * x.speed + x.speed_side * dry
    return (driven - lost) / (p.rotor_inertia * (1 + q.inertia)), x.speed


def sweep(volts):
    """Return a step to a voltage, and a ramp to half of the opposite one."""
    return (0.0, 0.0), (0.02, 0.0), (0.021, volts), (0.3, volts), (0.9, -volts / 2), (1.0, -volts / 2)


MACHINE = Machine(
    "dc motor", (winding, shaft), (Sensor("current", "A", noise=0.02), Sensor("speed", "rad/s", noise=0.3)),
    commands=(Command("voltage", "V", profiles=(sweep(12.0), sweep(18.0), sweep(24.0))),),
    conditions=(Condition("load torque", "N m", levels=(0.01, 0.02, 0.03)),), duration=1.0, step=2e-3,
    outputs=(Output("run_up_time", "s", of="speed", above=100.0),
             Output("largest_current", "A", of="current", take="largest")))
