"""Two tanks in series: a pump fills the first, which drains and spills into the second, which drains away."""

import numpy as np

from slipstick.machine import Block, Command, Machine, Output, Parameter, Quantity, Sensor

WEIR, BRIM = 0.02, 0.6  # m^1.5/s, m

OUTLET_1 = Parameter("outlet 1", "m^2.5/s", value=8e-3)
PUMP_VOLTAGE = Quantity("voltage", "V", without=("level 1", "level 2"))  # the amplifier is far from the water
PUMP_FLOW = Quantity("pump flow", relative=True)
OUTFLOW_1, OUTFLOW_2 = Quantity("outflow 1", relative=True), Quantity("outflow 2", relative=True)
OVERFLOW = Quantity("overflow", relative=True)
LEAK_1, LEAK_2 = Quantity("leak 1", "m^3/s", size=1e-3), Quantity("leak 2", "m^3/s", size=1e-3)

tank_1 = Block("tank 1", gives="level 1", reads=("voltage",), states=("level 1",), lowest={"level 1": 0.0},
               parameters=(Parameter("pump gain", "m^3/(s V)", value=0.92e-3), OUTLET_1,
                           Parameter("area 1", "m^2", value=0.05, scatter=0.05, within=0.03),
                           Parameter("start 1", "m", value=0.05, first_of="level 1", scale=0.01, scatter=2.0,
                                     within=2.0)),
               quantities=(PUMP_VOLTAGE, PUMP_FLOW, OUTFLOW_1, OVERFLOW, LEAK_1))


@tank_1.rate
def fill_1(x, u, q, p):
    """Return the rate of level 1 in m/s."""
    return (p.pump_gain * (u.voltage + q.voltage) * (1 + q.pump_flow) - drain_1(x.level_1, q, p) - q.leak_1) / p.area_1


@tank_1.start
def start_1(u, q, p):
    """Return level 1 at the begin in m."""
    return p.start_1


tank_2 = Block("tank 2", gives="level 2", reads=("level 1",), states=("level 2",), lowest={"level 2": 0.0},
               parameters=(OUTLET_1, Parameter("outlet 2", "m^2.5/s", value=9e-3),
                           Parameter("area 2", "m^2", value=0.06, scatter=0.05, within=0.03),
                           Parameter("start 2", "m", value=0.05, first_of="level 2", scale=0.01, scatter=2.0,
                                     within=2.0)),
               quantities=(OUTFLOW_1, OVERFLOW, OUTFLOW_2, LEAK_2))


@tank_2.rate
def fill_2(x, u, q, p):
    """Return the rate of level 2 in m/s."""
    drained = p.outlet_2 * (1 + q.outflow_2) * np.sqrt(np.maximum(x.level_2, 0))
    return (drain_1(u.level_1, q, p) - drained - q.leak_2) / p.area_2


@tank_2.start
def start_2(u, q, p):
    """Return level 2 at the begin in m."""
    return p.start_2


def drain_1(level, q, p):
    """Return what leaves tank 1 into tank 2 in m^3/s."""
    spilled = WEIR * np.maximum(level - BRIM, 0) ** 1.5 * (1 + q.overflow)
    return p.outlet_1 * (1 + q.outflow_1) * np.sqrt(np.maximum(level, 0)) + spilled


MACHINE = Machine(
    "two tanks", (tank_1, tank_2), (Sensor("level 1", "m", noise=2e-3), Sensor("level 2", "m", noise=2e-3)),
    commands=(Command("voltage", "V", profiles=tuple(((0, 2), (20, 2), (21, volts), (120, volts), (121, 3))
                                                     for volts in (5, 6, 7, 8))),), duration=200.0, step=0.5,
    outputs=(Output("filling_time", "s", of="level 2", above=0.2),))
