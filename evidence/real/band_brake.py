"""A band brake that is driven back and forth, dry (Coble, Huggins, Cao, Ricles and Downey, 2022).

Displacement, velocity, friction force and the forces in both ends of the band at 1024 Hz, in 43 tests with a sine, from
https://github.com/ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash. The model has the full friction from each
reversal on; published is a build-up over the travel since then. Of the band, one end holds and the other one is slack.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from evidence.real import Row
from evidence.real.measured import list_signals, state_mean, state_parameters
from evidence.real.picture import Band, Panel, draw_panels
from evidence.real.signals import average_strokes, find_delay, find_reversals
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification
from slipstick.machine import Block, Machine, Parameter, Quantity, Runs, Sensor

_EVERY, _PERIOD, _SAMPLES = 16, 1 / 64, 192
"""Samples of which the mean is taken, the period in s of the means, and their number in a run."""
_SIGNALS = {"displacement": 1, "force": 2, "velocity": 3, "band force 1": 4, "band force 2": 5}
_MOTION, _FORCES = ("displacement", "velocity", "force"), ("force", "band force 1", "band force 2")
_FEW = "dataset-2-0.25Hz0lbtension0.5amplitude", "dataset-2-0.25Hz0lbtension1amplitude"
BUILD_UP, FIRST, SECOND = "build-up", "band forces of dataset-1", "band forces of dataset-2"
_TESTS = {BUILD_UP: ("", (), _MOTION), FIRST: ("dataset-1", (), _FORCES), SECOND: ("dataset-2", (), _FORCES),
          f"{SECOND}, three of five faulty": ("dataset-2", _FEW, _FORCES)}
"""How the names of the tests of a variant begin, which are left out, and the signals. Of five tests with a wrong band
force, the longest two are: runs of the others are less than a tenth."""
_TRAVEL, _PUBLISHED, _SLOW, _POUNDS = np.linspace(0.0, 0.8, 81), 0.30, 0.05, 1000.0
"""Travel in in since a reversal, that with 80 % of the force, speed in in/s with less friction, lb in a kip."""

# The forces are what friction makes: it does not depend on them. The tension of the band is set anew for each test.
_friction = Block(
    "friction", gives="force", reads=("displacement", "velocity", "counted"),
    parameters=(Parameter("level", "kip", value=1.5, within=1.0, scatter=1.0),
                Parameter("middle", "kip", value=0.0, scale=0.5, within=1.0, scatter=1.0)),
    quantities=(Quantity("friction force", "kip", without=("force",)),
                Quantity("friction level", relative=True, without=("force",)),
                Quantity("share of the friction", relative=True, without=("force",))),
    window=lambda u: u.counted > 0)


@_friction.output
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    share = np.tanh(u.velocity / _SLOW) * (1 + q.friction_level) + q.share_of_the_friction
    return p.middle + p.level * share + q.friction_force


_band = Block(
    "band", gives=("band force 1", "band force 2"), reads=("force",),
    parameters=(Parameter("ratio", value=2.0, within=0.1, scatter=0.05), *(
        Parameter(f"slack {end}", "lb", value=10.0, scale=10.0, within=1.0, scatter=1.0) for end in (1, 2))),
    quantities=(Quantity("ratio of the arms", relative=True), Quantity("force in the band", "lb", size=100.0)),
    window=lambda u: (u.force < 0, u.force > 0))  # of the end that holds: a slack one tells nothing of the force


@_band.output
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    held = _POUNDS * u.force / (p.ratio * (1 + q.ratio_of_the_arms))
    return (p.slack_1 + np.maximum(-held, 0.0) + q.force_in_the_band,
            p.slack_2 + np.maximum(held, 0.0) + q.force_in_the_band)


MACHINE = Machine("band brake", (_friction, _band),
                  (Sensor("displacement", "in"), Sensor("velocity", "in/s"), Sensor("force", "kip"),
                   Sensor("band force 1", "lb"), Sensor("band force 2", "lb")), inputs=("counted",))


def read(folder: Path) -> dict[str, Recorded]:
    """Return the forces of all tests over the motion, and the band forces of both sets of tests over the forces."""
    return {variant: prepare(MACHINE, _cut(sorted(folder.glob(f"{first}*.csv.gz")), left_out, names))
            for variant, (first, left_out, names) in _TESTS.items()}


def _cut(paths: list[Path], left_out: tuple[str, ...], names: tuple[str, ...]) -> Runs:
    """Return runs from a reversal on: what follows on the next one counts, as the play of a backlash is known then."""
    runs, stated = list[np.ndarray](), list[tuple[float, ...]]()
    for number, path in enumerate(path for path in paths if not path.name.startswith(left_out)):
        content = np.loadtxt(path, delimiter=",", skiprows=1)
        means = content[:len(content) // _EVERY * _EVERY].reshape(-1, _EVERY, content.shape[1]).mean(axis=1)
        hertz, pounds = map(float, re.findall(r"([\d.]+)Hz([\d.]+)lb", path.name)[0])
        half, displacement = round(0.5 / _PERIOD / hertz), means[:, _SIGNALS["displacement"]]
        for begin in find_reversals(displacement, half, _SAMPLES):
            runs.append(means[begin:begin + _SAMPLES])
            stated.append((number, hertz, pounds, np.ptp(displacement) / 2, half))
    values, constants = np.array(runs), np.array(stated, dtype=float).T
    channels = dict(zip(("test", "frequency", "tension", "amplitude"), constants, strict=False))
    channels["counted"] = (np.arange(_SAMPLES) >= constants[-1][:, None]).astype(float)
    return Runs(_PERIOD * np.arange(_SAMPLES), {name: values[:, :, _SIGNALS[name]] for name in names}, {}, {}, channels)


def compare(variant: str, answer: Identification) -> Iterator[Row]:
    """Yield the travel in which the friction builds up, or how late and how wrong band forces are."""
    yield from state_parameters(answer)
    force = (runs := answer.fits[0].recorded.runs).signals["force"]
    for what, signals in list_signals(answer).items():
        if variant == BUILD_UP:
            travels = _TRAVEL[np.argmax(average_strokes(runs, signals[:, 0], _TRAVEL) > 0.8, axis=1)]
            yield state_mean(f"travel to 80 % of the force, {what}", travels, "in", _PUBLISHED)
            continue
        late = [find_delay(np.maximum(side * force, 0), signals[:, place], 8) for place, side in enumerate((-1, 1))]
        yield state_mean(f"bands behind the force, {what}", 1e3 * _PERIOD * np.array(late), "ms")
        held = signals[:, 1] - signals[:, 0]
        ratios = _POUNDS * (force * held).sum(axis=1) / (held**2).sum(axis=1)
        yield Row(f"smallest ratio of a run, {what}", float(ratios.min()))


def draw(answers: Mapping[str, Identification]) -> bytes:
    """Return the picture of the build-up, as recorded and as explained, beside what is published of it."""
    runs = answers[BUILD_UP].fits[0].recorded.runs
    bands = [Band.of_mean(what, _TRAVEL, 100 * average_strokes(runs, signals[:, 0], _TRAVEL))
             for what, signals in list_signals(answers[BUILD_UP]).items()]
    known = Band("published", np.array([0.0, _PUBLISHED, _PUBLISHED]), np.array([80.0, 80.0, -100.0]))
    return draw_panels("The friction of a band brake builds up after a reversal", "means of tests, with 95 % bands; "
                       "the plain model is at 100 % from the reversal on; dashed: 80 % after 0.30 in, as published",
                       Panel("travel since the reversal, in", "friction force, %", bands, [known]))
