"""An electro-mechanical positioning system: a motor drives a carriage by a ball screw (Janot and others, 2019).

Position at 1 kHz, from https://www.nonlinearbenchmark.org: `DATA_EMPS.mat` and `DATA_EMPS_PULSES.mat`, with `qm` in m,
`vir` in V, `gtau` in N/V. The pulses of the second one are in `vir` already: the controller's law, fitted to `vir`, has
them with a factor of 1.06. The plain model lacks Coulomb friction. `KNOWN` are published least-squares values.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import scipy

from evidence.real import Row, compare_parameters, sum_terms
from evidence.real.picture import Band, Panel, draw_panels
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

VISCOUS, COULOMB, OFFSET = ("N s/m", 203.5), ("N", 20.39), ("N", -3.16)
KNOWN = {"mass": ("kg", 95.11), "viscous friction": VISCOUS, "Coulomb friction": COULOMB, "offset": OFFSET}
PLAIN, DRY = "without Coulomb friction", "with Coulomb friction"
_FIRST, _LENGTH, _EVERY, _RUNS = 10, 414, 2, 3
"""Samples left out at either end, those of a run, of which each so many-th is taken, and so many-th run."""
_PERIOD, _SLOWEST, _FASTEST = 1e-3, 0.02, 0.12
"""Time in s for which a force is held, and the speeds in m/s between which a line is put through the friction."""


def declare(is_dry: bool) -> Machine:
    """Return the machine, with Coulomb friction in its model or without."""
    # The runs are cut from one recording of one machine: what does not change between them has no scatter.
    parameters = (Parameter("mass", "kg", value=95.0, within=0.1, scatter=0.0),
                  Parameter("viscous friction", "N s/m", value=203.0, within=0.5, scatter=0.0),
                  Parameter("offset", "N", value=0.0, scale=1.0, within=5.0, scatter=0.0),
                  Parameter("start", "m", first_of="position", scale=1e-4, scatter=1.0, within=1.0),  # moved in 1 ms
                  Parameter("start velocity", "m/s", value=0.0, scale=0.1, scatter=1.0, within=1.0),
                  Parameter("Coulomb friction", "N", value=20.0, within=0.5, scatter=0.0))
    drive = Block(
        "drive", "position", ("force",), ("position", "velocity"), parameters if is_dry else parameters[:-1],
        switches=("velocity",), derived={"speed": lambda x, u, p: np.abs(x.velocity)},
        # The position is known to 1e-7 m, so that without a disturbance each change of 0.01 N would be significant.
        # It is at most what the published model leaves, 4 to 7 % of the force.
        # The force reaches friction only through the motion, and changes no mass; what follows it late is the motor.
        quantities=(Quantity("friction force", "N", size=20.0, disturbance=3.0, without=("force", "past force")),
                    Quantity("motor force", relative=True),
                    Quantity("moving mass", relative=True, without=("force", "past force"))))

    @drive.rate
    def _(x, u, q, p):  # type: ignore[no-untyped-def]
        dry = p.Coulomb_friction * x.velocity_side if is_dry else 0.0
        friction = p.viscous_friction * x.velocity + p.offset + dry + q.friction_force
        return x.velocity, (u.force * (1 + q.motor_force) - friction) / (p.mass * (1 + q.moving_mass))

    drive.start(lambda u, q, p: (p.start, p.start_velocity))
    return Machine("positioning system", (drive,), (Sensor("position", "m"),), commands=(Command("force", "N"),))


def read(folder: Path) -> dict[str, Recorded]:
    """Return the runs of both recordings, for the machine without Coulomb friction and with it."""
    pieces = list[tuple[np.ndarray, np.ndarray, float]]()
    for number, name in enumerate(("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")):
        content = scipy.io.loadmat(folder / name)
        position, force = content["qm"].ravel(), content["vir"].ravel() * float(content["gtau"].item())
        pieces += [(position[begin:begin + _LENGTH:_EVERY], force[begin:begin + _LENGTH + 1], float(number))
                   for begin in range(_FIRST, len(position) - _FIRST - _LENGTH, _LENGTH)]
    positions, held, recordings = (np.array(values) for values in zip(*pieces[::_RUNS], strict=True))
    instants = _PERIOD * np.arange(_LENGTH + 1)
    # A force that is held is on average late by half of the time for which it is held.
    forces = Profile(np.tile(instants + 0.5 * _PERIOD, (len(held), 1)), held)
    runs = Runs(instants[:-1:_EVERY], {"position": positions}, {"force": forces},
                channels={"recording": recordings}, order=np.arange(len(held), dtype=float))
    return {variant: prepare(declare(variant == DRY), runs) for variant in (PLAIN, DRY)}


def sum_friction(answer: Identification) -> Band:
    """Return all that the model has against the motion, with the law, in N over m/s."""
    [fit], velocity = answer.fits, np.linspace(-_FASTEST, _FASTEST, 96)
    return Band("measured", velocity, *sum_terms(fit, ("friction force", "velocity"), velocity, {
        "viscous friction": velocity, "Coulomb friction": np.sign(velocity), "offset": np.ones(len(velocity))}))


def compare(variant: str, answer: Identification) -> Iterator[Row]:
    """Yield parameters beside published ones, and those of lines through all of the friction in either direction."""
    [fit] = answer.fits
    yield from compare_parameters(fit, KNOWN)
    yield Row("disturbance", fit.recorded.parts[0].disturbances["friction_force"].std, None, "N")
    friction = sum_friction(answer)
    out, back = (np.polyfit(friction.x[fast], friction.value[fast], 1)
                 for fast in (side * friction.x > _SLOWEST for side in (1, -1)))
    slope, level = (out + back) / 2
    for words, value, (unit, published) in (
            ("slope of all friction, out", out[0], VISCOUS), ("slope, back", back[0], VISCOUS),
            ("slope, mean of both", slope, VISCOUS), ("half of the jump at rest", (out[1] - back[1]) / 2, COULOMB),
            ("mean of both at rest", level, OFFSET)):
        yield Row(words, float(value), None, unit, published)
    for place in (-0.1, -0.02, 0.02, 0.1):
        value, error = (float(np.interp(place, friction.x, values)) for values in (friction.value, friction.std))
        yield Row(f"friction at {place:g} m/s", value, error, "N", float(_publish(np.array(place))))


def _publish(velocity: np.ndarray) -> np.ndarray:
    return np.asarray(VISCOUS[1] * velocity + COULOMB[1] * np.sign(velocity) + OFFSET[1])


def draw(answers: Mapping[str, Identification]) -> bytes:
    """Return the picture of the measured friction beside the published one."""
    band = sum_friction(answers[PLAIN])
    return draw_panels("Friction of a positioning system", "line: measured, without Coulomb friction in the model, "
                       "with its 95 % band; dashed: published", Panel("velocity, m/s", "friction force, N", [band],
                                                                 [Band("published", band.x, _publish(band.x))]))
