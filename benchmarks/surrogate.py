"""The same fit with direct simulation, a surrogate or a table as the model, for 2, 3, 5 and 7 uncertain parameters.

    python -m benchmarks.surrogate [PARAMETERS ...]

The data are the shipped recordings, and the nominal model is calibrated on them by least squares. All three models
approximate the same function on the same box, in which every engagement locks, and clip points outside it. If the error
of a surrogate exceeds a tenth of the fitted output std, a second surrogate is built around the fit, and the fit is
refined on it. For every fit, the likelihood of its solution is also computed by direct simulation. Surrogates have the
defaults of `python -m worker surrogate`; fits have default settings, without intervals.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.benches import HEAVY
from benchmarks.results import write
from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.building import train_on_clutch
from slipstick.building.surrogates import HELD_OUT, RUNS, Training
from slipstick.calibration import calibrate
from slipstick.clutch.ensemble import Simulator, shifting_times
from slipstick.clutch.model import Model
from slipstick.inference.problems import table_problem
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.table import Axis, Grid, HeldOut, Surrogate
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.refine import refined_vector
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem, converged

NESTED = ("pressure_bias", "initial_position", "friction_coefficient", "current_delay", "temperature_gain",
          "current_bias", "current_gain")
"""The two uncertain parameters of the paper's fit, then the other parameters that the paper calls uncertain."""
HALF_WIDTHS = {2: 0.5, 3: 0.5, 5: 0.5, 7: 0.3}
"""Half widths of the box around 1, by the number of parameters; for seven, a corner of a box of 0.35 does not lock."""
GRID = 50
REACH, NARROWEST = 6.0, 0.02  # half width of the second box in fitted stds, and its lower limit
WIDEST, FARTHEST = 1 / 4, 1 / 3  # largest refined std and largest change of a mean, in half widths of the second box
GOOD = 0.1  # largest error of a surrogate without a second one, in output stds
SETTINGS = FitSettings(intervals=False)
SMALLEST_STD = SETTINGS.std_bounds[0][0]
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
        indices = [parameters.index(name) for name in self.names]
        return tuple(Axis(name, np.linspace(low, high, count), model.parameters[index],
                          parameters.PARAMETERS[index].unit)
                     for name, low, high, index in zip(self.names, self.lower, self.upper, indices, strict=True))


class Counted:
    """The simulator in a box, with a count of the simulated engagements."""

    def __init__(self, model: Model, box: Box) -> None:
        self.simulator, self.box, self.engagements = Simulator(model, box.names), box, 0

    def __call__(self, points: np.ndarray, conditions: Conditions, /) -> np.ndarray:
        self.engagements += len(points) * len(conditions)
        return self.simulator(np.clip(points, self.box.lower, self.box.upper), conditions)


@dataclass
class Spent:
    """Total wall and processor time in s of all calls of `on`."""

    wall: float = 0.0
    processor: float = 0.0

    def on(self, work: Callable[[], Result]) -> Result:
        """Call `work`, add its times, and return its result."""
        wall, processor = time.perf_counter(), time.process_time()
        result = work()
        self.wall += time.perf_counter() - wall
        self.processor += time.process_time() - processor
        return result


def _train(model: Model, conditions: Conditions, box: Box) -> Surrogate:
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        return train_on_clutch(model, conditions, box.axes(model), Training(), executor)


def main() -> None:
    """Run the benchmark and write the table."""
    recordings, rows = Library(Path("tables")).recording("measured"), []
    model = calibrate(recordings, HEAVY).model
    for count in map(int, sys.argv[1:] or HALF_WIDTHS):
        half = np.full(count, HALF_WIDTHS[count])
        for row in compare_models(model, recordings, Box(NESTED[:count], 1 - half, 1 + half)):
            rows.append(row)
        made_by = " ".join(["python -m benchmarks.surrogate", *sys.argv[1:]])
        write("surrogate", HEADER, sorted(rows, key=lambda row: row[0]), made_by)  # intermediate results, too


def compare_models(model: Model, recordings: Recordings, box: Box) -> Iterator[list[object]]:
    """The rows of one number of parameters."""
    simulator = Counted(model, box)
    direct = InferenceProblem(simulator, recordings.conditions, recordings.measured_time, box.lower, box.upper,
                              box.names)

    def row(kind: str, problem: InferenceProblem, optimum: np.ndarray, engagements: int, built: Spent | None,
            error: HeldOut | None, spent: Spent) -> list[object]:
        candidate = search_space(SETTINGS, direct).candidate(optimum)
        by_model, by_simulator = (float(converged(each, candidate)[0].sum()) for each in (problem, direct))
        return [len(box.names), len(optimum), kind, engagements / 1e6,
                *((built.wall, built.processor) if built else ("", "")),
                *((1e3 * error.overall_rms, 1e3 * float(error.worst.max())) if error else ("", "")),
                spent.wall, spent.processor, 1e3 * candidate.output_std, f"{by_model:.3f}", f"{by_simulator:.3f}"]

    spent = Spent()
    optimum = spent.on(lambda: find_optimum(direct))
    yield row("direct simulation", direct, optimum, simulator.engagements, None, None, spent)
    if len(box.names) == 2:
        built, spent = Spent(), Spent()
        table = built.on(lambda: build_grid(model, recordings.conditions, box))
        by_table = table_problem(table, recordings, "clip")
        optimum = spent.on(lambda: find_optimum(by_table))
        yield row(f"table of {GRID} x {GRID}", by_table, optimum, table.times.size, built, None, spent)
    built, spent, engagements = Spent(), Spent(), (RUNS + HELD_OUT) * len(recordings)
    surrogate = built.on(lambda: _train(model, recordings.conditions, box))
    by_surrogate = table_problem(surrogate, recordings, "clip")
    optimum = spent.on(lambda: find_optimum(by_surrogate))
    yield row("surrogate", by_surrogate, optimum, engagements, built, surrogate.error, spent)
    candidate = search_space(SETTINGS, direct).candidate(optimum)
    if surrogate.error.overall_rms > GOOD * candidate.output_std:
        half = np.maximum(REACH * candidate.inputs.marginal_std, NARROWEST)
        second_box = Box(box.names, np.maximum(box.lower, candidate.inputs.mean - half),
                         np.minimum(box.upper, candidate.inputs.mean + half))
        second = built.on(lambda: _train(model, recordings.conditions, second_box))
        by_second = table_problem(second, recordings, "clip")
        # The bounds keep most runs inside the box: clipped runs would raise the likelihood spuriously.
        means, steps = candidate.inputs.mean, FARTHEST * half
        settings = replace(SETTINGS, std_bounds=tuple((SMALLEST_STD, WIDEST * width) for width in half),
                           mean_bounds=tuple(zip(means - steps, means + steps, strict=True)))
        optimum = spent.on(lambda: refined_vector(by_second, search_space(settings, by_second), optimum))
        yield row("surrogate, then one about its fit", by_second, optimum, 2 * engagements, built, second.error, spent)


def find_optimum(problem: InferenceProblem) -> np.ndarray:
    """The vector of unknowns (k,) of a fit."""
    return np.array(fit.refined_estimate(SETTINGS, problem, fit.final_state(SETTINGS, problem))["vector"])


def build_grid(model: Model, conditions: Conditions, box: Box) -> Grid:
    """A table over the box, with the number of grid points of the paper."""
    axes = box.axes(model, GRID)
    points = np.array(list(product(*(axis.values for axis in axes))))
    times, status = shifting_times(model, conditions, box.names, points)
    shape = (*(len(axis.values) for axis in axes), len(conditions))
    return Grid(axes, times.reshape(shape), status.reshape(shape), conditions, model)


if __name__ == "__main__":
    main()
