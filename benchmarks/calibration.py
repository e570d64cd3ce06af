"""Coverage and width of the intervals of calibrations on simulated recordings; writes benchmarks/calibration.csv.

Each set has true means, scatter and autocorrelation of its own (`calibration_sets`). An interval is compared with the
Cramer-Rao bound of the mixed model whose scatter and noise are known, computed at the true parameters of each
engagement. Sets that are done are kept in var/calibration_sets.jsonl, so that an interrupted run is resumed.

    python -m benchmarks.calibration [SETS]
"""

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.stats import norm

from benchmarks import results
from benchmarks.benches import SHIPPED
from benchmarks.calibration_sets import Truth, drawn
from benchmarks.rates import bounds
from slipstick.bench import Bench, parameters
from slipstick.calibration import calibrate, random_effects
from slipstick.calibration.calibrate import LEVEL
from slipstick.calibration.linearised import linearise
from slipstick.calibration.mixed import engagements
from slipstick.calibration.modes import axes
from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings

SETS, PROCESSES = 60, 2
KEPT = Path("var/calibration_sets.jsonl")


def main() -> None:
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else SETS
    KEPT.parent.mkdir(exist_ok=True)
    rows = [json.loads(line) for line in KEPT.read_text().splitlines()] if KEPT.exists() else []
    done = {(row["bench"], row["seed"]) for row in rows}
    wanted = [(name, seed) for seed in range(sets) for name in SHIPPED if (name, seed) not in done]
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool, KEPT.open("a") as file:
        for row in pool.map(one, *zip(*wanted, strict=True)) if wanted else ():
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            print(f"{row['bench']} {row['seed']}: {row['seconds']:.1f} s", file=sys.stderr)
    write([row for row in rows if row["seed"] < sets])


def one(name: str, seed: int) -> dict:
    """One set: errors, widths and bounds of all parameters, as multiples of nominal values."""
    bench = SHIPPED[name]
    recordings, truth = drawn(bench, seed)
    start = time.perf_counter()
    found = calibrate(recordings, bench)
    seconds = time.perf_counter() - start
    nominal = np.array(bench.physics.nominal)[[parameters.index(name) for name in found.free]]
    lower, upper = (found.interval / nominal[:, None]).T
    mean = np.array([dict(zip(parameters.NAMES, found.model.parameters, strict=True))[name]
                     for name in found.free]) / nominal
    return {"bench": name, "seed": seed, "engagements": len(recordings), "seconds": seconds, "free": found.free,
            "converged": found.converged, "at_bound": found.at_bound, "truth": truth.mean.tolist(),
            "mean": mean.tolist(), "lower": lower.tolist(), "upper": upper.tolist(),
            "bound": bound(bench, recordings, truth).tolist(), "scatter": truth.scatter.tolist(),
            "scatter_found": (found.scatter / nominal).tolist(),
            "scatter_error": (found.scatter_error / nominal).tolist(), "chi_square": found.chi_square}


def bound(bench: Bench, recordings: Recordings, truth: Truth) -> np.ndarray:
    """Cramer-Rao bound (d,) of the standard errors: the information of the means at the truth, scatter known."""
    model = Model(bench.physics)
    observations = Observations(recordings, recordings.signals, bench, bench.uncertain, np.array(model.parameters),
                                model.coefficients(), model.laws)
    noise = Noise(np.array([bench.sensors[name].noise for name in observations.channels]),
                  np.array([*[truth.correlation] * len(recordings.signals.names), 0.0]))
    n, d = truth.points.shape
    posterior = np.tile(1e-6 * np.eye(d), (n, 1, 1))
    for _ in range(3):  # the differences span the posterior of an engagement, which they determine
        about = linearise(observations, truth.points, axes(posterior), noise.std[-1])
        its = engagements(about, noise, observations, np.zeros((d, 0)))
        effects = random_effects.predicted(its, truth.scatter**2)
        posterior = effects.posterior
    return effects.standard_error


def write(rows: list[dict]) -> None:
    table = []
    for name in SHIPPED:
        some = [row for row in rows if row["bench"] == name]
        if not some:
            continue
        its = {key: np.array([row[key] for row in some]) for key in
               ("truth", "mean", "lower", "upper", "bound", "scatter", "scatter_found", "seconds")}
        covered = ((its["lower"] <= its["truth"]) & (its["truth"] <= its["upper"])).sum(axis=0)
        width = (its["upper"] - its["lower"]) / (2 * norm.ppf(0.5 + LEVEL / 2) * its["bound"])
        error = (its["mean"] - its["truth"]) / its["bound"]
        converged = sum(row["converged"] for row in some)
        for place, parameter in enumerate(some[0]["free"]):
            k, n = int(covered[place]), len(some)
            table.append([name, parameter, n, k / n, *bounds(k, n), float(np.median(width[:, place])),
                          float(error[:, place].mean()), float(error[:, place].std()),
                          float(np.median(its["scatter_found"][:, place] / its["scatter"][:, place])),
                          converged, float(np.median(its["seconds"]))])
        k, n = int(covered.sum()), covered.size * len(some)
        table.append([name, "all", len(some), k / n, "", "", float(np.median(width)), float(error.mean()),
                      float(error.std()), float(np.median(its["scatter_found"] / its["scatter"])), converged,
                      float(np.median(its["seconds"]))])
    results.write("calibration", ["bench", "parameter", "sets", "coverage of 90 % intervals", "from", "to",
                                  "median width / Cramer-Rao", "mean error / Cramer-Rao", "std of error / Cramer-Rao",
                                  "median scatter / true", "converged", "median seconds"], table,
                  f"python -m benchmarks.calibration {max(row['seed'] for row in rows) + 1}")


if __name__ == "__main__":
    main()
