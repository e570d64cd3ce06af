"""The benchmarks run for minutes and are not run here, but they must not fall behind the code that they measure."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.scipy_script import shifting_time
from slipstick.bench.parameters import NAMES
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from tests.benches import HEAVY

ROOT = Path(__file__).parents[1]
RUNS_ON_IMPORT = "catalogue"


def test_every_benchmark_can_be_imported() -> None:
    names = sorted(path.stem for path in (ROOT / "benchmarks").glob("[a-z]*.py") if path.stem != RUNS_ON_IMPORT)
    assert len(names) > 10
    code = "import " + ", ".join(f"benchmarks.{name}" for name in [*names, "__main__"])
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_the_straightforward_implementation_simulates_the_same_bench() -> None:
    parameters = dict(zip(NAMES, HEAVY.physics.nominal, strict=True))
    times, _ = ensemble.shifting_times(Model(HEAVY.physics), HEAVY.conditions.take([100]))
    assert np.abs(shifting_time(parameters, HEAVY.conditions, 100) - times[0, 0]) < 1e-3
