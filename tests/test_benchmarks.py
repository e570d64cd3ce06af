"""The benchmarks run for minutes and are not run here, but they must not fall behind the code that they measure."""

import subprocess
import sys
import time
from importlib.util import find_spec
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from benchmarks import scalar_cpp, scalar_dopri, simulator
from benchmarks.expansion_peers import BASIS, Peers
from benchmarks.hidden_laws import compared
from benchmarks.kills import Round, digest_of, totals
from benchmarks.naming import COUNTED, limits_of
from benchmarks.peers import HEADER, Code, Work, measured
from benchmarks.scipy_script import shifting_time
from slipstick.bench.parameters import NAMES
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.naming.measured import LawPoints
from tests.benches import HEAVY
from tests.validation.hidden import cases

ROOT = Path(__file__).parents[1]
NOT_IMPORTED = {"catalogue"} if find_spec("diffrax") else {"accelerator", "catalogue", "diffrax_peer"}
"""`catalogue` runs on import; the others need the extra `bench`."""


def test_every_benchmark_can_be_imported() -> None:
    names = sorted(path.stem for path in (ROOT / "benchmarks").glob("[a-z]*.py") if path.stem not in NOT_IMPORTED)
    assert len(names) > 10
    code = "import " + ", ".join(f"benchmarks.{name}" for name in [*names, "__main__"])
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_the_straightforward_implementation_simulates_the_same_bench() -> None:
    parameters = dict(zip(NAMES, HEAVY.physics.nominal, strict=True))
    times, _ = ensemble.shifting_times(Model(HEAVY.physics), HEAVY.conditions.take([100]))
    assert np.abs(shifting_time(parameters, HEAVY.conditions, 100) - times[0, 0]) < 1e-3


@pytest.mark.skipif(scalar_cpp.missing() is not None, reason="needs g++")
@pytest.mark.slow
def test_the_scalar_codes_take_the_same_steps() -> None:
    """Up to rounding, which decides in a few engagements whether a step across a kink is accepted."""
    compiled, jitted = (simulator.simulated(code, simulator.DOPRI_TOLERANCE, np.array([0, 2499]))
                        for code in (scalar_cpp.shifting_times, scalar_dopri.shifting_times))
    assert np.quantile(np.abs(compiled - jitted), 0.9) < 1e-9
    np.testing.assert_allclose(compiled, jitted, atol=1e-4)


@pytest.mark.skipif(find_spec("diffrax") is None, reason="needs the extra `bench`")
def test_diffrax_simulates_the_same_bench() -> None:
    from benchmarks import diffrax_peer

    rows = np.array([0, 1275])
    times = simulator.simulated(diffrax_peer.shifting_times, simulator.DIFFRAX_TOLERANCE, rows)
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
    first, second, third, last = (dict(zip(HEADER, row, strict=True)) for row in measured(work, 3))
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
    ours_row, grid_row = (dict(zip(HEADER[:3], row, strict=False)) for row in measured(work, 9))
    assert calls == ["warm-up", "run", "run"]
    assert (ours_row["median [ms]"], grid_row["median [ms]"]) == (1e3, 5e3)


def test_a_result_that_differs_in_its_last_digit_counts_as_different_but_not_one_that_took_longer() -> None:
    result = {"id": "a", "seconds": {"search": 1.0}, "result": {"mean": [1.0, 0.1 + 0.2]}}
    assert digest_of(result) == digest_of({**result, "id": "b", "seconds": {"search": 9.0}})
    assert digest_of(result) != digest_of({**result, "result": {"mean": [1.0, 0.3]}})


def test_a_hidden_law_is_compared_over_the_slip_before_the_gear_and_with_the_sign_of_an_input_torque() -> None:
    grid = np.linspace(0, 10, 5)
    change, visits = list(0.1 * grid), [0.2] * 5
    friction = {"abscissa": "slip", "quantity": "friction_coefficient", "kind": "difference", "base": 1.0,
                "grid": list(grid), "change": change, "visits": visits}
    drag = {**friction, "abscissa": "input_speed", "quantity": "input_drag", "base": None}
    law = LawPoints(("friction coefficient", "slip"), 3 * grid, "rad/s", 0.1 * grid, "1", True, np.eye(5))
    torque = LawPoints(("input torque", "input speed"), grid, "rad/s", -0.1 * grid, "N m", False, np.eye(5))
    for one, hidden in ((law, friction), (torque, drag)):
        found = compared(one, hidden, {"gr": 3.0})
        assert found is not None
        assert (found.share, found.held) == (pytest.approx(0, abs=1e-12), pytest.approx(1))


def test_a_force_on_the_piston_is_compared_as_the_rate_that_it_causes() -> None:
    grid, parameters = np.linspace(0, 2e-3, 5), {"gr": 3.0, "b2": 2e-3, "c2": 4.0, "d2": 8.0}
    force = {"abscissa": "piston", "quantity": "net_pressure", "kind": "difference", "base": None, "grid": list(grid),
             "change": list(-100 * grid), "visits": [0.2] * 5}
    spring = {**force, "quantity": "spring_rate", "kind": "ratio", "base": 8.0, "change": [1.5] * 5}
    pair = ("piston rate", "piston position")
    for hidden, rate in ((force, -100 * grid * 2e-3 / 4), (spring, -0.5 * 8.0 * grid / 4)):
        found = compared(LawPoints(pair, grid, "m", rate, "m/s", False, np.eye(5)), hidden, parameters)
        assert found is not None
        assert found.share == pytest.approx(0, abs=1e-12)
        wrong = compared(LawPoints(pair, grid, "m", 2 * rate, "m/s", False, np.eye(5)), hidden, parameters)
        assert wrong is not None
        assert wrong.share == pytest.approx(1)


def test_the_rounds_of_kills_are_added_by_database_and_work() -> None:
    rounds = [Round(0, "PostgreSQL", "fits", 1, 2, 1, 0, 3, 0, 0, 1),
              Round(1, "PostgreSQL", "fits", 0, 1, 3, 0, 3, 1, 0, 0),
              Round(2, "SQLite", "build", 0, 0, 0, 4, 1, 0, 0, 0)]
    assert totals(rounds) == [("PostgreSQL", "fits", 2, 1, 3, 4, 0, 6, 1, 0, 1),
                              ("none", "build", 1, 0, 0, 0, 4, 1, 0, 0, 0),
                              ("all", "", 3, 1, 3, 4, 4, 7, 1, 0, 1)]


def test_limits_of_the_tables_of_cases_are_one_for_each_hidden_effect() -> None:
    known = {which: limits_of(which) for which in COUNTED}
    for which, limits in known.items():
        assert [len(its) for its in limits.values()] == [len(cases.LISTS[which][case].effects) for case in limits]
        assert all(one.named <= one.seen for its in limits.values() for one in its)
    assert sum(len(its) for its in known.values()) > 200
    assert any(one.seen >= 100 for limits in known.values() for its in limits.values() for one in its)  # 1.5e+02
