"""Direct simulation, surrogate and table as the model of the same fit, for 2, 3, 5 and 7 uncertain parameters.

    python -m benchmarks.surrogate [PARAMETERS ...]

The shipped recordings, about the model that least squares calibrates on them. All three are the same function up to
their error: beyond the box, in which every engagement locks, each has its edge. A surrogate whose error exceeds a
tenth of the output std that it leads to is followed by one about its fit, on which that is refined. Whatever a fit ran
on, the likelihood of its solution is also taken by direct simulation. Surrogates as `python -m worker surrogate` makes
them by default; fits with default settings but for the intervals.
"""

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product as every
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.results import write
from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.calibration import calibrate
from slipstick.clutch.ensemble import Simulator, shifting_times
from slipstick.clutch.model import Model
from slipstick.inference import table_problem
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.table import Axis, Grid, HeldOut
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.refine import refined_vector
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem, converged
from worker.surrogate import HELD_OUT, RUNS, build

NESTED = ("pressure_bias", "initial_position", "friction_coefficient", "current_delay", "temperature_gain",
          "current_bias", "current_gain")
"""The paper's two, then the others that it calls uncertain."""
HALF_WIDTHS = {2: 0.5, 3: 0.5, 5: 0.5, 7: 0.3}
"""Of the box about 1, by the number of parameters: with seven, a corner of a box of 0.35 does not lock."""
GRID = 50
REACH, NARROWEST = 6.0, 0.02  # stds by which the second box surrounds the fit, and its least half width
WIDEST, FARTHEST = 1 / 4, 1 / 3  # half widths of it that a refined std, and a step of the mean, may take
GOOD = 0.1  # error of a surrogate that needs no second one, in output stds
SETTINGS = FitSettings(intervals=False)
LEAST = SETTINGS.std_bounds[0][0]
HEADER = ("parameters", "unknowns", "model", "engagements simulated [1e6]", "build: wall [s]",
          "build: processor time [s]", "error [ms RMS]", "worst error [ms]", "fit: wall [s]", "fit: processor time [s]",
          "output std found [ms]", "log10 likelihood found", "the same by direct simulation")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Box:
    """Multipliers of the parameters `names` between `lower` and `upper` (d,)."""

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray

    def axes(self, model: Model, count: int = 2) -> tuple[Axis, ...]:
        """An axis of `count` even multipliers for each parameter."""
        places = [parameters.index(name) for name in self.names]
        return tuple(Axis(name, np.linspace(low, high, count), model.parameters[at], parameters.PARAMETERS[at].unit)
                     for name, low, high, at in zip(self.names, self.lower, self.upper, places, strict=True))


class Counted:
    """The simulator in a box, and how many engagements it was asked for."""

    def __init__(self, model: Model, box: Box) -> None:
        self.simulator, self.box, self.engagements = Simulator(model, box.names), box, 0

    def __call__(self, points: np.ndarray, conditions: Conditions, /) -> np.ndarray:
        self.engagements += len(points) * len(conditions)
        return self.simulator(np.clip(points, self.box.lower, self.box.upper), conditions)


@dataclass
class Spent:
    """Wall and processor time in s, in all that `on` was given to do."""

    wall: float = 0.0
    processor: float = 0.0

    def on(self, work: Callable[[], Result]) -> Result:
        """Do the work and count it."""
        wall, processor = time.perf_counter(), time.process_time()
        result = work()
        self.wall += time.perf_counter() - wall
        self.processor += time.process_time() - processor
        return result


def main() -> None:
    """Measure and write."""
    recordings, rows = Library(Path("tables")).recording("measured"), []
    model = calibrate(recordings).model
    chosen = sys.argv[1:] or [str(count) for count in HALF_WIDTHS]
    for count in map(int, chosen):
        half = np.full(count, HALF_WIDTHS[count])
        for row in compared(model, recordings, Box(NESTED[:count], 1 - half, 1 + half)):
            rows.append(row)
        made_by = " ".join(["python -m benchmarks.surrogate", *sys.argv[1:]])
        write("surrogate", HEADER, sorted(rows, key=lambda row: row[0]), made_by)  # as far as it has come


def compared(model: Model, recordings: Recordings, box: Box) -> Iterator[list[object]]:
    """The rows of one number of parameters."""
    simulator = Counted(model, box)
    direct = InferenceProblem(simulator, recordings.conditions, recordings.measured_time, box.lower, box.upper, box.names)

    def row(kind: str, problem: InferenceProblem, found: np.ndarray, engagements: int, built: Spent | None,
            error: HeldOut | None, spent: Spent) -> list[object]:
        candidate = search_space(SETTINGS, direct).candidate(found)
        by_itself, directly = (float(converged(one, candidate)[0].sum()) for one in (problem, direct))
        return [len(box.names), len(found), kind, engagements / 1e6,
                *((built.wall, built.processor) if built else ("", "")),
                *((1e3 * error.overall_rms, 1e3 * float(error.worst.max())) if error else ("", "")),
                spent.wall, spent.processor, 1e3 * candidate.output_std, f"{by_itself:.3f}", f"{directly:.3f}"]

    spent = Spent()
    found = spent.on(lambda: fitted(direct))
    yield row("direct simulation", direct, found, simulator.engagements, None, None, spent)
    if len(box.names) == 2:
        built, spent = Spent(), Spent()
        table = built.on(lambda: gridded(model, recordings.conditions, box))
        by_table = table_problem(table, recordings, "clip")
        found = spent.on(lambda: fitted(by_table))
        yield row(f"table of {GRID} x {GRID}", by_table, found, table.times.size, built, None, spent)
    built, spent, engagements = Spent(), Spent(), (RUNS + HELD_OUT) * len(recordings)
    surrogate = built.on(lambda: build(model, recordings.conditions, box.axes(model)))
    by_surrogate = table_problem(surrogate, recordings, "clip")
    found = spent.on(lambda: fitted(by_surrogate))
    yield row("surrogate", by_surrogate, found, engagements, built, surrogate.error, spent)
    candidate = search_space(SETTINGS, direct).candidate(found)
    if surrogate.error.overall_rms > GOOD * candidate.output_std:
        half = np.maximum(REACH * candidate.inputs.marginal_std, NARROWEST)
        near = Box(box.names, np.maximum(box.lower, candidate.inputs.mean - half),
                   np.minimum(box.upper, candidate.inputs.mean + half))
        second = built.on(lambda: build(model, recordings.conditions, near.axes(model)))
        by_second = table_problem(second, recordings, "clip")
        # Runs beyond the box are clipped, which flatters: neither mean nor std may send many there.
        means, steps = candidate.inputs.mean, FARTHEST * half
        settings = replace(SETTINGS, std_bounds=tuple((LEAST, WIDEST * width) for width in half),
                           mean_bounds=tuple(zip(means - steps, means + steps, strict=True)))
        found = spent.on(lambda: refined_vector(by_second, search_space(settings, by_second), found))
        yield row("surrogate, then one about its fit", by_second, found, 2 * engagements, built, second.error, spent)


def fitted(problem: InferenceProblem) -> np.ndarray:
    """The unknowns that a fit finds."""
    return np.array(fit.refined_estimate(SETTINGS, problem, fit.final_state(SETTINGS, problem))["vector"])


def gridded(model: Model, conditions: Conditions, box: Box) -> Grid:
    """The table of the paper's size over the box."""
    axes = box.axes(model, GRID)
    points = np.array(list(every(*(axis.values for axis in axes))))
    times, status = shifting_times(model, conditions, box.names, points)
    shape = (*(len(axis.values) for axis in axes), len(conditions))
    return Grid(axes, times.reshape(shape), status.reshape(shape), conditions, model)


if __name__ == "__main__":
    main()
