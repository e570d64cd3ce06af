"""A heated plate and its sensor: replace everything here by your machine, then run

    slipstick machine check THIS_FILE

A machine is cut into blocks at its measured signals. Each block computes one signal from commands, conditions and other
measured signals, so that a study finds in which block the model and the recordings disagree.
"""

import numpy as np

from slipstick.machine import Block, Command, Condition, Machine, Output, Parameter, Quantity, Sensor

# The constants of the equations: name, unit, nominal value. What is written with spaces is read with underscores.
#   within   the share by which the value is known on average over all runs; left out: not at all, it is estimated
#   scatter  the largest standard deviation from run to run, as a share; 0: the same in all runs (default 0.05)
# A parameter that may be 0 or negative has a `scale`: its changes are added, in units of that.
# A state that begins in motion needs a parameter of its start; `first_of` takes it from the first sample of a signal.
resistance = Parameter("resistance", "ohm", value=20.0, within=0.02)
heat_capacity = Parameter("heat capacity", "J/K", value=50.0)
transfer = Parameter("transfer", "W/K", value=0.5)
gain = Parameter("radiator gain", "m/s/V", value=0.4)
lag = Parameter("fan lag", "s", value=2.0)
first_temperature = Parameter("first temperature", "degC", value=20.0, first_of="temperature", scale=0.2, scatter=2.0,
                              within=2.0)

# The places of the equations that a law may change: what may be wrong or missing in the model. They are 0 in the model.
#   relative  a share: write value * (1 + q.name); otherwise a sum in its unit, of which `size` is a large change
#   without   names on which it cannot depend, for a physical reason; by default it may depend on everything
cooling = Quantity("cooling", relative=True)
power = Quantity("power", relative=True, without=("air speed",))  # the heater is not in the air
lost_heat = Quantity("lost heat", "W", size=5.0)
air = Quantity("air", relative=True)

# The first block: from the voltage of the fan to the measured speed of the air. x: states, u: inputs, q: quantities,
# p: parameters. They are arrays over all runs: use numpy functions, and numpy.where in the place of if.
fan = Block("fan", gives="air speed", reads=("fan voltage",), states=("air speed",), parameters=(gain, lag),
            quantities=(air,))


@fan.rate
def accelerate(x, u, q, p):
    """Return the rate of each state: here of the air speed, in m/s^2."""
    return (p.radiator_gain * u.fan_voltage * (1 + q.air) - x.air_speed) / p.fan_lag


@fan.start
def stand(u, q, p):
    """Return each state at the begin of a run; left out: 0."""
    return p.radiator_gain * u.fan_voltage


# The second block: from the voltage of the heater and the measured air speed to the measured temperature.
plate = Block("plate", gives="temperature", reads=("heater voltage", "air speed", "room temperature"),
              states=("temperature",), parameters=(resistance, heat_capacity, transfer, first_temperature),
              quantities=(cooling, power, lost_heat))


@plate.rate
def warm(x, u, q, p):
    """Return the rate of the temperature in K/s."""
    heating = u.heater_voltage**2 / p.resistance * (1 + q.power)
    difference = x.temperature - p.room_temperature  # a condition is read like a parameter
    carried = p.transfer * (1 + np.maximum(u.air_speed, 0)) * difference * (1 + q.cooling)
    return (heating - carried - q.lost_heat) / p.heat_capacity


@plate.start
def begin(u, q, p):
    """Return the first temperature in degC."""
    return p.first_temperature


# Commands are known exactly; their profiles, corners (time in s, value), are those of your experiments. Conditions are
# constant in a run; `within` is the error of what is stated of them. `noise` is the standard deviation of a sample.
MACHINE = Machine(
    "heated plate", (fan, plate),
    sensors=(Sensor("air speed", "m/s", noise=0.02), Sensor("temperature", "degC", noise=0.05)),
    commands=(Command("fan voltage", "V", profiles=(((0, 2), (60, 2), (61, 8), (200, 4)),
                                                    ((0, 6), (100, 6), (101, 1), (200, 1)))),
              Command("heater voltage", "V", profiles=(((0, 0), (5, 0), (6, 40), (150, 40), (151, 10)),
                                                       ((0, 0), (5, 0), (6, 60), (100, 60), (101, 30)),
                                                       ((0, 0), (5, 0), (6, 50), (200, 20))))),
    conditions=(Condition("room temperature", "degC", levels=(18.0, 24.0), within=0.01),),
    duration=200.0, step=0.5,  # of a run, and between two samples, in s
    # Numbers of a run that tables, propagations and fits are about.
    outputs=(Output("warm_up_time", "s", of="temperature", above=60.0),
             Output("highest_temperature", "degC", of="temperature", take="largest")))
