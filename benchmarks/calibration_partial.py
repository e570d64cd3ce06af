"""Coverage of the intervals of calibrations without some of the signals; writes benchmarks/calibration_partial.csv.

The sets are those of `benchmarks.calibration` on the bench `heavy`. A parameter counts as determined in a set where the
calibration does not list it, and only intervals of those are counted in the coverage. Sets that are done are kept in
var/calibration_partial.jsonl, so that an interrupted run is resumed.

    python -m benchmarks.calibration_partial [SETS]
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from benchmarks import results
from benchmarks.benches import BENCHES
from benchmarks.calibration_sets import drawn
from benchmarks.rates import bounds
from slipstick.bench import parameters
from slipstick.calibration import calibrate

SETS, PROCESSES = 20, 2
CASES = ("", "pressure", "output_torque", "input_speed")
KEPT = Path("var/calibration_partial.jsonl")


def main() -> None:
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else SETS
    KEPT.parent.mkdir(exist_ok=True)
    rows = [json.loads(line) for line in KEPT.read_text().splitlines()] if KEPT.exists() else []
    done = {(row["missing"], row["seed"]) for row in rows}
    wanted = [(case, seed) for seed in range(sets) for case in CASES if (case, seed) not in done]
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool, KEPT.open("a") as file:
        for row in pool.map(one, *zip(*wanted, strict=True)) if wanted else ():
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    write([row for row in rows if row["seed"] < sets])


def one(missing: str, seed: int) -> dict:
    """One set without the signal `missing`: which intervals have the true mean, and their widths in nominal values."""
    bench = BENCHES["heavy"]
    recordings, truth = drawn(bench, seed)
    if missing:
        recordings = replace(recordings, signals=replace(recordings.signals, **{missing: None}))
    found = calibrate(recordings, bench)
    nominal = np.array(bench.physics.nominal)[[parameters.index(name) for name in found.free]]
    lower, upper = (found.interval / nominal[:, None]).T
    return {"missing": missing, "seed": seed, "free": found.free, "converged": found.converged,
            "determined": [name not in found.undetermined for name in found.free],
            "covered": ((lower <= truth.mean) & (truth.mean <= upper)).tolist(), "width": (upper - lower).tolist()}


def write(rows: list[dict]) -> None:
    table = []
    for case in CASES:
        some = [row for row in rows if row["missing"] == case]
        determined, covered, width = (np.array([row[key] for row in some])
                                      for key in ("determined", "covered", "width"))
        converged = sum(row["converged"] for row in some)
        for place, parameter in [*enumerate(some[0]["free"]), (slice(None), "all")]:
            its, inside = determined[:, place], covered[:, place]
            n, k = int(its.sum()), int((its & inside).sum())
            table.append([case or "none", parameter, len(some), n, k / n if n else "",
                          *(bounds(k, n) if n else ("", "")),
                          float(inside[~its].mean()) if not its.all() else "",
                          float(np.median(width[:, place])) if parameter != "all" else "", converged])
    results.write("calibration_partial", [
        "missing signal", "parameter", "sets", "determined in", "coverage of 90 % intervals where determined", "from",
        "to", "coverage where not determined", "median width / nominal", "converged"], table,
        f"python -m benchmarks.calibration_partial {max(row['seed'] for row in rows) + 1}")


if __name__ == "__main__":
    main()
