"""Recordings of the independent generator with a law that the test states, on a shipped bench."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from evidence.generator.bench import Bench, open_bench
from evidence.generator.case import Case, Hidden, simulate
from evidence.generator.draw_bench import run_nominal
from evidence.generator.effect import Effect
from evidence.generator.files import write_recordings
from evidence.generator.world import World, draw_world
from slipstick.recordings import Recordings

TABLES = Path(__file__).parents[1] / "tables"
__all__ = ["CONVERTER_LAGS", "EXACT", "FRICTION_FALLS", "LOAD_DRAGS", "PISTON_WARMS", "SUPPLY_DROOPS", "Hidden",
           "case_of", "draw_world", "law", "record", "shipped"]
HORIZON = {"heavy": 2.0, "compact": 1.8}
EXACT = World()
"""A world without noise and deviations."""


@cache
def shipped(name: str) -> Bench:
    """The generator's bench of a shipped file, with the pace and the ranges of its nominal runs."""
    return run_nominal(open_bench(TABLES / f"{name}.toml", HORIZON[name])).engagements.bench


def law(quantity: str, abscissa: str, change: Callable[[np.ndarray], np.ndarray], kind: str = "ratio",
        block: str = "torque", pair: tuple[str, str] = ("", "")) -> Hidden:
    """A hidden law, whose `change` of the abscissa multiplies the quantity, or is added to it as a "difference"."""
    return Hidden(Effect(pair, block, quantity, abscissa, kind, lambda amplitude, x: change(x)), 1.0)


def case_of(*hidden: Hidden, seed: int, count: int, bench: str = "heavy", **others: object) -> Case:
    """A case on a shipped bench."""
    return Case("", (900, seed), shipped(bench), count, hidden, **others)


def record(folder: Path, *hidden: Hidden, seed: int, count: int, bench: str = "heavy", **others: object) -> Recordings:
    """The recordings of such a case, written to a file in the folder."""
    case = case_of(*hidden, seed=seed, count=count, bench=bench, **others)
    write_recordings(folder / "case.h5", case, simulate(case, 1e-6))
    return Recordings.open(folder / "case.h5")


FRICTION_FALLS = law("friction_coefficient", "slip", lambda v: 1 + 0.2 * np.exp(-((v / 14) ** 1.3)))
SUPPLY_DROOPS = law("pressure_gain", "motor_speed", lambda w: 1 - 0.08 * np.exp(-(((w - 100) / 50) ** 2)),
                    block="pressure")
LOAD_DRAGS = law("load_torque", "output_speed", lambda w: 0.01 * (w**2 + 2 * w), "difference", "output speed")
PISTON_WARMS = law("oil_temperature_gain", "sequence", lambda r: 1 + 0.2 * (1.25 * r - 0.25 * r**2))
CONVERTER_LAGS = law("converter_lag", "motor_speed", lambda w: 0.05 * (150 / w) ** 0.5, "difference", "input speed")
