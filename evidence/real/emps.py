"""An electro-mechanical positioning system: a motor drives a carriage by a ball screw (Janot and others, 2019).

Position at 1 kHz, from https://www.nonlinearbenchmark.org: `DATA_EMPS.mat` and `DATA_EMPS_PULSES.mat`, with `qm` in m,
`vir` in V, `gtau` in N/V, and in the second one `pulses_N`. The model lacks Coulomb friction. Published least-squares
values of mass, viscous friction, Coulomb friction and offset are in `PUBLISHED`.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

from evidence.real import Row
from slipstick.engine.measured_law import measure
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification
from slipstick.engine.study import estimate_parameters
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

PUBLISHED = {"mass": 95.11, "viscous friction": 203.5, "Coulomb friction": 20.39, "offset": -3.16}
"""In kg, N s/m, N and N."""
_FIRST, _LENGTH, _EVERY = 10, 414, 2
"""Samples that are left out at either end, those of a move from rest to rest, and of which each so many-th is taken."""

# The moves are cut from the same recording of the same machine: what does not change between them has no scatter.
_drive = Block(
    "drive", gives="position", reads=("force",), states=("position", "velocity"), switches=("velocity",),
    parameters=(Parameter("mass", "kg", value=95.0, within=0.1, scatter=0.0),
                Parameter("viscous friction", "N s/m", value=203.0, within=0.5, scatter=0.0),
                Parameter("offset", "N", value=0.0, scale=1.0, within=5.0, scatter=0.0),
                Parameter("start", "m", first_of="position", scale=1e-6, scatter=1.0, within=1.0),
                Parameter("start velocity", "m/s", value=0.0, scale=0.1, scatter=1.0, within=1.0)),
    quantities=(Quantity("friction force", "N", size=20.0, without=("force", "past force")),
                Quantity("motor force", relative=True, without=("position", "past force")),
                Quantity("moving mass", relative=True, without=("velocity", "force", "past force"))))


@_drive.rate
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    force = u.force * (1 + q.motor_force) - p.viscous_friction * x.velocity - p.offset - q.friction_force
    return x.velocity, force / (p.mass * (1 + q.moving_mass))


@_drive.start
def _(u, q, p):  # type: ignore[no-untyped-def]
    return p.start, p.start_velocity


MACHINE = Machine("positioning system", (_drive,), (Sensor("position", "m"),), commands=(Command("force", "N"),))


def read(folder: Path) -> Recorded:
    """Return the moves of both recordings, standing still included."""
    moves = list[tuple[np.ndarray, np.ndarray]]()
    for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
        content = scipy.io.loadmat(folder / name)
        position = content["qm"].ravel()
        force = content["vir"].ravel() * float(content["gtau"].item())
        if "pulses_N" in content:
            force = force + content["pulses_N"].ravel()
        moves += [(position[begin:begin + _LENGTH:_EVERY], force[begin:begin + _LENGTH + 1])
                  for begin in range(_FIRST, len(position) - _FIRST - _LENGTH, _LENGTH)]
    instants = 1e-3 * np.arange(_LENGTH + 1)
    forces = Profile(np.tile(instants, (len(moves), 1)), np.array([force for _, force in moves]))
    runs = Runs(instants[:-1:_EVERY], {"position": np.array([position for position, _ in moves])}, {"force": forces},
                {}, {}, np.arange(len(moves), dtype=float))
    return prepare(MACHINE, runs)


def compare(answer: Identification) -> Iterator[Row]:
    """Yield parameters, and the friction at velocities of which the law is asked, beside published values."""
    [fit] = answer.fits
    known = {each.name: each for each in estimate_parameters(fit)}
    for name, unit in (("mass", "kg"), ("viscous friction", "N s/m"), ("offset", "N")):
        yield Row(name, known[name].mean, known[name].error, unit, PUBLISHED[name])
    pair = "friction force", "velocity"
    if pair in fit.laws:
        law = measure(fit, pair)
        for velocity in (-0.1, -0.05, -0.02, 0.02, 0.05, 0.1):
            change, error = (float(np.interp(velocity, law.x, values)) for values in (law.change, law.std))
            published = PUBLISHED["viscous friction"] * velocity + PUBLISHED["Coulomb friction"] * np.sign(velocity)
            yield Row(f"friction at {velocity:g} m/s", known["viscous friction"].mean * velocity
                      + known["offset"].mean + change, error, "N", published + PUBLISHED["offset"])
