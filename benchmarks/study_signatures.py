"""The strengths at which `benchmarks.study_blind` hides effects: what each leaves in recordings after the best refit.

    python -m benchmarks.study_signatures

54 recordings at a noise of 1 % of each signal's range are fitted without any effect, parameters and scatter free, once
with the hidden effect and once without it, noise drawn alike. What the effect leaves is the RMS by which its residuals
are larger, in units of those without it. Typical strength is where the signal that shows it most keeps one such noise
level; no strength is taken beyond `MOST` times the bench's own: some effects leave hardly anything then.
"""

import csv
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from os import cpu_count
from pathlib import Path

import numpy as np

from benchmarks.benches import HEAVY
from benchmarks.results import write
from slipstick.recordings import Recordings
from slipstick.study import comparison, study
from slipstick.study.settings import StudySettings
from tests.validation.hidden import EFFECTS, PHYSICAL, SENSORS, Case
from tests.validation.hidden import write as write_case

CHANNELS = ("pressure", "input_speed", "output_speed", "output_torque", "shifting_time")
HEADER = ("effect", "block", "strength", "unit", *CHANNELS, "std_pressure_bias", "std_initial_position")
LEAST, MOST = 0.1, 2.0
ROUNDS, SEED = 4, 900


def recorded(case: Case) -> Recordings:
    """The recordings of a case, through a sealed file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recordings.h5"
        write_case(path, case)
        return Recordings.open(path)


def refitted(case: Case) -> tuple[dict[str, float], list[float]]:
    """Variance of each channel's residuals after a fit without any effect, and the scatter it finds."""
    settings = StudySettings()
    compared = comparison.compare(HEAVY, recorded(case), settings.shifting_time_noise)
    state = study.start(settings, compared)
    fit, noise = state["rounds"][0]["fit"], state["noise"]
    return ({name: factor * noise[name] ** 2 for name, factor in zip(compared.channels, fit["noise"], strict=True)},
            np.sqrt(np.diag(fit["covariance"])).tolist())


def found(name: str) -> list[object]:
    """The effect's row of the table, at the strength that it comes to."""
    effect = EFFECTS[name]
    strength, (plain, _) = effect.typical, refitted(Case(seed=SEED, count=54))
    rows: dict[float, list[object]] = {}
    for _ in range(ROUNDS):
        with_it, scatter = refitted(Case({name: strength}, seed=SEED, count=54))
        left = {one: float(np.sqrt(max(0.0, with_it[one] / plain[one] - 1))) for one in CHANNELS}
        most = max(1e-9, *(left[one] for one in CHANNELS[:-1]))
        rows[most] = [name, effect.block, strength, effect.unit, *left.values(), *scatter]
        strength = float(np.clip(strength * np.clip(1 / most, 0.2, 2.0), LEAST * effect.typical, MOST * effect.typical))
    return rows[min(rows, key=lambda most: abs(np.log(most)))]


@cache
def table() -> list[dict[str, str]]:
    """The rows of the committed table."""
    with Path(__file__).with_name("study_signatures.csv").open() as file:
        return [row for row in csv.DictReader(file) if row["strength"]]


def strengths() -> dict[str, float]:
    """Typical strength of each listed effect."""
    return {row["effect"]: float(row["strength"]) for row in table()}


def signatures() -> dict[str, float]:
    """What it leaves in the signal that shows it most, in noise levels."""
    return {row["effect"]: max(float(row[one]) for one in CHANNELS[:-1]) for row in table()}


def main() -> None:
    """Measure all, and write the table."""
    names = [effect.name for effect in (*PHYSICAL, *SENSORS)]
    with ProcessPoolExecutor(cpu_count()) as pool:
        write("study_signatures", HEADER, list(pool.map(found, names)), "python -m benchmarks.study_signatures")


if __name__ == "__main__":
    main()
