"""A pneumatic piston with seals of several kinds, moved back and forth at constant pressure (Zillen, TU Delft, 2021).

Position, pressure and force at about 100 Hz with jitter, from https://github.com/EvaZillen/3D-printed-pneumatic-actuator:
`SEAL_NUMBERbar.csv.gz`, ten strokes out and back of 40 mm each. The plain model is the pressure times the area of the
bore; it lacks the friction of the seal, of which half of the loop of the force is known without any law.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from evidence.real import Row, compare_parameters
from evidence.real.picture import Band, Panel, draw_panels
from evidence.real.signals import average, cut
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

SEALS = ("NAPN", "KDN", "NAP310", "O-ring", "O-ring257", "PK", "X-ring257", "Kidney", "Kidney_lc", "Stadium",
         "Stadium_lc")
"""Kinds of seals with recordings at three pressures or more; those with '257' have a wider bore."""
_STEP, _SAMPLES, _FIRST, _LONGEST, _SLOWEST = 0.1, 60, 1.5, 0.5, 3.0
"""Time in s of a mean, and means in a run; time before the piston moves; longest pause; least speed in mm/s."""
DRAWN = "NAPN", "KDN", "NAP310", "O-ring", "X-ring257"


def declare(radius: float) -> Machine:
    """Return a piston with a bore of a radius in mm."""
    cylinder = Block(
        "cylinder", gives="force", reads=("pressure", "velocity", "position"),
        # 1 bar on 1 mm^2 is 0.1 N. It is one piston: the area has no scatter; the zero of the load cell drifts.
        parameters=(Parameter("area", "N/bar", value=0.1 * np.pi * radius**2, within=0.05, scatter=0.0),
                    Parameter("offset", "N", value=0.0, scale=1.0, within=5.0, scatter=0.5)),
        # Friction is a part of the force, and no function of it. An area is geometry, which motion does not change.
        quantities=(Quantity("friction force", "N", size=5.0, without=("force",)),
                    Quantity("friction by pressure", "N/bar", size=1.0, without=("force",)),
                    Quantity("effective area", relative=True, without=("force", "velocity", "past velocity"))))

    @cylinder.output
    def _(x, u, q, p):  # type: ignore[no-untyped-def]
        area = p.area * (1 + q.effective_area) + q.friction_by_pressure
        return area * u.pressure + p.offset + q.friction_force

    # Load cell and pressure sensor feel neither the motion nor each other; another gain of either is another area.
    without = "force", "pressure", "velocity", "position"
    return Machine("pneumatic piston", (cylinder,), (Sensor("force", "N", without), Sensor("pressure", "bar", without)),
                   (Command("velocity", "mm/s"), Command("position", "mm")))


def read(folder: Path) -> dict[str, Recorded]:
    """Return the runs of each seal."""
    files = {seal: sorted(folder.glob(f"{seal}_[0-9]bar.csv.gz")) for seal in SEALS}
    return {seal: prepare(declare(_find_radius(seal)), read_runs(paths)) for seal, paths in files.items() if paths}


def _find_radius(seal: str) -> float:
    return 12.85 if "257" in seal else 12.5


def read_runs(files: list[Path]) -> Runs:
    """Return means over even times, in runs of equal length, of recordings at several pressures."""
    pieces, levels, order = list[np.ndarray](), list[float](), list[float]()
    for path in files:
        content = np.loadtxt(path, delimiter=",", skiprows=1)
        time = 1e-3 * content[:, 0]
        begins = np.arange(_FIRST, time[-1], _STEP)[:-1]
        means = average(time, content[:, 1:], begins, _STEP).T
        values = np.vstack([means, np.gradient(means[0], _STEP)])
        for rows in cut(time, begins, _STEP, _SAMPLES, _LONGEST):
            pieces.append(values[:, rows])
            levels.append(float(path.name.removesuffix("bar.csv.gz").rpartition("_")[2]))
            order.append(rows.start / _SAMPLES)
    position, pressure, force, velocity = np.array(pieces).transpose(1, 0, 2)
    instants = np.tile(_STEP * np.arange(_SAMPLES), (len(pieces), 1))
    return Runs(instants[0], {"force": force, "pressure": pressure},
                {"velocity": Profile(instants, velocity), "position": Profile(instants, position)},
                channels={"set pressure": np.array(levels)}, order=np.array(order))


def measure_loops(runs: Runs) -> dict[float, float]:
    """Return half of the loop of the force in N, less what the pressure does to it, by the pressure in bar."""
    velocity, levels, loops = runs.commands["velocity"].value, runs.channels["set pressure"], dict[float, float]()
    for level in np.unique(levels):
        moving = [(levels == level)[:, None] & (side * velocity > _SLOWEST) for side in (1, -1)]
        force, pressure = ([runs.signals[name][rows].mean() for rows in moving] for name in ("force", "pressure"))
        loops[float(level)] = float(force[0] - force[1] - force[0] / pressure[0] * (pressure[0] - pressure[1])) / 2
    return loops


def measure_explained(answer: Identification) -> dict[float, float]:
    """Return half of the loop of the force that the model gives with all laws."""
    [fit] = answer.fits
    runs, force = fit.recorded.runs, fit.models["cylinder"].predicted[:, 0]
    return measure_loops(replace(runs, signals={**runs.signals, "force": force}))


def compare(variant: str, answer: Identification) -> Iterator[Row]:
    """Yield the area beside that of the bore, and the friction that all laws give beside that of the recordings."""
    yield from compare_parameters(answer.fits[0], {"area": ("N/bar", 0.1 * np.pi * _find_radius(variant) ** 2)})
    known = measure_loops(answer.fits[0].recorded.runs)
    for level, value in measure_explained(answer).items():
        yield Row(f"friction at {level:g} bar", value, None, "N", known[level])


def draw(answers: Mapping[str, Identification]) -> bytes:
    """Return the picture of the friction over the pressure."""
    explained, known = list[Band](), list[Band]()
    for seal in (name for name in DRAWN if name in answers):
        for bands, loops in ((explained, measure_explained(answers[seal])),
                             (known, measure_loops(answers[seal].fits[0].recorded.runs))):
            bands.append(Band(seal, np.array([*loops]), np.array([*loops.values()])))
    return draw_panels("Friction of seals of a piston", "lines: the plain model with the laws that are named; dashed: "
                       "half of the loop of the recorded force",
                       Panel("pressure, bar", "friction, N", explained, known))
