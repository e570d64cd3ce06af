"""Runs keep what is finished, compare methods on the same cases, and write what other programs need."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from evidence import runner
from evidence.__main__ import main
from evidence.answer import Answer, NamedPair
from evidence.methods import METHODS
from evidence.runner import answer_cases, name_commit, read_answers, read_entries, write_case
from evidence.tables import read_rates
from slipstick.bench import Bench
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings

ROOT = Path(__file__).parents[2]
CASES = [("nothing_missing", 401), ("wrong_parameter", 402)]


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder for cases and answers, with a method that names the number of runs, and one that fails."""
    def count_runs(case: str, bench: Path, recordings: Path) -> Answer:
        Bench.open(bench)
        return Answer(case, (NamedPair(("load torque", "time"), nats=float(len(Recordings.open(recordings)))),))

    def fail(case: str, bench: Path, recordings: Path) -> Answer:
        raise ZeroDivisionError(case)

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(METHODS, "count", count_runs)
        patch.setitem(METHODS, "fail", fail)
        yield tmp_path_factory.mktemp("work")


def test_answers_are_kept_and_not_given_again(work: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = list(answer_cases("count", CASES[:1], work=work))
    assert first[0].answer.findings[0].nats >= 24
    monkeypatch.setattr(runner, "answer_case", lambda *_: pytest.fail("it is answered again"))
    kept = work / "answers-count.jsonl"
    kept.write_text(kept.read_text() + '{"suite": "nothing_mi')  # as of a program that was killed
    again = list(answer_cases("count", CASES[:1], work=work))
    assert again == first
    assert read_entries("count", work) == {CASES[0]: first[0]}
    monkeypatch.undo()
    monkeypatch.setattr(runner, "name_commit", lambda: "another version")
    assert [entry.version for entry in answer_cases("count", CASES[:1], work=work)] == ["another version"]


def test_each_state_of_a_changed_checkout_has_its_own_name(tmp_path: Path) -> None:
    def git(*arguments: str) -> None:
        subprocess.run(["git", "-c", "user.name=A", "-c", "user.email=a@example.org", *arguments], cwd=tmp_path,
                       check=True, capture_output=True)

    module, new = tmp_path / "slipstick" / "module.py", tmp_path / "slipstick" / "new.py"
    module.parent.mkdir()
    module.write_text("A = 1\n")
    git("init")
    git("add", ".")
    git("commit", "-m", "first")
    names = [name_commit(tmp_path)]
    for path, text in ((module, "A = 2\n"), (module, "A = 3\n"), (new, "B = 1\n"), (new, "B = 2\n")):
        path.write_text(text)
        names.append(name_commit(tmp_path))
    assert len(set(names)) == 5
    assert all(name.startswith(f"{names[0]}+") for name in names[1:])
    assert name_commit(tmp_path) == names[-1]
    new.unlink()
    module.write_text("A = 1\n")
    (tmp_path / "notes.md").write_text("of no module")
    assert name_commit(tmp_path) == names[0]


def test_a_method_that_raises_has_an_answer_with_its_error(work: Path) -> None:
    entry, = answer_cases("fail", CASES[:1], work=work)
    assert entry.answer.error.startswith("ZeroDivisionError('nothing_missing/")
    assert not entry.answer.findings


def test_files_of_a_case_have_no_truth_but_beside_them(work: Path) -> None:
    files = write_case(*CASES[1], work)
    assert sorted(path.name for path in files.folder.iterdir()) == ["bench.toml", "recordings.h5"]
    assert files.truth.factors
    before = files.recordings.stat().st_mtime_ns
    assert write_case(*CASES[1], work).recordings.stat().st_mtime_ns == before
    assert len(Recordings.open(files.recordings)) == files.truth.runs


def test_answers_of_another_program_are_read_for_the_cases_that_it_has(work: Path) -> None:
    name = write_case(*CASES[0], work).truth.case
    answers = work / "theirs.jsonl"
    answers.write_text(json.dumps({"case": name, "findings": [{"pair": ["friction coefficient", "slip"]}]}) + "\n"
                       + json.dumps({"case": "another/case"}) + "\n")
    entry, = read_answers(answers, CASES, work)
    for line in ("nothing", "[]", '{"findings": []}', '{"case": "x", "findings": [{}]}'):
        wrong = work / "wrong.jsonl"
        wrong.write_text(line + "\n")
        with pytest.raises(InvalidValue, match=r"Line 1 of .*wrong.jsonl is no answer"):
            list(read_answers(wrong, CASES, work))
    assert entry.answer.findings[0].pair == ("friction coefficient", "slip")
    assert not entry.verdict("all").silent


def test_the_command_writes_cases_and_refuses_what_it_does_not_know(
        work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nothing_missing", "--seed", "401", "--cases", "1", "--files", str(work)]) == 0
    assert capsys.readouterr().out.startswith("nothing_missing/")
    assert (work / "cases" / "nothing_missing-401" / "bench.toml").exists()
    for arguments, words in ((["everything"], "invalid choice: 'everything'"),
                             (["nothing_missing", "--cases", "0"], "'0' is not a whole number of 1 or more"),
                             (["nothing_missing", "--seed", "x"], "--seed"),
                             (["nothing_missing", "--method", "nobody"], "neither a method (naming")):
        with pytest.raises(SystemExit):
            main(arguments)
        assert words in capsys.readouterr().err


TANKS = [("other_machines", seed) for seed in (6, 14, 22, 30)]
"""Without an effect, so that they are drawn at once."""
SLOW = f"""
import sys, time
from pathlib import Path
from evidence.answer import Answer
from evidence.methods import METHODS
from evidence.runner import answer_cases
METHODS["slow"] = lambda case, bench, recordings: time.sleep(1) or Answer(case)
list(answer_cases("slow", {TANKS}, work=Path(sys.argv[1])))
"""


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command, kept = [sys.executable, "-c", SLOW, str(tmp_path)], tmp_path / "answers-slow.jsonl"
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, start_new_session=True)
    while not (kept.exists() and kept.read_text().count("\n")):
        assert process.poll() is None
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    lines = kept.read_text().splitlines()
    assert 1 <= len(lines) < 4
    monkeypatch.setitem(METHODS, "slow", lambda case, bench, recordings: Answer(case))
    assert len(list(answer_cases("slow", TANKS, work=tmp_path))) == 4
    assert kept.read_text().splitlines()[:len(lines)] == lines
    assert len(kept.read_text().splitlines()) == 4


def test_committed_rates_are_those_of_the_committed_answers() -> None:
    """Of those rates that the rows of the answers suffice for: the first of each suite."""
    rates = read_rates(ROOT / "evidence" / "rates.csv")
    assert {rate.suite for rate in rates} >= {"nothing_missing", "one_known_effect", "two_effects", "all"}
    silent = [rate for rate in rates if rate.suite == "nothing_missing" and rate.stage == "all"]
    lines = (ROOT / "evidence" / "answers.csv").read_text().splitlines()
    rows = [line for line in lines if ",nothing_missing/" in line]
    assert silent[0].of == len(rows)
