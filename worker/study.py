"""`study`: name the physical effect that recordings show and the model lacks, and show what adding it does."""

import argparse
import datetime
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipstick.clutch import effects
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.report.study.page import study_page
from slipstick.storage.files import replacing
from slipstick.study import study
from slipstick.study.comparison import Comparison, compare
from slipstick.study.conclusion import conclude
from slipstick.study.evidence import evidence
from slipstick.study.progress import progress
from slipstick.study.settings import StudySettings
from worker.clocks import clocks, spent
from worker.study_text import page


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line."""
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS", help="what was measured, .h5 or .csv")
    parser.add_argument("--signals", type=Path, metavar="FILE", help="the CSV of the signals that go with a CSV")
    parser.add_argument("--settings", type=Path, metavar="FILE.json",
                        help='settings of the study, such as {"shortlist": 4} (default: those for all recordings)')
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the result as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write the report: one page with pictures")
    parser.add_argument("--extended", type=Path, metavar="FILE.json",
                        help="write the model with what was found added, for `build --model`")


def run(arguments: argparse.Namespace) -> int:
    """Study the recordings, print the answer, and write what was asked for."""
    for path, ending in ((arguments.out, ".json"), (arguments.report, ".html"), (arguments.extended, ".json")):
        if path is not None:
            _require_place(path, ending)
    settings = read_settings(arguments.settings) if arguments.settings else StudySettings()
    recordings = Recordings.open(arguments.recordings, arguments.signals)
    compared = compare(recordings, settings.shifting_time_noise)
    submitted = _now()
    output = studied(settings, compared)
    result = output["result"]
    print(page(result, output["figure_data"], settings.level))
    told = {"id": arguments.recordings.stem, "recordings": arguments.recordings.stem,
            "recordings_digest": recordings.digest, "settings": asdict(settings), "submitted": submitted,
            "ended": _now()}
    if arguments.out:
        kept = {name: output[name] for name in ("result", "seconds", "processor_seconds")}
        _write(arguments.out, json.dumps({**told, **kept}, indent=1) + "\n")
    if arguments.report:
        _write(arguments.report, study_page(told, output))
    if arguments.extended:
        _write(arguments.extended, json.dumps(result["models"]["after"], indent=1) + "\n")
        print(f"\nBuild the table of the extended model with `python -m worker build --model {arguments.extended} "
              f"--conditions {arguments.recordings} --out tables/extended.h5`")
    return 0


def studied(settings: StudySettings, compared: Comparison) -> dict[str, Any]:
    """Run a study with a word on stderr at every step; return what a job leaves: result, figure_data and times."""
    state: study.State | None = None
    times: dict[str, Any] = {}
    first = time.monotonic()
    while state is None or not study.finished(state):
        begun, stage = clocks(), say(settings, state, first)
        state = study.start(settings, compared) if state is None else study.advance(settings, compared, state)
        times = spent(times, stage, begun)
    begun, stage = clocks(), say(settings, state, first)
    result, shown = conclude(settings, compared, state), evidence(settings, compared, state)
    return {"result": result, "figure_data": shown, **spent(times, stage, begun)}


def say(settings: StudySettings, state: study.State | None, first: float) -> str:
    """Tell on stderr what the next step does, and how long after `first` it begins; return its stage."""
    at = progress(settings, state)
    words = {
        "fit": "fitting parameters and their scatter without any effect",
        "screen": f"round {len(at['added']) + 1}: screening {at['effects']} effects",
        "candidates": f"candidate {at['fitted'] + 1} of {at['candidates']}: "
                      + (effects.find(at["candidate"]).title if at["candidate"] else ""),
        "choose": "comparing the candidates on held-out conditions",
        "conclude": "putting the result together",
    }
    print(f"{time.monotonic() - first:6.1f} s  {words[at['stage']]}", file=sys.stderr, flush=True)
    return str(at["stage"])


def read_settings(path: Path) -> StudySettings:
    """Read settings from a JSON file; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return StudySettings.from_dict(content)
    except (OSError, ValueError, TypeError) as error:
        raise InvalidValue(f"'{path}' holds no settings of a study ({type(error).__name__}: {error})",
                           'Give a JSON object, such as {"shortlist": 4, "level": 0.95}') from error


def _require_place(path: Path, ending: str) -> None:
    """Raise `InvalidValue` where a result could not be written, or would replace something else, such as recordings."""
    if path.suffix != ending or path.is_dir():
        raise InvalidValue(f"'{path}' is no name for a {ending} file", f"Give a path that ends in {ending}")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(text)


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
