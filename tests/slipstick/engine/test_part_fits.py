"""Parts with many runs: chunks give what all runs at once give, with columns that are held, and on other executors."""

import pickle
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.engine import fit as fits
from slipstick.engine import part_fit
from slipstick.engine.evidence import multiply, screen
from slipstick.engine.fit import Fit
from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.settling import fit_bare
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import InvalidValue
from slipstick.machine import list_experiments, open_machine

TABLES = Path(__file__).parents[3] / "tables" / "machines"
RUNS = 11


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    machine = open_machine(TABLES / "two_tanks.py")
    experiments = list_experiments(machine)
    return prepare(machine, simulate_runs(machine, experiments.take(np.arange(RUNS) % len(experiments)), seed=2))


@pytest.fixture(scope="module")
def whole(recorded: Recorded) -> Fit:
    return fit_bare(recorded.groups()[0])


def cut(monkeypatch: pytest.MonkeyPatch, whole: Fit, runs: int, room: float) -> None:
    """Let chunks have at most so many runs, and a part room for the columns of so many chunks."""
    part = whole.recorded.parts[0]
    monkeypatch.setattr(part_fit, "_TOGETHER", runs * (part.fine * (part.measured.shape[2] - 1) + 1))
    columns = 1 + len(whole.recorded.random) + len(whole.recorded.shared)
    monkeypatch.setattr(part_fit, "_ROOM", room * 2 * columns * part.measured.nbytes / -(-RUNS // runs))


def compare(whole: Fit, other: Fit) -> None:
    assert other.evidence == pytest.approx(whole.evidence, abs=1e-2)
    np.testing.assert_allclose(other.state.points, whole.state.points, atol=1e-4)
    for name, model in whole.models.items():
        there = other.models[name]
        np.testing.assert_allclose(there.predicted, model.predicted, atol=1e-4 * np.ptp(model.predicted))
        np.testing.assert_allclose(there.read(1), model.read(1), atol=1e-4 * np.ptp(model.predicted))
        for variable, values in model.own().items():
            np.testing.assert_allclose(there.own()[variable], values, atol=1e-3 * np.ptp(values))
    own = {name: model.own() for name, model in whole.models.items()}
    candidates = list_candidates(whole.recorded, own)
    gains, others = ({each.candidate.pair: each.nats for each in
                      screen(each_fit, candidates, multiply(each_fit.models, candidates))}
                     for each_fit in (whole, other))
    assert others == pytest.approx(gains, rel=1e-2, abs=0.1)


@pytest.mark.parametrize("room", [0.0, 1.0, 9.0])
def test_chunks_give_what_all_runs_at_once_give(
        monkeypatch: pytest.MonkeyPatch, recorded: Recorded, whole: Fit, room: float) -> None:
    built: list[int] = []
    monkeypatch.setattr(part_fit, "build_part", counting(part_fit.build_part, built))
    cut(monkeypatch, whole, 4, room)
    compare(whole, fit_bare(recorded.groups()[0]))
    assert set(built) == {3, 4}


def counting(build: Callable[..., Any], built: list[int]) -> Callable[..., Any]:
    def count(recorded: Recorded, *arguments: Any) -> Any:
        built.append(len(recorded))
        return build(recorded, *arguments)

    return count


class Remote(Executor):
    """An executor to which everything is sent, and from which everything comes back, as between machines."""

    def __init__(self) -> None:
        self.sent = 0

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> "Future[Any]":
        cloudpickle = pytest.importorskip("cloudpickle")
        content = cloudpickle.dumps((function, arguments))
        self.sent += len(content)
        with ThreadPoolExecutor(1) as pool:
            future: Future[Any] = Future()
            future.set_result(pickle.loads(cloudpickle.dumps(pool.submit(run, content).result())))
            return future


def run(content: bytes) -> Any:
    function, arguments = pickle.loads(content)
    return function(*arguments)


def test_chunks_are_computed_elsewhere_alike(
        monkeypatch: pytest.MonkeyPatch, recorded: Recorded, whole: Fit) -> None:
    cut(monkeypatch, whole, 4, 0.0)
    here, remote = fit_bare(recorded.groups()[0]), Remote()
    there = fit_bare(replace(recorded, executor=remote).groups()[0])
    assert remote.sent > 0
    assert there.evidence == here.evidence
    np.testing.assert_array_equal(there.state.points, here.state.points)
    compare(whole, there)


def test_what_several_candidates_are_over_is_sent_once(
        monkeypatch: pytest.MonkeyPatch, recorded: Recorded, whole: Fit) -> None:
    cut(monkeypatch, whole, 4, 0.0)
    remote, name = Remote(), whole.recorded.parts[0].name
    model = replace(whole.models[name], recorded=replace(whole.recorded, executor=remote))
    candidate = next(each for each in list_candidates(whole.recorded, {
        name: model.own() for name, model in whole.models.items()})
        if name in each.variables and each.variables[name].kind == "curve")
    values = candidate.variables[name].values
    assert values is not None
    remote.sent = 0
    model.multiply([candidate])
    alone, remote.sent = remote.sent, 0
    model.multiply([candidate, replace(candidate, pair=("another", "pair"))])
    assert remote.sent - alone < values.nbytes / 2


def test_a_fit_is_kept_where_another_one_has_no_solution(whole: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values may be finite, and so large that no digit of the priors is left."""
    def fail(*_: Any, **__: Any) -> Any:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(fits, "estimate", fail)
    assert whole.restart() is whole
    with pytest.raises(InvalidValue, match="no finite solution"):
        whole.beside({}, {})


def test_runs_that_are_taken_from_a_fit_are_those_of_a_fit_of_them(recorded: Recorded, whole: Fit) -> None:
    rows = np.array([0, 2, 3, 4, 6, 7, 8, 10])
    taken = whole.take(rows)
    assert taken.converged
    anew = fit_bare(recorded.groups()[0].take(rows))
    assert taken.evidence == pytest.approx(anew.evidence, abs=1)
    errors = np.sqrt(np.diag(anew.fitted.covariance))[:len(anew.means)]
    np.testing.assert_allclose(taken.means / errors, anew.means / errors, atol=0.2)
    for name, chi in anew.chi_square.items():
        np.testing.assert_allclose(taken.chi_square[name], chi, atol=0.02)
        np.testing.assert_array_equal(taken.models[name].predicted, whole.models[name].predicted[rows])
