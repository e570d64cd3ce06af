"""The option `--bench`, and what follows from it for models and recordings."""

import argparse
import json
import os
import shlex
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, open_conditions

DEFAULT = Path("tables/heavy.toml")


def add_bench_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option."""
    parser.add_argument("--bench", type=bench_file, default=DEFAULT, metavar="FILE.toml",
                        help="the bench: parameters, converter, sensors, current profiles and conditions; a name "
                             "without a folder may be that of a bench of the service (default: %(default)s)")


def bench_file(text: str) -> Path:
    """The file that the option names: the one at this path, or else, for a name, the one in the folder of tables."""
    path = Path(text)
    if os.sep in text or path.is_file():
        return path
    return library_folder() / f"{text.removesuffix('.toml')}.toml"


def library_folder() -> Path:
    """The folder of the benches, tables and recordings of the service."""
    return Path(os.environ.get("SLIPSTICK_TABLES", "tables"))


def add_simulated_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is simulated: the options `--bench`, `--model` and `--conditions`."""
    add_bench_argument(parser)
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="the model to simulate, as written by `calibrate --out` or `study --extended` "
                             "(default: the nominal parameters of the bench)")
    parser.add_argument("--conditions", type=Path, metavar="FILE",
                        help="recordings whose conditions to simulate (default: the conditions of the bench)")


def open_simulated(arguments: argparse.Namespace) -> tuple[Bench, Model, Conditions]:
    """The bench, the model and the conditions of these options; raises `InvalidValue`."""
    bench = Bench.open(arguments.bench)
    conditions = open_conditions(arguments.conditions, bench.profiles) if arguments.conditions else bench.conditions
    return bench, open_model(bench, arguments.model), conditions


def open_model(bench: Bench, path: Path | None) -> Model:
    """The model of the file at `path`, by default the nominal one; raises `InvalidValue` if it is of another bench."""
    model = read_model(path) if path else Model(bench.physics)
    bench.require(model.physics)
    return model


def open_recordings(bench: Bench, path: Path, signals: Path | None = None) -> Recordings:
    """Recordings of the bench; a CSV numbers the current profiles of the bench."""
    return Recordings.open(path, signals, bench.profiles)


def command_line(*words: str | Path) -> str:
    """A command of the worker, for a shell."""
    return shlex.join(["python", "-m", "worker", *map(str, words)])


def read_model(path: Path) -> Model:
    """Model from a JSON file, at its top level or under "model"; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return Model.from_spec(content.get("model", content))
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise InvalidValue(f"Cannot read a model from '{path}' ({type(error).__name__}: {error})",
                           "Give the JSON that `calibrate --out` or `study --extended` writes") from error
