"""Which constants of the engine decide: each is halved and doubled, and the answers of four fixed cases are compared.

    python -m evidence.constants

These are the settings, and all other numbers and grids that modules of the engine name. What is between 0.5 and 1, as a
share or a correlation, has its distance from 1 halved and doubled. Rows of var/evidence/constants.csv are the constants
that change an answer (findings, ties, what is unexplained or set aside). Jobs that are done are lines of a file beside
it, so that a killed run goes on where it was.
"""

import ast
import importlib
import inspect
import os
import pkgutil
from dataclasses import fields, replace
from functools import partial
from multiprocessing import get_context
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported

import numpy as np

from evidence.answer import Answer
from evidence.engine_method import answer_by_engine
from evidence.kept import open_processes, run_jobs
from evidence.runner import WORK, name_commit, write_case
from evidence.tables import write_table
from slipstick import engine
from slipstick.engine.settings import EngineSettings

TABLE = WORK / "constants.csv"
CASES = ("other_machines", 2008), ("other_machines", 2012), ("other_machines", 2030), ("nothing_missing", 312)
"""Two tanks with a tie, with a finding, and without an effect, and a clutch without one, but with bad runs."""
FACTORS = 0.5, 2.0
SETTINGS = "settings"
_COMPILED = "_LANES"
"""Constants of compiled functions, which only tell how they are compiled."""


def list_constants() -> list[tuple[str, str]]:
    """Return the settings, and the numbers that modules define, as module and name."""
    constants = [(SETTINGS, each.name) for each in fields(EngineSettings)]
    for name, module in _modules().items():
        named = [target.id for node in ast.parse(inspect.getsource(module)).body if isinstance(node, ast.Assign)
                 for target in ast.walk(node.targets[0]) if isinstance(target, ast.Name)]
        constants += [(name, each) for each in named if each.isupper() and each != _COMPILED
                      and _is_number(vars(module)[each])]
    return constants


def run_job(module: str, name: str, factor: float) -> dict[str, Any]:
    """Return the answers with a constant multiplied by a factor."""
    settings = EngineSettings()
    if module == SETTINGS:
        settings = replace(settings, **{name: scale(getattr(settings, name), factor)})
        return {"answers": _answers(settings)}
    before = vars(_modules()[module])[name]
    holders = [each for each in _modules().values() if vars(each).get(name) is before]
    for each in holders:
        setattr(each, name, scale(before, factor))
    try:
        return {"answers": _answers(settings)}
    finally:
        for each in holders:
            setattr(each, name, before)


def scale(value: Any, factor: float) -> Any:
    """Return a number, or all of a grid, multiplied by a factor."""
    if isinstance(value, tuple):
        return tuple(scale(each, factor) for each in value)
    if isinstance(value, int):
        return max(1, round(value * factor))
    if isinstance(value, float) and 0.5 < value < 1:
        return 1 - (1 - value) / factor
    return value * factor


def _answers(settings: EngineSettings) -> list[str]:
    answers = []
    for suite, seed in CASES:
        files = write_case(suite, seed)
        try:
            answers.append(_words(answer_by_engine("", files.bench, files.recordings, settings)))
        except Exception as error:  # is another answer
            answers.append(repr(error))
    return answers


def _words(answer: Answer) -> str:
    findings = [f"{finding.pair} {sorted(finding.rivals)}" for finding in answer.findings]
    return f"{findings} {answer.unexplained} {answer.set_aside}"


def _modules() -> dict[str, Any]:
    return {each.name: importlib.import_module(f"{engine.__name__}.{each.name}")
            for each in pkgutil.iter_modules(engine.__path__)}


def _is_number(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_number, value))
    return isinstance(value, int | float | np.ndarray) and not isinstance(value, bool)


def main() -> None:
    """Answer the cases with each constant halved and doubled, and write the table."""
    constants = list_constants()
    jobs = [(*constants[0], 1.0), *((*constant, factor) for constant in constants for factor in FACTORS)]
    results = {}
    for job, result in run_jobs(run_job, jobs, WORK / f"constants-{name_commit()}.jsonl",
                                partial(open_processes, get_context("spawn"))):
        results[job] = result["answers"]
        print(f"{len(results)}/{len(jobs)} {job}", flush=True)
    usual = results[jobs[0]]
    rows = [(module, name, f"{factor:g}", f"{suite} {seed}") for module, name, factor in jobs[1:]
            for (suite, seed), answer, before in zip(CASES, results[module, name, factor], usual, strict=True)
            if answer != before]
    write_table(TABLE, ("module", "constant", "factor", "case whose answer changes"), rows)
    print(f"{len({row[:2] for row in rows})} of {len(constants)} constants change an answer")


if __name__ == "__main__":
    main()
