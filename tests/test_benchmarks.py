"""The benchmarks run for minutes and are not run here, but they must not fall behind the code that they measure."""

import csv
import importlib
import os
import re
import time
from collections.abc import Iterator
from importlib.util import find_spec
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from benchmarks import scalar_cpp, scalar_dopri, simulator
from benchmarks.expansion_peers import BASIS, Peers
from benchmarks.peers import HEADER, Code, Work, measure
from benchmarks.scipy_script import shifting_time
from slipstick.bench.parameters import NAMES
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from tests.benches import HEAVY

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "benchmarks"
NOT_IMPORTED = {"catalogue"} if find_spec("diffrax") else {"accelerator", "catalogue", "diffrax_peer"}
"""`catalogue` runs on import; the others need the extra `bench`."""
RATIO = r"([\d.,]+) \(([\d.,]+) to ([\d.,]+)\)"


def test_every_benchmark_can_be_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.environ", {**os.environ})  # in which they set variables
    names = sorted(path.stem for path in BENCHMARKS.glob("[a-z]*.py") if path.stem not in NOT_IMPORTED)
    assert len(names) > 10
    for name in (*names, "__main__"):
        importlib.import_module(f"benchmarks.{name}")


def ratios_of_tables() -> Iterator[tuple[str, ...]]:
    """Median, least and largest ratio of each row, as the README writes them."""
    for name, column in (("peers", 5), ("accelerator", 5), ("serving", 6)):
        with (BENCHMARKS / f"{name}.csv").open(newline="") as file:
            for row in list(csv.reader(file))[1:]:
                if row[column]:
                    yield tuple(f"{float(f'{x:.3g}'):,.0f}" if x >= 100 else f"{x:#.3g}"
                                for x in map(float, row[column:column + 3]))


def test_the_ratios_of_the_page_are_those_of_the_tables() -> None:
    page = set(re.findall(RATIO, (BENCHMARKS / "README.md").read_text()))
    assert len(page) > 15
    assert page <= set(ratios_of_tables())


def test_the_straightforward_implementation_simulates_the_same_bench() -> None:
    parameters = dict(zip(NAMES, HEAVY.physics.nominal, strict=True))
    times, _ = ensemble.shifting_times(Model(HEAVY.physics), HEAVY.conditions.take([100]))
    assert np.abs(shifting_time(parameters, HEAVY.conditions, 100) - times[0, 0]) < 1e-3


@pytest.mark.skipif(scalar_cpp.missing() is not None, reason="needs g++")
@pytest.mark.slow
def test_the_scalar_codes_take_the_same_steps() -> None:
    """Up to rounding, which decides in a few engagements whether a step across a kink is accepted."""
    compiled, jitted = (simulator.simulate(code, simulator.DOPRI_TOLERANCE, np.array([0, 2499]))
                        for code in (scalar_cpp.shifting_times, scalar_dopri.shifting_times))
    assert np.quantile(np.abs(compiled - jitted), 0.9) < 1e-9
    np.testing.assert_allclose(compiled, jitted, atol=1e-4)


@pytest.mark.skipif(find_spec("diffrax") is None, reason="needs the extra `bench`")
def test_diffrax_simulates_the_same_bench() -> None:
    from benchmarks import diffrax_peer

    rows = np.array([0, 1275])
    times = simulator.simulate(diffrax_peer.shifting_times, simulator.DIFFRAX_TOLERANCE, rows)
    ours, _ = ensemble.shifting_times(simulator.MODEL, simulator.CONDITIONS, simulator.AXES, simulator.GRID[rows])
    np.testing.assert_allclose(times, ours, atol=1e-3)


def test_the_expansions_of_all_codes_are_the_same() -> None:
    """Also of a model that is no polynomial, whose expansion depends on the rule."""
    germs = np.random.default_rng(1).standard_normal((20, 2))
    peers = Peers(np.exp(0.3 * BASIS.nodes @ [[1.0, -0.5], [0.2, 1.0]]), germs)
    for code in (peers.numpy, peers.chaospy, peers.openturns):
        np.testing.assert_allclose(code(), peers.ours(), rtol=1e-11)
    assert np.abs(peers.ours() - np.exp(0.3 * germs @ [[1.0, -0.5], [0.2, 1.0]])).max() > 1e-8


def test_a_peer_that_does_a_part_of_the_work_is_scaled_to_all_of_it() -> None:
    slow = Code(lambda: time.sleep(0.002), scale=3.0)
    work = Work("sums", Code(lambda: None, lambda: 0.5), {"slow": slow}, "s", {"slow": 1.0, "absent": 2.0}, limit=1e6,
                repeats=1, floors={"a part": Code(lambda: time.sleep(0.001))}, left_out={"absent": "no compiler"})
    first, second, third, last = (dict(zip(HEADER, row, strict=True)) for row in measure(work, 3))
    assert (first["code"], first["error"], first["target"], first["met"]) == ("this project", 0.5, "1e+06 ms", "yes")
    assert float(second["least"]) > 0  # of the speedups, the later of two columns
    assert float(str(second["median [ms]"])) >= 3 * 2.0
    assert second["met"] == "yes"
    assert (third["code"], third["met"]) == ("floor: a part", "")  # is no peer
    assert float(third["median [ms]"]) >= 1.0
    assert (last["code"], last["median [ms]"]) == ("absent", "left out: no compiler")


def test_a_code_with_a_warm_up_is_run_in_the_rounds_only_and_before_its_error_is_computed() -> None:
    ticks, calls = count(), []
    ours = Code(lambda: calls.append("run"), lambda: float(len(calls)), warm_up=lambda: calls.append("warm-up"))
    work = Work("fit", ours, {"grid": Code(lambda: None, scale=5.0)}, "decades", {}, repeats=1, rounds=2,
                clock=lambda: float(next(ticks)))
    ours_row, grid_row = (dict(zip(HEADER[:3], row, strict=False)) for row in measure(work, 9))
    assert calls == ["warm-up", "run", "run"]
    assert (ours_row["median [ms]"], grid_row["median [ms]"]) == (1e3, 5e3)
