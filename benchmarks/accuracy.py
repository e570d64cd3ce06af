"""How accurate shifting times are, beside the simulator with far smaller steps.

    python -m benchmarks.accuracy [BENCH.toml ...]

Each bench has its conditions at five by five values of pressure bias and initial position. The table has the shipped
benches, and the worst of the further ones that are given; each figure of that row may be of another bench. A minute for
30 benches.
"""

import sys

import numpy as np

from benchmarks.benches import AXES, SHIPPED
from benchmarks.results import write
from slipstick.bench import Bench
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

POINTS = np.stack(np.meshgrid(*[np.linspace(0.7, 1.3, 5)] * 2), axis=-1).reshape(-1, 2)
HEADER = ("bench", "accuracy", "engagements", "median error [s]", "90 % [s]", "99 % [s]", "largest [s]", "other status")
LEVELS = (0.5, 0.9, 0.99, 1.0)
ACCURACIES = {"default": ensemble.DEFAULT, "tight": ensemble.TIGHT}
FINEST = ensemble.Accuracy(2e-5, 2e-4)


def measure_errors(bench: Bench) -> dict[str, list[float]]:
    """The row of a bench from the third column on, for each accuracy."""
    model = Model(bench.physics)
    exact, exact_status = ensemble.shifting_times(model, bench.conditions, AXES, POINTS, FINEST)
    figures = {}
    for word, accuracy in ACCURACIES.items():
        times, status = ensemble.shifting_times(model, bench.conditions, AXES, POINTS, accuracy)
        locked = (status == ensemble.LOCKED) & (exact_status == ensemble.LOCKED)
        errors = np.quantile(np.abs(times - exact)[locked], LEVELS).tolist()
        figures[word] = [locked.size, *errors, int(np.sum(status != exact_status))]
    return figures


def main() -> None:
    """Measure, and write the table."""
    files = sys.argv[1:]
    shipped = {name: measure_errors(bench) for name, bench in SHIPPED.items()}
    rows = [(name, word, *figures[word]) for name, figures in shipped.items() for word in ACCURACIES]
    further = [measure_errors(Bench.open(path)) for path in files]
    for word in ACCURACIES if further else ():
        sizes, *errors, others = zip(*(figures[word] for figures in further), strict=True)
        rows.append((f"worst of {len(files)} further benches", word, sum(sizes), *map(max, errors), sum(others)))
    write("accuracy", HEADER, rows, "python -m benchmarks.accuracy" + f" ({len(files)} files)" * bool(files))


if __name__ == "__main__":
    main()
