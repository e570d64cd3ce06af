"""Two shafts with a dry clutch that slips and sticks: a motor drives the first, a brake loads the second."""

import numpy as np

from slipstick.machine import Block, Command, Condition, Machine, Output, Parameter, Quantity, Sensor

driveline = Block(
    "driveline", gives=("input speed", "output speed"), reads=("press force", "motor torque", "brake torque"),
    states=("slip", "second speed"), switches=("slip",), lowest={"second speed": 0.0},
    parameters=(Parameter("friction coefficient", value=0.4), Parameter("friction radius", "m", value=0.1, within=0.01),
                Parameter("input inertia", "kg m^2", value=0.2, within=0.03),
                Parameter("output inertia", "kg m^2", value=0.5, within=0.03),
                Parameter("drag", "N m s", value=0.02, scatter=0.1),
                Parameter("first slip", "rad/s", value=100.0, first_of="input speed", scale=1.0, scatter=5.0,
                          within=5.0)),
    quantities=(Quantity("friction", relative=True), Quantity("spring force", "N", size=50.0),
                Quantity("load torque", "N m", size=5.0)))


@driveline.rate
def turn(x, u, q, p):
    """Return the rates of the slip and of the second shaft in rad/s^2: plates that stick carry what holds them."""
    force = np.maximum(u.press_force - q.spring_force, 0)
    torque = 2 * p.friction_radius * p.friction_coefficient * (1 + q.friction) * force * x.slip_side
    against = p.brake_torque + p.drag * x.second_speed + q.load_torque
    second = (torque - against) / p.output_inertia
    second = np.where((x.second_speed <= 0) & (second < 0), 0.0, second)  # the brake holds it
    return (u.motor_torque - torque) / p.input_inertia - second, second


@driveline.start
def stand(u, q, p):
    """Return the slip and the second speed in rad/s."""
    return p.first_slip, 0.0


@driveline.output
def read(x, u, q, p):
    """Return both speeds in rad/s."""
    return x.slip + x.second_speed, x.second_speed


def press(force):
    """Return a ramp to a force, and a fall to a quarter of it, at which the plates break away."""
    return (0, 0), (0.1, 0), (0.6, force), (1.5, force), (1.6, force / 4), (2, force / 4)


def drive(torque):
    """Return a step to a torque while the plates close."""
    return (0, 0), (0.5, 0), (0.6, torque), (2, torque)


MACHINE = Machine(
    "dry clutch", (driveline,), (Sensor("input speed", "rad/s", noise=0.2), Sensor("output speed", "rad/s", noise=0.2)),
    commands=(Command("press force", "N", profiles=(press(400.0), press(600.0), press(800.0))),
              Command("motor torque", "N m", profiles=(drive(15.0), drive(25.0)))),
    conditions=(Condition("brake torque", "N m", levels=(5.0, 10.0, 15.0)),), duration=2.0, step=4e-3,
    outputs=(Output("pulling_away_time", "s", of="output speed", above=10.0),
             Output("largest_output_speed", "rad/s", of="output speed", take="largest")))
