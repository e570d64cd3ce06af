"""`study`: identify the physical effect that recordings show and the model lacks, and measure the improvement."""

import argparse
import datetime
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.errors import InvalidValue
from slipstick.report.study.page import study_page
from slipstick.storage.files import replacing
from slipstick.study import study
from slipstick.study.comparison import Comparison, compare
from slipstick.study.conclusion import conclude
from slipstick.study.evidence import evidence as study_figure_data
from slipstick.study.progress import progress
from slipstick.study.settings import StudySettings
from worker.bench_option import add_bench_argument, open_recordings
from worker.clocks import clock_times, stage_times
from worker.study_text import study_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS", help="recordings, .h5 or .csv")
    parser.add_argument("--signals", type=Path, metavar="FILE",
                        help="the CSV file of the signals, if RECORDINGS is a CSV file")
    add_bench_argument(parser)
    parser.add_argument("--settings", type=Path, metavar="FILE.json",
                        help='JSON file with the study settings to change, such as {"shortlist": 4}')
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the result as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write the report, one HTML page with figures")
    parser.add_argument("--extended", type=Path, metavar="FILE.json",
                        help="write the model extended by the identified effects, for `build --model`")


def run(arguments: argparse.Namespace) -> int:
    """Study the recordings, print the result, and write the requested files."""
    for path, suffix in ((arguments.out, ".json"), (arguments.report, ".html"), (arguments.extended, ".json")):
        if path is not None:
            _require_suffix(path, suffix)
    settings = read_settings(arguments.settings) if arguments.settings else StudySettings()
    bench = Bench.open(arguments.bench)
    recordings = open_recordings(bench, arguments.recordings, arguments.signals)
    comparison = compare(bench, recordings, settings.shifting_time_noise)
    submitted = _now()
    output = study_output(settings, comparison)
    result = output["result"]
    print(study_text(result, output["figure_data"], settings.level))
    metadata = {"id": arguments.recordings.stem, "recordings": arguments.recordings.stem,
                "recordings_digest": recordings.digest, "settings": asdict(settings), "submitted": submitted,
                "ended": _now()}
    if arguments.out:
        saved = {name: output[name] for name in ("result", "seconds", "processor_seconds")}
        _write(arguments.out, json.dumps({**metadata, **saved}, indent=1) + "\n")
    if arguments.report:
        _write(arguments.report, study_page(metadata, output))
    if arguments.extended:
        _write(arguments.extended, json.dumps(result["models"]["after"], indent=1) + "\n")
    written = [str(path) for path in (arguments.out, arguments.report, arguments.extended) if path]
    if written:
        print(f"\nWrote {', '.join(written)}")
    if arguments.extended:
        print(f"Build a table of the extended model: python -m worker build --model {arguments.extended} "
              f"--conditions {arguments.recordings} --out tables/extended.h5")
    return 0


def study_output(settings: StudySettings, comparison: Comparison) -> dict[str, Any]:
    """Run a study, with its progress on stderr; return the output of a job: result, figure_data and times."""
    state: study.State | None = None
    times: dict[str, Any] = {}
    start = time.monotonic()
    while state is None or not study.finished(state):
        begin, stage = clock_times(), print_next_step(settings, state, start)
        state = study.start(settings, comparison) if state is None else study.advance(settings, comparison, state)
        times = stage_times(times, stage, begin)
    begin, stage = clock_times(), print_next_step(settings, state, start)
    result, figures = conclude(settings, comparison, state), study_figure_data(settings, comparison, state)
    return {"result": result, "figure_data": figures, **stage_times(times, stage, begin)}


def print_next_step(settings: StudySettings, state: study.State | None, start: float) -> str:
    """Print to stderr the time since `start` in s and the next step of the study; return the stage of that step."""
    current = progress(settings, state)
    descriptions = {
        "fit": "fitting the parameters and their run-to-run scatter without any effect",
        "screen": f"round {len(current['added']) + 1}: screening {current['effects']} effects",
        "candidates": f"fitting candidate {current['fitted'] + 1} of {current['candidates']}: "
                      + (effects.find(current["candidate"]).title if current["candidate"] else ""),
        "choose": "comparing the candidates on held-out conditions",
        "conclude": "computing the result",
    }
    print(f"{time.monotonic() - start:6.1f} s  {descriptions[current['stage']]}", file=sys.stderr, flush=True)
    return str(current["stage"])


def read_settings(path: Path) -> StudySettings:
    """Read settings from a JSON file; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return StudySettings.from_dict(content)
    except (OSError, ValueError, TypeError) as error:
        raise InvalidValue(f"Cannot read study settings from '{path}' ({type(error).__name__}: {error})",
                           'Give a JSON object, such as {"shortlist": 4, "level": 0.95}') from error


def _require_suffix(path: Path, suffix: str) -> None:
    """Raise `InvalidValue` for a path with another suffix: other files, such as recordings, must not be replaced."""
    if path.suffix != suffix or path.is_dir():
        raise InvalidValue(f"'{path}' is not the name of a {suffix} file", f"Give a path that ends in {suffix}")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(text)


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
