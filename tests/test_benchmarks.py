"""The benchmarks run for minutes and are not run here, but they must not fall behind the code that they measure."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.kills import Round, digest_of, totals
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


def test_a_result_that_differs_in_its_last_digit_counts_as_different_but_not_one_that_took_longer() -> None:
    result = {"id": "a", "seconds": {"search": 1.0}, "result": {"mean": [1.0, 0.1 + 0.2]}}
    assert digest_of(result) == digest_of({**result, "id": "b", "seconds": {"search": 9.0}})
    assert digest_of(result) != digest_of({**result, "result": {"mean": [1.0, 0.3]}})


def test_the_rounds_of_kills_are_added_by_database_and_work() -> None:
    rounds = [Round(0, "PostgreSQL", "fits", 1, 2, 1, 0, 3, 0, 0, 1),
              Round(1, "PostgreSQL", "fits", 0, 1, 3, 0, 3, 1, 0, 0),
              Round(2, "SQLite", "build", 0, 0, 0, 4, 1, 0, 0, 0)]
    assert totals(rounds) == [("PostgreSQL", "fits", 2, 1, 3, 4, 0, 6, 1, 0, 1),
                              ("none", "build", 1, 0, 0, 0, 4, 1, 0, 0, 0),
                              ("all", "", 3, 1, 3, 4, 4, 7, 1, 0, 1)]
