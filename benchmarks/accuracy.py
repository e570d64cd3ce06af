"""How accurate shifting times are, on all benches of the tests, beside the simulator with far smaller steps.

    python -m benchmarks.accuracy

Each bench has its conditions at five by five values of pressure bias and initial position. One minute; writes
accuracy.csv.
"""

import numpy as np

from benchmarks.benches import BENCHES
from benchmarks.results import write
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

AXES = ("pressure_bias", "initial_position")
POINTS = np.stack(np.meshgrid(*[np.linspace(0.7, 1.3, 5)] * 2), axis=-1).reshape(-1, 2)
HEADER = ("bench", "accuracy", "engagements", "median error [s]", "90 % [s]", "99 % [s]", "largest [s]", "other status")
FINEST = ensemble.Accuracy(2e-5, 2e-4)


def main() -> None:
    """Compute and write the table."""
    rows: list[tuple[object, ...]] = []
    for name, bench in BENCHES.items():
        exact, status = ensemble.shifting_times(Model(bench.physics), bench.conditions, AXES, POINTS, FINEST)
        for accuracy, word in ((ensemble.DEFAULT, "default"), (ensemble.TIGHT, "tight")):
            times, its = ensemble.shifting_times(Model(bench.physics), bench.conditions, AXES, POINTS, accuracy)
            both = (its == ensemble.LOCKED) & (status == ensemble.LOCKED)
            error = np.abs(times - exact)[both]
            rows.append((name, word, both.size, *np.quantile(error, (0.5, 0.9, 0.99, 1.0)).tolist(),
                         int(np.sum(its != status))))
    write("accuracy", HEADER, rows, "python -m benchmarks.accuracy")


if __name__ == "__main__":
    main()
