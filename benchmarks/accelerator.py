"""The simulator on processor cores beside the same equations in diffrax on an accelerator: all 540,000 engagements.

    python -m benchmarks.accelerator [--rounds ROUNDS]

It needs a JAX with a GPU, and writes accelerator.csv. The codes alternate; all are in float64, and compiling is not
counted. diffrax integrates all engagements at once, which was faster than parts of them (0.18 s, and 0.24 and 0.68 s
for 500 and 100 points at a time). It has two tolerances: that of `make bench`, and one with about half of its error.
"""

import argparse
import os
import time
from functools import partial

import diffrax
import jax
import numpy as np

from benchmarks import diffrax_peer, simulator
from benchmarks.results import write
from slipstick.clutch import ensemble

HEADER = ("code", "on", "time [s]", "least", "most", "time of the first / time", "largest error [s]")
TOLERANCES = (simulator.DIFFRAX_TOLERANCE, 2e-6)


def on_cores(threads: int) -> np.ndarray:
    return ensemble.shifting_times(simulator.MODEL, simulator.CONDITIONS, simulator.AXES, simulator.GRID,
                                   threads=threads)[0]


def on_accelerator(tolerance: float) -> np.ndarray:
    every = np.arange(len(simulator.GRID))
    return simulator.simulated(partial(diffrax_peer.shifting_times, together=len(every)), tolerance, every)


def main(rounds: int) -> None:
    """Measure all codes in alternating rounds, and write the table."""
    device, = jax.devices()
    if device.platform == "cpu":
        raise SystemExit("JAX finds no accelerator: install a JAX with support for it, such as jax[cuda13]")
    cores = sorted({1, os.cpu_count() or 1})
    codes = {("this project", f"{count} core{'s'[:count > 1]}"): partial(on_cores, count) for count in cores}
    codes |= {(f"diffrax, tolerance {tolerance:g}", device.device_kind): partial(on_accelerator, tolerance)
              for tolerance in TOLERANCES}
    errors = {code: float(np.abs(run() - simulator.tight()).max()) for code, run in codes.items()}  # and compile
    times = np.empty((rounds, len(codes)))
    for its in times:
        for place, run in enumerate(codes.values()):
            begin = time.perf_counter()
            run()
            its[place] = time.perf_counter() - begin
    rows = [[*code, *_spread(its), float(np.median(times[:, 0] / its)), error]
            for (code, error), its in zip(errors.items(), times.T, strict=True)]
    versions = f"jax {jax.__version__}, diffrax {diffrax.__version__}"
    write("accelerator", HEADER, [*rows, [f"{rounds} rounds; {versions}", *[""] * (len(HEADER) - 1)]],
          f"python -m benchmarks.accelerator --rounds {rounds}")


def _spread(times: np.ndarray) -> list[float]:
    return [float(np.median(times)), float(times.min()), float(times.max())]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=9)
    main(**vars(parser.parse_args()))
