"""The noise of the sensors as a study estimates it, beside the true noise, on drawn cases without their bad runs.

    python -m evidence.robustness.noise

A row counts the cases in which the estimated power at low frequencies is within `WITHIN` of the true one: as the signal
alone shows it, and as the residuals of the blocks do.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numba import set_num_threads

from evidence.generator.bench import SENSORS
from evidence.generator.case import bad_runs_of, simulate
from evidence.generator.files import write_recordings
from evidence.robustness.table import Row, replace_rows
from evidence.runner import RELATIVE
from evidence.suites import draw_case
from slipstick.bench import Bench
from slipstick.blocks.sensor_noise import power
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import begin
from slipstick.recordings import Recordings

CASES = [(suite, seed) for suite in ("one_known_effect", "nothing_missing") for seed in range(501, 511)]
WITHIN = 1.2
WIDER = 2.0
"""Factors between the estimated and the true power."""


@dataclass(frozen=True)
class Ratio:
    """Estimated over true power of the noise of a `sensor` in one case, from its signal and from the `blocks`."""

    sensor: str
    signal: float
    blocks: float


def compare_noise(suite: str, seed: int) -> Iterator[Ratio]:
    """Yield the ratios of all sensors in a drawn case."""
    case = draw_case(suite, seed)
    run = simulate(case, RELATIVE)
    with TemporaryDirectory() as folder:
        bench_file, recordings_file = Path(folder, "bench.toml"), Path(folder, "recordings.h5")
        bench_file.write_text(case.bench.text)
        write_recordings(recordings_file, case, run)
        bench, recordings = Bench.open(bench_file), Recordings.open(recordings_file)
    good = np.setdiff1d(np.arange(len(recordings)), [bad.run for bad in bad_runs_of(case, run.conditions)])
    scene = Scene.of(bench, recordings, NamingSettings()).take(good)
    estimates = begin(scene, lambda _: None).noise
    for sensor in SENSORS:
        true = compute_power(scene.measured(sensor) - run.readings[sensor][good])
        yield Ratio(sensor, power(scene.noise[sensor]) / true, power(estimates[sensor]) / true)


def compute_power(noise: np.ndarray) -> float:
    """Return the power at low frequencies of noise (n, k), in the square of its unit."""
    return power((float(noise.std()), float((noise[:, 1:] * noise[:, :-1]).mean() / noise.var())))


def summarize(ratios: Sequence[Ratio]) -> list[Row]:
    """Return the rows of all sensors, each from its signal and from the blocks."""
    rows = []
    for sensor in dict.fromkeys(ratio.sensor for ratio in ratios):
        for source in ("signal", "blocks"):
            factors = np.array([getattr(ratio, source) for ratio in ratios if ratio.sensor == sensor])
            factors = np.maximum(factors, 1 / factors)
            rows.append(Row(f"power of the noise of {sensor}, from the {source}: within a factor of {WITHIN:g}",
                            len(factors), int((factors <= WITHIN).sum()), "cases",
                            f"within a factor of {WIDER:g}: {(factors <= WIDER).sum()}; worst factor: "
                            f"{factors.max():.4g}"))
    return rows


def main() -> None:
    """Compare the noise in all cases, and replace the rows of the table."""
    set_num_threads(1)
    ratios = list[Ratio]()
    for suite, seed in CASES:
        ratios += compare_noise(suite, seed)
        print(f"{suite} {seed}:", *(f"{each.sensor} {each.signal:.3g} {each.blocks:.3g}" for each in ratios[-4:]),
              flush=True)
    replace_rows("noise", summarize(ratios), "python -m evidence.robustness.noise")


if __name__ == "__main__":
    main()
