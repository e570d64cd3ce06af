"""The option `--bench`, and what follows from it for models and recordings."""

import argparse
import shlex
from pathlib import Path

from slipstick.bench import Bench
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from worker.model_file import read_model

DEFAULT = Path("tables/heavy.toml")


def add_bench_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option."""
    parser.add_argument("--bench", type=Path, default=DEFAULT, metavar="FILE.toml",
                        help="the bench: parameters, converter, sensors, current profiles and conditions "
                             "(default: %(default)s)")


def open_model(bench: Bench, path: Path | None) -> Model:
    """The model of the file at `path`, by default the nominal one; raises `InvalidValue` if it is of another bench."""
    model = read_model(path) if path else Model(bench.physics)
    bench.require(model.physics)
    return model


def open_recordings(bench: Bench, path: Path, signals: Path | None = None) -> Recordings:
    """Recordings of the bench; a CSV numbers the current profiles of the bench."""
    return Recordings.open(path, signals, bench.profiles)


def build_command(bench: Path, model: Path, *options: str) -> str:
    """The command that builds a table of the `model` of a bench, for a shell."""
    return shlex.join(["python", "-m", "worker", "build", "--bench", str(bench), "--model", str(model), *options])
