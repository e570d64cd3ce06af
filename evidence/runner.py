"""Draws cases, has a method answer them, and keeps every finished answer, so that a killed run goes on where it was."""

import json
import os
import subprocess
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import perf_counter

from evidence.answer import Answer
from evidence.generator.case import simulate
from evidence.generator.files import write_recordings
from evidence.generator.machines.draw import draw_machine_case
from evidence.generator.machines.files import write_machine_case
from evidence.generator.truth import Truth, describe
from evidence.kept import Job, Result, open_processes, read_results, run_jobs
from evidence.methods import METHODS
from evidence.rates import Entry
from evidence.suites import OTHER_MACHINES, draw_case
from slipstick.errors import InvalidValue
from slipstick.storage.files import replacing
from worker.cluster import Cluster
from worker.executors import explained

ROOT = Path(__file__).parents[1]
WORK = ROOT / "var" / "evidence"
"""Folder of case files and answers."""
RELATIVE = 1e-6
"""Tolerance of the integrator of the recordings."""


@dataclass(frozen=True)
class CaseFiles:
    """The files of a case: its bench, its recordings, and its truth, which no method sees."""

    folder: Path

    @property
    def is_of_clutch(self) -> bool:
        """Whether the case is one of a bench, and not of another machine."""
        return not self.folder.name.startswith(OTHER_MACHINES)

    @property
    def bench(self) -> Path:
        """The file that describes the machine."""
        return self.folder / ("bench.toml" if self.is_of_clutch else "machine.json")

    @property
    def recordings(self) -> Path:
        """The recordings."""
        return self.folder / ("recordings.h5" if self.is_of_clutch else "runs.h5")

    @property
    def truth(self) -> Truth:
        """What is hidden."""
        return Truth.from_json(json.loads(self.truth_file.read_text()))

    @property
    def truth_file(self) -> Path:
        """The file of the truth, beside the folder."""
        return self.folder.with_suffix(".truth.json")


def write_case(suite: str, seed: int, work: Path = WORK) -> CaseFiles:
    """Draw a case and write its files to the folder `work`, unless they are there."""
    files = CaseFiles(work / "cases" / f"{suite}-{seed}")
    if files.truth_file.exists():
        return files
    if files.is_of_clutch:
        case = draw_case(suite, seed)
        run = simulate(case, RELATIVE)
        truth = json.dumps(describe(case, run).to_json())
        files.folder.mkdir(parents=True, exist_ok=True)
        for path, write in ((files.bench, lambda path: path.write_text(case.bench.text)),
                            (files.recordings, lambda path: write_recordings(path, case, run)),
                            (files.truth_file, lambda path: path.write_text(truth))):
            with replacing(path) as part:  # another process may write the same ones; the truth is the last
                write(part)
    else:
        write_machine_case(files.folder, draw_machine_case(seed))
    return files


def answer_case(method: str, suite: str, seed: int, work: Path = WORK) -> Entry:
    """Draw a case and answer it; a method that raises has no finding, and its answer the error."""
    files = write_case(suite, seed, work)
    truth, began = files.truth, perf_counter()
    try:
        answer = METHODS[method](truth.case, files.bench, files.recordings)
    except Exception as error:  # is a result: a wrong one
        answer = Answer(truth.case, error=repr(error))
    return Entry(truth, replace(answer, seconds=round(perf_counter() - began, 1)))


def answer_cases(method: str, cases: Iterable[tuple[str, int]], dask: str | None = None,
                 work: Path = WORK) -> Iterator[Entry]:
    """Yield the entries of cases, given by suite and seed: those that are kept, then the others as they are answered.

    Answers of another version of the program are not kept. Cases are answered by two processes, or by the workers of
    the Dask scheduler at the address `dask`, each in a copy of this repository. Raises `InvalidValue` where these are
    gone.
    """
    def open_executor() -> Executor:
        return Cluster(dask, needs_one_thread=True) if dask else open_processes()

    version = name_commit()  # of the modules that are imported now
    if any(entry.version != version for entry in read_entries(method, work).values()):
        forget_entries(method, work)
    answer = partial(_answer_as_json, method, work, version)
    with explained():
        for _, result in run_jobs(answer, list(cases), _name_kept(method, work), open_executor):
            yield _entry(result)


def read_entries(method: str, work: Path = WORK) -> dict[Job, Entry]:
    """Return the entries that are kept of a method, by suite and seed."""
    return {case: _entry(result) for case, result in read_results(_name_kept(method, work)).items()}


def forget_entries(method: str, work: Path = WORK) -> None:
    """Delete the answers that are kept of a method."""
    _name_kept(method, work).unlink(missing_ok=True)


def _name_kept(method: str, work: Path) -> Path:
    return work / f"answers-{method}.jsonl"


def _answer_as_json(method: str, work: Path, version: str, suite: str, seed: int) -> Result:
    entry = answer_case(method, suite, seed, work)
    return {"version": version, "truth": entry.truth.to_json(), "answer": entry.answer.to_json()}


def _entry(result: Result) -> Entry:
    return Entry(Truth.from_json(result["truth"]), Answer.from_json(result["answer"]), result["version"])


def read_answers(path: Path, cases: Iterable[tuple[str, int]], work: Path = WORK) -> Iterator[Entry]:
    """Yield the entries of those cases that another program has answered, in a file as answer.py describes.

    Raises `InvalidValue` for a line that is no answer.
    """
    answers = {}
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        try:
            answer = Answer.from_json(json.loads(line))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidValue(f"Line {number} of {path} is no answer ({type(error).__name__}: {error})",
                               "Write a line of JSON for each case, as evidence/README.md shows") from error
        answers[answer.case] = answer
    for case in cases:
        truth = write_case(*case, work).truth
        if truth.case in answers:
            yield Entry(truth, answers[truth.case])


def name_commit(root: Path = ROOT) -> str:
    """Return the last commit that changed the core library, with a digest of what its files differ from it by.

    Answers of two states of the same checkout are then not those of each other. New files count, ignored ones do not.
    """
    def git(*arguments: str) -> bytes:
        return subprocess.run(["git", *arguments, "--", "slipstick"], cwd=root, capture_output=True, check=False).stdout

    differs = git("diff", "--binary", "--no-ext-diff", "--no-textconv", "HEAD")
    new = [os.fsdecode(name) for name in git("ls-files", "-z", "--others", "--exclude-standard").split(b"\0") if name]
    digest = sha256(differs)
    for name in new:
        digest.update(f"{name}\0{sha256((root / name).read_bytes()).hexdigest()}\0".encode())
    commit = git("log", "-1", "--format=%h").decode().strip()
    return f"{commit}+{digest.hexdigest()[:8]}" if differs or new else commit
