"""Answer real recordings, and replace the rows and the picture of their machines."""

import argparse
import importlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType

from evidence import real
from evidence.real import Row
from evidence.tables import replace_rows
from slipstick.engine.laws import list_candidates
from slipstick.engine.selection import Identification, identify

TABLE = Path(__file__).parents[1] / "real.csv"
PICTURES = Path(__file__).parent
HEADER = "machine", "variant", "what", "value", "standard error", "unit", "published"
MACHINES = "emps", "pneumatic_seals", "shaft_with_disturbances", "band_brake"
"""The modules, which are also the names of the folders."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer the recordings of the machines that the command names, or of all."""
    parser = argparse.ArgumentParser(prog="python -m evidence real", description=(real.__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder with a folder of recordings for each machine")
    parser.add_argument("machines", nargs="*", metavar="MACHINE", help=f"by default all of {', '.join(MACHINES)}")
    chosen = parser.parse_args(arguments)
    if unknown := set(chosen.machines) - set(MACHINES):
        parser.error(f"{', '.join(sorted(unknown))} is none of {', '.join(MACHINES)}")
    for name in chosen.machines or MACHINES:
        answer_machine(name, chosen.folder / name)
    return 0


def answer_machine(name: str, folder: Path) -> None:
    """Answer all variants of a machine, and replace its rows and its picture."""
    module, answers, rows = load(name), dict[str, Identification](), list[list[str]]()
    for variant, recorded in module.read(folder).items():
        answers[variant] = identify(recorded, log=lambda doing: print(doing.words, flush=True))
        rows += [[variant, each.what, f"{each.value:.4g}", _write(each.error, 2), each.unit, _write(each.published, 4)]
                 for each in (*describe(answers[variant]), *module.compare(variant, answers[variant]))]
    replace_rows(TABLE, HEADER, name, rows)
    if hasattr(module, "draw"):
        (PICTURES / f"{name}.svg").write_bytes(module.draw(answers))


def load(name: str) -> ModuleType:
    """Return the module of a machine."""
    return importlib.import_module(f"evidence.real.{name}")


def describe(answer: Identification) -> Iterator[Row]:
    """Yield what an answer names, and how much of it: rows that all machines have."""
    own = {part: model.own() for fit in answer.bare for part, model in fit.models.items()}
    yield Row("candidates", sum(len(list_candidates(fit.recorded, own)) for fit in answer.bare))
    yield Row("runs", len(answer.bare[0].recorded))
    yield Row("runs set aside", len(answer.set_aside))
    for finding in answer.findings:
        rivals = "".join(f", or {' over '.join(rival)}" for rival in finding.rivals)
        yield Row(f"named: {' over '.join(finding.pair)}{rivals}", finding.nats, None, "nats")
    yield Row("blocks with more than noise left", len(answer.unexplained))


def _write(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}g}"
