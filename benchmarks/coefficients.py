"""Coverage of the 90 % intervals of coefficients: effects within an engagement, and ones that differ between them.

    python -m benchmarks.coefficients

Recordings of 54 engagements of the first shipped bench, simulated with one effect at twice its typical amplitude and
with the scatter of the bench, are studied, for each effect with three seeds. Every finished study is a line of
var/coefficients.jsonl, so that a killed run goes on where it was. coefficients.csv has the share of intervals that
contain the true amplitude, of those studies whose simulation has the formula, and errors over standard errors.
"""

import json
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any

import numpy as np
import scipy
from numba import set_num_threads

from benchmarks.benches import BENCHES
from benchmarks.naming import FOLDER
from benchmarks.naming_rates import rate
from benchmarks.results import write
from slipstick.clutch import effects
from slipstick.clutch.model import Model
from slipstick.simulated_recordings import simulated_recordings
from slipstick.study import StudySettings, conclude, examine

NAMES = ("stribeck_friction", "quadratic_load_drag", "supply_droop", "temperature_drift", "viscosity_drift",
         "pressure_dependent_friction")
SEEDS, ENGAGEMENTS, MULTIPLE, PROCESSES = 3, 54, 2.0, 2


def one(job: tuple[str, int]) -> dict[str, Any]:
    """The amplitude of an effect, its estimate, and both ends of its interval; none where it has no formula."""
    name, seed = job
    set_num_threads(1)
    bench, settings = BENCHES["heavy"], StudySettings()
    its = effects.find(name).on(bench.scales)
    values = {c.name: c.typical if c.shape else c.neutral + MULTIPLE * (c.typical - c.neutral)
              for c in its.coefficients}
    amplitude = next(c.name for c in its.coefficients if not c.shape)
    conditions = bench.conditions.take(np.linspace(0, len(bench.conditions) - 1, ENGAGEMENTS).astype(int))
    recordings = simulated_recordings(bench, Model(bench.physics).with_effect(name, values), conditions, seed=seed)
    result, _ = conclude(settings, bench, recordings, examine(settings, bench, recordings))
    found = [its for finding in result.findings if finding.effect == name
             for its in finding.confirmation.coefficients if its.name == amplitude]
    return {"effect": name, "seed": seed, "named": name in result.effects, "true": values[amplitude],
            "interval": [found[0].lower, found[0].value, found[0].upper] if found else None}


def main() -> None:
    """Study what has no line yet, and write the table."""
    lines = FOLDER / "coefficients.jsonl"
    lines.parent.mkdir(exist_ok=True)
    done = [json.loads(line) for line in lines.read_text().splitlines()] if lines.exists() else []
    known = {(entry["effect"], entry["seed"]) for entry in done}
    jobs = [(name, seed) for seed in range(SEEDS) for name in NAMES]
    with ProcessPoolExecutor(PROCESSES) as pool, lines.open("a") as file:
        for future in as_completed([pool.submit(one, job) for job in jobs if job not in known]):
            done.append(future.result())
            file.write(json.dumps(done[-1]) + "\n")
            file.flush()
            print(done[-1], flush=True)
    rows = []
    for name in NAMES:
        its = [entry for entry in done if entry["effect"] == name]
        formulas = [(entry["true"], *entry["interval"]) for entry in its if entry["interval"]]
        wide = float(scipy.special.ndtri((1 + StudySettings().level) / 2))
        errors = [(value - true) / ((upper - lower) / (2 * wide)) for true, lower, value, upper in formulas]
        rows.append([*rate(name, [lower <= true <= upper for true, lower, _, upper in formulas]),
                     sum(entry["named"] for entry in its), len(its), float(np.median(np.abs(errors))) if errors else "",
                     float(np.median([(value - true) / true for true, _, value, _ in formulas])) if formulas else ""])
    write("coefficients", ("effect", "intervals with the true value", "of", "share", "lower", "upper", "named",
                           "studies", "median error over standard error", "median relative error"), rows,
          "python -m benchmarks.coefficients")


if __name__ == "__main__":
    main()
