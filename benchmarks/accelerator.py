"""The simulator on processor cores beside the same equations in diffrax on an accelerator: all 540,000 engagements.

    python -m benchmarks.accelerator [--rounds ROUNDS]

It needs a JAX with a GPU, and writes accelerator.csv with the columns of peers.csv; the first row is one core. All are
in float64, and compiling is not counted. diffrax integrates all engagements at once, which was faster than parts of
them (0.18 s, and 0.24 and 0.68 s for 500 and 100 points at a time). It has two tolerances: that of `make bench`, and
one with about half of its error.
"""

import argparse
import os
from functools import partial

import diffrax
import jax
import numpy as np

from benchmarks import diffrax_peer, simulator
from benchmarks.peers import HEADER, Code, Work, measure
from benchmarks.results import write
from slipstick.clutch import ensemble

TOLERANCES = (simulator.DIFFRAX_TOLERANCE, 2e-6)
_ROWS = np.arange(len(simulator.GRID))


def on_cores(threads: int) -> Code:
    return Code(lambda: ensemble.shifting_times(simulator.MODEL, simulator.CONDITIONS, simulator.AXES, simulator.GRID,
                                                threads=threads), simulator.ensemble_error)


def on_accelerator(tolerance: float) -> Code:
    code = partial(diffrax_peer.shifting_times, together=len(_ROWS))
    return Code(lambda: simulator.simulate(code, tolerance, _ROWS),
                lambda: simulator.simulated_error(code, tolerance))


def main(rounds: int) -> None:
    """Measure all codes in alternating rounds, and write the table."""
    device, = jax.devices()
    if device.platform == "cpu":
        raise SystemExit("JAX finds no accelerator: install a JAX with support for it, such as jax[cuda13]")
    cores = os.cpu_count() or 1
    codes = {f"this project, {cores} cores": on_cores(cores)}
    codes |= {f"diffrax, tolerance {tolerance:g}, on one {device.device_kind}": on_accelerator(tolerance)
              for tolerance in TOLERANCES}
    rows = measure(Work("shifting times of 540,000 engagements", on_cores(1), codes, "s", {}, repeats=1), rounds)
    versions = f"{rounds} rounds; jax {jax.__version__}, diffrax {diffrax.__version__}"
    write("accelerator", HEADER, [*rows, [versions, *[""] * (len(HEADER) - 1)]],
          f"python -m benchmarks.accelerator --rounds {rounds}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=9)
    main(**vars(parser.parse_args()))
