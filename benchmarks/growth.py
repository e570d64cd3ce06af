"""How times grow: with cores, conditions, grid, expansion order, population of a fit, and recordings.

    python -m benchmarks.growth [NAME ...]

It writes growth.csv and a picture of it, growth.svg (a minute); by default of all. A slope is that of a
straight line fitted to the logarithms of all times: 1 is proportional, 0 constant. Times are processor times of one
thread, the least of `ROUNDS`, except for those against cores, which are elapsed times and need an otherwise idle
machine.
"""

import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.benches import AXES, HEAVY, make_grid
from benchmarks.likelihood import CASES, FITTED
from benchmarks.results import write
from benchmarks.works import EXPANDED, default_table
from slipstick.clutch.ensemble import shifting_times
from slipstick.clutch.model import Model
from slipstick.inference.problems import table_problem
from slipstick.pictures import theme
from slipstick.pictures.rendering import render
from slipstick.recordings import Recordings
from slipstick.table import Grid
from slipstick.uncertainty.chaos import ExpansionSettings, expand, make_basis
from slipstick.uncertainty.fit import FitSettings, final_state
from slipstick.uncertainty.likelihood import converged

ROUNDS = 3
HEADER = ("work", "against", "size", "time [ms]", "slope of the logarithms")
PICTURE = Path(__file__).with_name("growth.svg")
_SAMPLES = 10_000
Clock = Callable[[], float]


@dataclass(frozen=True)
class Growth:
    """Work of each of some `sizes`; `name` selects it, `against` what the sizes count."""

    name: str
    work: str
    against: str
    sizes: tuple[int, ...]
    run: Callable[[int], object]
    clock: Clock = time.process_time

    def times(self) -> np.ndarray:
        """Least times in s, one per size; the sizes alternate."""
        least = np.full(len(self.sizes), np.inf)
        for _ in range(ROUNDS + 1):  # the first of which compiles and fills caches
            for place, size in enumerate(self.sizes):
                begin = self.clock()
                self.run(size)
                least[place] = min(least[place], self.clock() - begin)
        return least


def growths() -> Iterator[Growth]:
    """All that is measured."""
    model, conditions, table = Model(HEAVY.physics), HEAVY.conditions, default_table()
    recordings, candidate = Recordings.open(PICTURE.parents[1] / "tables" / "measured.h5"), CASES[FITTED]
    germs = np.random.default_rng(1).standard_normal((_SAMPLES, 2))

    def simulate(nodes: int, count: int, threads: int) -> object:
        return shifting_times(model, conditions.take(range(count)), AXES, make_grid(nodes), threads=threads)

    cores = tuple(range(1, min(os.cpu_count() or 1, 8) + 1))
    yield Growth("cores", "400 grid points x 216 conditions", "cores", cores, lambda size: simulate(20, 216, size),
                 time.perf_counter)
    yield Growth("conditions", "400 grid points", "conditions", (27, 54, 108, 216),
                 lambda size: simulate(20, size, 1))
    yield Growth("grid", "grid of size x size points, 216 conditions", "points per axis", (5, 10, 20, 40),
                 lambda size: simulate(size, 216, 1))
    yield Growth("order", "expansion, and 10,000 x 216 values of it", "order", (2, 4, 8, 16),
                 lambda size: expand_table(table, size, germs))
    yield Growth("population", "search of 5 generations, 216 recordings", "population", (10, 20, 40, 80),
                 lambda size: search_optimum(table, recordings, size))
    problems = {size: table_problem(table, first(recordings, size), "clip") for size in (27, 54, 108, 216)}
    yield Growth("recordings", "log10 likelihood of one candidate", "recordings", tuple(problems),
                 lambda size: converged(problems[size], candidate))


def expand_table(table: Grid, order: int, germs: np.ndarray) -> object:
    basis = make_basis(EXPANDED.germs, ExpansionSettings(order=order))
    return expand(basis, table.interpolate(EXPANDED.at_germs(basis.nodes))).at(germs)


def search_optimum(table: Grid, recordings: Recordings, population: int) -> object:
    settings = FitSettings(population=population, generations=5, patience=5, tolerance=0.0, refine=False,
                           intervals=False)
    return final_state(settings, table_problem(table, recordings, "clip"))


def first(recordings: Recordings, count: int) -> Recordings:
    taken = recordings.take(np.arange(count))
    order = np.argsort(np.argsort(taken.conditions.run_order))
    return replace(taken, conditions=replace(taken.conditions, run_order=order))


def plot(rows: Sequence[Sequence[object]]) -> bytes:
    """Plot the times of each work and the straight line through them, both axes logarithmic, as SVG."""
    works = dict.fromkeys((str(row[0]), str(row[1])) for row in rows)
    return render(theme.picture("Times over the size of the work", "both axes are logarithmic", {
        "columns": 3, "concat": [_plot_work(work, against, [row for row in rows if row[:2] == (work, against)])
                                 for work, against in works]}), "svg")


def _plot_work(work: str, against: str, rows: Sequence[Sequence[object]]) -> theme.Spec:
    sizes, times = (np.array([float(str(row[column])) for row in rows]) for column in (2, 3))
    slope = float(str(rows[0][4]))
    line = np.exp(np.mean(np.log(times)) + slope * (np.log(sizes) - np.mean(np.log(sizes))))
    values = [{"size": size, "time": time, "line": fitted}
              for size, time, fitted in zip(sizes.tolist(), times.tolist(), line.tolist(), strict=True)]
    across = {"field": "size", "type": "quantitative", "title": against,
              "scale": {"type": "log", "nice": False, "padding": 20},
              "axis": {"grid": False, "values": sizes.tolist(), "format": "d"}}

    def up(field: str) -> theme.Spec:
        return {"field": field, "type": "quantitative", "title": "time [ms]", "scale": {"type": "log", "nice": True}}

    return {"title": {"text": [work, f"power {slope:.2f}"], "fontSize": 10}, "width": theme.WIDTH // 4, "height": 140,
            "data": {"values": values}, "layer": [
                {"mark": {"type": "line", "color": theme.FAINT}, "encoding": {"x": across, "y": up("line")}},
                {"mark": {"type": "point", "filled": True, "color": theme.AFTER, "size": 60, "opacity": 1},
                 "encoding": {"x": across, "y": up("time")}}]}


def main() -> None:
    """Measure, write the table and draw the picture."""
    names, rows = sys.argv[1:], list[tuple[object, ...]]()
    for growth in growths():
        if names and growth.name not in names:
            continue
        times = growth.times()
        slope = float(np.polyfit(np.log(growth.sizes), np.log(times), 1)[0]) if len(growth.sizes) > 1 else math.nan
        rows += [(growth.work, growth.against, size, 1e3 * seconds, f"{slope:.2f}")
                 for size, seconds in zip(growth.sizes, times.tolist(), strict=True)]
    PICTURE.write_bytes(plot(rows))
    write("growth", HEADER, rows, " ".join(["python -m benchmarks.growth", *names]))


if __name__ == "__main__":
    main()
