"""A shaft at a controlled speed, on which a roller is pressed, or which a generator loads (Yeung and others, 2022).

Speed and motor effort at about 60 Hz with an irregular clock, from https://github.com/mrl-anomaly (RoSA). Motor, shaft
and controller are one block that the desired speed drives: in a closed loop, effort and speed explain each other by the
controller (Ljung, System Identification, 1999, chapter 13). The model lacks what presses on the shaft.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from evidence.real import Row
from evidence.real.measured import Expected, plot_law, state_law, state_parameters
from evidence.real.picture import draw_panels
from evidence.real.signals import average, cut
from slipstick.engine.laws import CONSTANT, GAIN, LAG, PAST
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

_PERIOD, _MEANS, _SAMPLES = 1 / 3.67, 4, 120
"""Period in s of an oscillation that all files have at any speed, over which running means are taken; how many of these
there are in it, and in a run: longer files are cut."""
_COLUMNS = {"desired speed": 1, "speed": 2, "effort": 3, "lateral force": 4, "damper resistance": 5, "temperature": 6}
_LATERAL = 0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0
_RESISTANCES = 15.0, 14.0, 13.0, 12.0, 11.0, 10.0, 9.0, 7.0, 6.0, 5.0, 3.0
_LAWS = {"force": Expected(("friction torque", "lateral force"), _LATERAL),
         "damper": Expected(("drag", "damper resistance"), _RESISTANCES, "w / (R + r)",
                            lambda resistance, w, r: w / (resistance + r), is_stepped=True)}
"""The law that each kind of disturbance should show, and where it is stated: at all resistances in ohm of the files."""

# What acts on the shaft knows neither of the controller nor of its effort, which is the answer to it. An encoder counts
# whatever turns it. The effort is a number that the controller computes: no sensor has an error in it.
_CONTROL = "desired speed", PAST + "desired speed", "effort", "integral"
_UNKNOWN = "effort", "integral", "lateral force", "damper resistance", "temperature"  # to the controller
_COMPUTED = *_COLUMNS, "integral", CONSTANT, GAIN, LAG, "time", "run order"
_loop = Block(
    "shaft", gives=("speed", "effort"), reads=("desired speed",), states=("speed", "integral"),
    parameters=(Parameter("inertia", "% s/rpm", value=0.004, within=1.0, scatter=0.0),
                Parameter("viscous friction", "%/rpm", value=0.06, within=0.5, scatter=0.2),
                Parameter("dry friction", "%", value=8.0, within=0.5, scatter=0.3),
                Parameter("proportional gain", "%/rpm", value=0.05, within=0.5, scatter=0.1),
                Parameter("integral gain", "%/(rpm s)", value=0.035, within=0.5, scatter=0.1),
                Parameter("first speed", "rpm", first_of="speed", scale=10.0, scatter=1.0, within=1.0),
                Parameter("first effort", "%", first_of="effort", scale=1.0, scatter=1.0, within=1.0)),
    quantities=(Quantity("friction torque", "%", size=3.0, without=_CONTROL),
                Quantity("motor torque", relative=True, without=_CONTROL),
                Quantity("drag", relative=True, without=_CONTROL),
                Quantity("moment of inertia", relative=True, without=_CONTROL),
                Quantity("effort beside the controller", "%", size=3.0, without=_UNKNOWN)))


@_loop.rate
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    lag = u.desired_speed - x.speed
    effort = p.proportional_gain * lag + x.integral + q.effort_beside_the_controller
    driving = effort * (1 + q.motor_torque) - p.dry_friction - q.friction_torque
    rising = (driving - p.viscous_friction * (1 + q.drag) * x.speed) / (p.inertia * (1 + q.moment_of_inertia))
    return rising, p.integral_gain * lag


_loop.start(lambda u, q, p: (p.first_speed, p.first_effort - p.proportional_gain * (u.desired_speed - p.first_speed)))


@_loop.output
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    return x.speed, p.proportional_gain * (u.desired_speed - x.speed) + x.integral + q.effort_beside_the_controller


_SENSORS = Sensor("speed", "rpm", without=_CONTROL), Sensor("effort", "%", without=_COMPUTED)
MACHINE = Machine("shaft", (_loop,), _SENSORS, commands=(Command("desired speed", "rpm"),))


def read(folder: Path) -> dict[str, Recorded]:
    """Return runs with a roller and with a generator, each with what is known of it and without, and healthy ones."""
    kinds = {kind: _cut([*folder.glob(f"{kind}-*.csv.gz")]) for kind in ("force", "damper", "healthy")}
    variants = dict[str, Runs]()
    for kind, law in _LAWS.items():
        variants |= {f"{kind}, with the {law.pair[1]}": _gather(kinds[kind], "temperature", law.pair[1]),
                     f"{kind}, without it": _gather(kinds[kind], "temperature")}
    for part, rows in enumerate(np.array_split(np.arange(len(kinds["healthy"])), 3), start=1):
        variants[f"healthy, part {part}"] = _gather([kinds["healthy"][row] for row in rows], "temperature")
    return {name: prepare(MACHINE, runs) for name, runs in variants.items()}


def _cut(paths: list[Path]) -> list[tuple[int, np.ndarray]]:
    """Return running means (k, columns), of pieces of recordings, with the number of the file."""
    pieces = list[tuple[int, np.ndarray]]()
    for number, path in sorted((int(path.name.removesuffix(".csv.gz").rpartition("-")[2]), path) for path in paths):
        content = np.genfromtxt(path, delimiter=",", skip_header=1)
        time = 1e-3 * (content[:, 0] - content[0, 0])
        begins = np.arange(0, time[-1] - _PERIOD, _PERIOD / _MEANS)
        means = average(time, content[:, 1:], begins, _PERIOD)
        pieces += [(number, means[rows]) for rows in cut(time, begins, _PERIOD, _SAMPLES, _PERIOD)
                   if means[rows, 0].min() > 0]  # the motor is switched on
    return pieces


def _gather(pieces: list[tuple[int, np.ndarray]], *channels: str) -> Runs:
    values = {name: np.array([piece[:, column - 1] for _, piece in pieces]) for name, column in _COLUMNS.items()}
    time = _PERIOD / _MEANS * np.arange(_SAMPLES)
    desired = Profile(np.tile(time, (len(pieces), 1)), values["desired speed"])
    return Runs(time, {name: values[name] for name in ("speed", "effort")}, {"desired speed": desired}, {},
                {name: values[name] for name in channels}, np.array([number for number, _ in pieces], dtype=float))


def compare(variant: str, answer: Identification) -> Iterator[Row]:
    """Yield parameters, and the laws over the channels beyond what they are without a disturbance."""
    yield from state_parameters(answer)
    for law in _LAWS.values():
        yield from state_law(law, answer.fits[0])


def draw(answers: Mapping[str, Identification]) -> bytes:
    """Return the picture of the laws over both channels, and of w / (R + r) with the closest w and r."""
    fits = {kind: answers[f"{kind}, with the {law.pair[1]}"].fits[0] for kind, law in _LAWS.items()}
    return draw_panels("What loads a shaft", "beyond no force and 15 ohm, with 95 % bands; dashed: w / (R + r)",
                       *(panel for kind, law in _LAWS.items() for panel in plot_law(law, fits[kind])))
