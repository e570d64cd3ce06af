"""The engine as a method of the evidence: other machines from file to verdict, and what it is compared on."""

from dataclasses import replace
from pathlib import Path

import pytest

from evidence.answer import NamedPair
from evidence.engine_method import answer_by_engine, load_machine
from evidence.generator.machines.pairs import PAIRS
from evidence.judge import accept, judge
from evidence.rates import Entry, rate
from evidence.runner import CaseFiles, answer_case, write_case
from evidence.suites import OTHER_MACHINES

LEAK = 2018  # a leak of the first tank over time
NULL = 1006


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("evidence")


@pytest.fixture(scope="module")
def leak(work: Path) -> Entry:
    return answer_case("engine", OTHER_MACHINES, LEAK, work)


@pytest.fixture(scope="module")
def null(work: Path) -> Entry:
    return answer_case("engine", OTHER_MACHINES, NULL, work)


@pytest.mark.slow
def test_files_of_other_machines_are_read_by_the_engine(work: Path, leak: Entry) -> None:
    files = write_case(OTHER_MACHINES, LEAK, work)
    assert (files.bench.name, files.recordings.name) == ("machine.json", "runs.h5")
    assert files.truth == leak.truth
    assert CaseFiles(work / "one_known_effect-7").bench.name == "bench.toml"


@pytest.mark.slow
def test_a_hidden_effect_is_named_and_a_recording_without_one_is_left_alone(leak: Entry, null: Entry) -> None:
    assert not leak.answer.error
    assert judge(leak.answer, leak.truth).effects_named == 1
    assert judge(null.answer, null.truth).silent
    law = next(law for law in leak.answer.laws if law.pair == leak.answer.findings[0].pair)
    assert len(law.x) == len(law.change) == len(law.std) > 20
    counted = {each.what: (each.hits, each.of) for each in rate([leak, null])}
    assert counted["tanks, visible: right in the answer"] == (1, 1)
    assert counted["tanks, no effect: something said to be missing"] == (0, 1)


@pytest.mark.slow
def test_pairs_that_no_recording_tells_apart_are_right(leak: Entry) -> None:
    hidden = leak.truth.hidden[0]
    assert accept(hidden) >= {("leak 1", "time"), ("voltage", "time")}
    wrong = replace(leak.answer, findings=(NamedPair(("outflow 2", "time")),))
    assert judge(wrong, leak.truth).effects_named == 0


def test_declared_machines_have_the_quantities_of_all_hidden_effects() -> None:
    for name, pairs in PAIRS.items():
        known = {quantity.name for quantity in load_machine(name).quantities}
        assert {quantity for quantity, _ in pairs} <= known


def test_an_answer_is_an_error_where_files_are_missing(work: Path) -> None:
    with pytest.raises(FileNotFoundError):
        answer_by_engine("", work / "machine.json", work / "runs.h5")
