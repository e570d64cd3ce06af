"""Comparison of rules for expansions: errors on held-out runs of the simulator, as a function of the number of runs.

    python -m benchmarks.expansion      (a minute or two; writes sparse_rules.csv)

The inputs are normal with nominal means; all 216 conditions and 4096 held-out runs are used. The regression samples
from the density of the squared polynomials (slipstick/uncertainty/chaos/rules.py), with two or three samples per term.
The plain regression samples from the density of the inputs. The Smolyak rules are those of chaospy, on nested
Genz-Keister nodes or on Gauss nodes, and for each the order with the smallest error is selected afterwards.
"""

import sys
from collections.abc import Iterator
from typing import Any

import chaospy
import numpy as np

from benchmarks.benches import HEAVY
from benchmarks.results import write
from slipstick.clutch.ensemble import Simulator
from slipstick.clutch.model import Model
from slipstick.uncertainty import standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings, Germ, expand, make_basis
from slipstick.uncertainty.chaos.polynomials import Polynomials
from slipstick.uncertainty.chaos.truncation import degrees

AXES = ("pressure_bias", "initial_position", "friction_coefficient", "current_gain", "current_delay", "current_bias",
        "temperature_gain")
CASES = [(inputs, std) for inputs in (2, 3, 5, 7) for std in (0.05, 0.1)]
ORDERS = {2: (2, 4, 6, 8, 12), 3: (2, 3, 4, 5, 6), 5: (1, 2, 3, 4), 7: (1, 2, 3, 4)}
MOST_RUNS, HELD_OUT = 1300, 4096
SMOLYAK = {"genz_keister_16": "Smolyak, Genz-Keister", "gaussian": "Smolyak, Gauss"}
HERMITE = Germ("hermite")
CONDITIONS = HEAVY.conditions
HEADER = ("inputs", "std", "rule", "order", "terms", "runs", "median error [ms]", "95 % error [ms]", "conditions lost",
          "estimate / error: 5 %", "50 %", "95 %")


class Case:
    """The simulator as a function of normal germs, with held-out runs."""

    def __init__(self, inputs: int, std: float) -> None:
        self.germs, self.std = (HERMITE,) * inputs, std
        self.simulator = Simulator(Model(HEAVY.physics), AXES[:inputs])
        self.held_out = standard_normals(inputs, HELD_OUT, 99)
        self.truth = self.times(self.held_out)

    def times(self, germs: np.ndarray) -> np.ndarray:
        return self.simulator(1 + self.std * germs, CONDITIONS)

    def error(self, polynomials: Polynomials, coefficients: np.ndarray) -> np.ndarray:
        """RMS error over the held-out runs, (216,) s; NaN if a time at a node is NaN."""
        return np.sqrt(np.nanmean((polynomials.at(self.held_out) @ coefficients - self.truth) ** 2, axis=0))


def main() -> None:
    """Run the benchmark and write the table."""
    rows: list[list[object]] = []
    for inputs, std in CASES:
        case = Case(inputs, std)
        for rule, polynomials, runs, error, estimate in (*implemented(case), *plain(case), *smolyak(case)):
            finite = np.isfinite(error)
            ratios = np.full(3, np.nan) if estimate is None else (
                np.quantile((estimate / error)[finite], [0.05, 0.5, 0.95]))
            terms = polynomials.degrees
            rows.append([inputs, std, rule, terms.max(), len(terms), runs,
                         *(f"{1e3 * np.quantile(error[finite], level):.2g}" for level in (0.5, 0.95)),
                         np.count_nonzero(~finite), *("" if np.isnan(ratio) else f"{ratio:.2f}" for ratio in ratios)])
        print(f"{inputs} inputs, std {std}", file=sys.stderr)
    write("sparse_rules", HEADER, rows, "python -m benchmarks.expansion")


Row = tuple[str, Polynomials, int, np.ndarray, Any]


def implemented(case: Case) -> Iterator[Row]:
    """The rules of slipstick/uncertainty/chaos."""
    inputs = len(case.germs)
    for order in ORDERS[inputs]:
        samples = 3 * len(degrees(inputs, order))
        rules = {"tensor": ExpansionSettings(order, rule="tensor"),
                 "regression": ExpansionSettings(order, rule="regression"),
                 "regression, three samples a term": ExpansionSettings(order, rule="regression", samples=samples),
                 "regression, norm 0.75": ExpansionSettings(order, 0.75, rule="regression")}
        for name, settings in rules.items():
            if name == "tensor" and (order + 1) ** inputs > MOST_RUNS:
                continue
            basis = make_basis(case.germs, settings)
            expansion = expand(basis, case.times(basis.nodes))
            yield (name, basis.polynomials, len(basis.nodes), case.error(basis.polynomials, expansion.coefficients),
                   expansion.error)


def plain(case: Case) -> Iterator[Row]:
    """Least squares on Sobol points of the inputs, two per term, with the leave-one-out error."""
    inputs = len(case.germs)
    for order in ORDERS[inputs]:
        polynomials = Polynomials.of(case.germs, degrees(inputs, order))
        runs = 2 * len(polynomials.degrees)
        nodes = standard_normals(inputs, 1 << (runs - 1).bit_length(), 1)[:runs]
        values, times = polynomials.at(nodes), case.times(nodes)
        inverse = np.linalg.pinv(values)
        residual = (times - values @ (inverse @ times)) / (1 - np.sum(values * inverse.T, axis=1))[:, None]
        yield ("plain regression", polynomials, runs, case.error(polynomials, inverse @ times),
               np.sqrt(np.mean(residual**2, axis=0)))


def smolyak(case: Case) -> Iterator[Row]:
    """Pseudo-spectral projection on sparse grids."""
    inputs = len(case.germs)
    germ = chaospy.Iid(chaospy.Normal(0, 1), inputs)
    for rule, name in SMOLYAK.items():
        for level in range(1, 6 if rule.startswith("genz") else 8):
            nodes, weights = chaospy.generate_quadrature(level, germ, rule=rule, sparse=True)
            if len(weights) > MOST_RUNS:
                break
            times, best = case.times(nodes.T), None
            for order in range(1, 2 * level + 1):
                polynomials = Polynomials.of(case.germs, degrees(inputs, order))
                error = case.error(polynomials, (polynomials.at(nodes.T) * weights[:, None]).T @ times)
                if best is None or np.nanmedian(error) < np.nanmedian(best[1]):
                    best = polynomials, error
            assert best
            yield name, best[0], len(weights), best[1], None


if __name__ == "__main__":
    main()
