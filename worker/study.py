"""`study`: find, name, add and show the physical effect that recordings show and the model lacks."""

import argparse
import datetime
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipstick.bench import Bench
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.report.study.page import study_page
from slipstick.storage.files import replacing
from slipstick.studies import StudyResult, StudySettings, conclude, examine, unconfirmed
from slipstick.studies.export import file_stem, has_table, law_csv, law_mat
from slipstick.studies.progress import Log, StudyProgress
from slipstick.studies.record import figures_from_dict, result_from_dict
from slipstick.time_budget import TimeBudgetEnded

from .bench_option import add_bench_argument, command_line, open_recordings
from .orders import add_time_budget_argument, clock_times, stage_times
from .study_text import study_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS", help="recordings with signals, .h5 or .csv")
    parser.add_argument("--signals", type=Path, metavar="FILE",
                        help="the CSV file of the signals, if RECORDINGS is a CSV file")
    add_bench_argument(parser)
    parser.add_argument("--settings", type=Path, metavar="FILE.json",
                        help='JSON file with the study settings to change, such as {"level": 0.95}')
    add_time_budget_argument(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the result as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write the report, one HTML page with figures")
    parser.add_argument("--extended", type=Path, metavar="FILE.json",
                        help="write the model extended by what was found, for `build --model`")
    parser.add_argument("--laws", type=Path, metavar="DIR",
                        help="write each measured law as a CSV and a MATLAB file into this folder")


def run(arguments: argparse.Namespace) -> int:
    """Study the recordings, print the result, and write the requested files."""
    for path, suffix in ((arguments.out, ".json"), (arguments.report, ".html"), (arguments.extended, ".json")):
        if path is not None:
            _require_suffix(path, suffix)
    if arguments.laws is not None and arguments.laws.exists() and not arguments.laws.is_dir():
        raise InvalidValue(f"'{arguments.laws}' is a file", "Give --laws the name of a folder")
    settings = read_settings(arguments.settings) if arguments.settings else StudySettings()
    bench = Bench.open(arguments.bench)
    recordings = open_recordings(bench, arguments.recordings, arguments.signals)
    submitted = _now()
    output = study_output(settings, bench, recordings, arguments.time_budget)
    result = result_from_dict(output["result"])
    print(study_text(result, figures_from_dict(output["figure_data"]), settings))
    metadata = {"id": arguments.recordings.stem, "recordings": arguments.recordings.stem,
                "recordings_digest": recordings.digest, "settings": asdict(settings), "submitted": submitted,
                "ended": _now()}
    written = [path for path in (arguments.out, arguments.report, arguments.extended if result.after else None) if path]
    if arguments.out:
        saved = {name: output[name] for name in ("result", "seconds", "processor_seconds")}
        _write(arguments.out, json.dumps({**metadata, **saved}, indent=1) + "\n")
    if arguments.report:
        _write(arguments.report, study_page(metadata, output))
    if arguments.extended and result.after:
        _write(arguments.extended, json.dumps(result.after.model, indent=1) + "\n")
    if arguments.laws:
        written += write_laws(result, arguments.laws)
    if written:
        print(f"\nWrote {', '.join(map(str, written))}")
    if arguments.extended and not result.after:
        raise TimeBudgetEnded.before(arguments.time_budget, "there was an extended model, which was not written")
    if arguments.extended:
        print("Build a table of the extended model: "
              + command_line("build", "--bench", arguments.bench, "--model", arguments.extended,
                             "--conditions", arguments.recordings, "--out", "tables/extended.h5"))
    return 0


def study_output(settings: StudySettings, bench: Bench, recordings: Recordings, budget: float) -> dict[str, Any]:
    """Run a study within a time `budget` in s, with its progress on stderr.

    Return the output of a job: result, figure_data and times as JSON. Raises `TimeBudgetEnded` if the study has nothing
    to show by then.
    """
    log, named, stage, times, begin = progress(budget), dict[str, Any](), "name", dict[str, Any](), clock_times()
    try:
        named = examine(settings, bench, recordings, log, named.update)
        times, stage, begin = stage_times({}, "name", begin), "confirm", clock_times()
        result, figures = conclude(settings, bench, recordings, named, log)
    except _TimeEnded:
        result, figures = unconfirmed(settings, bench, recordings, named or None, budget)
    return {"result": asdict(result), "figure_data": asdict(figures), **stage_times(times, stage, begin)}


class _TimeEnded(Exception):
    """The time budget of the command has ended."""


def progress(budget: float) -> Log:
    """A function that prints the progress and the time since now in s to stderr.

    Its call after the time `budget` in s ends what calls it.
    """
    start = time.monotonic()

    def log(progress: StudyProgress) -> None:
        if time.monotonic() > start + budget:
            raise _TimeEnded
        print(f"{time.monotonic() - start:6.1f} s  step {progress.step} of {progress.steps}: {progress.doing}",
              file=sys.stderr, flush=True)

    return log


def write_laws(result: StudyResult, folder: Path) -> list[Path]:
    """Write the laws over a number as CSV and MATLAB files; return their paths."""
    written = []
    for number, one in enumerate(result.findings, 1):
        if has_table(one):
            path = folder / f"{number}_{file_stem(one)}"
            for suffix, content in ((".csv", law_csv(one).encode()), (".mat", law_mat(one))):
                _write_bytes(path.with_suffix(suffix), content)
                written.append(path.with_suffix(suffix))
    return written


def read_settings(path: Path) -> StudySettings:
    """Read settings from a JSON file; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return StudySettings.from_dict(content)
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise InvalidValue(f"Cannot read study settings from '{path}' ({type(error).__name__}: {error})",
                           'Give a JSON object, such as {"level": 0.95, "seed": 2}') from error


def _require_suffix(path: Path, suffix: str) -> None:
    """Raise `InvalidValue` for a path with another suffix: other files, such as recordings, must not be replaced."""
    if path.suffix != suffix or path.is_dir():
        raise InvalidValue(f"'{path}' is not the name of a {suffix} file", f"Give a path that ends in {suffix}")


def _write(path: Path, text: str) -> None:
    _write_bytes(path, text.encode())


def _write_bytes(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
