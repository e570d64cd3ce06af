"""The option `--bench`, and what follows from it for models and recordings."""

import argparse
import os
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.interface.models import model_of
from slipstick.machine import holds_runs
from slipstick.recordings import Recordings, open_conditions
from slipstick.storage.shipped import file_of

DEFAULT = "heavy"


def add_bench_argument(parser: argparse._ActionsContainer, default: str | None = DEFAULT) -> None:
    """Add the option; without a default, `open_bench` tells whether it is given."""
    parser.add_argument("--bench", type=bench_file, default=default, metavar="FILE.toml",
                        help="the bench: parameters, converter, sensors, current profiles and conditions; a name "
                             "without a folder is that of a bench of the service, or of a shipped one (default: "
                             f"{DEFAULT})")


def open_bench(arguments: argparse.Namespace) -> Bench:
    """The bench of the option, the default one where it is not given."""
    return Bench.open(arguments.bench or bench_file(DEFAULT))


def add_bench_or_machine_argument(parser: argparse.ArgumentParser) -> None:
    """Add the options `--bench` and `--machine`, of which only one can be given."""
    either = parser.add_mutually_exclusive_group()
    add_bench_argument(either)
    either.add_argument("--machine", type=Path, metavar="FILE.py",
                        help="instead of a bench, the Python file that declares a machine (see `machine new`), or the "
                             "name of a shipped one, such as dc_motor; it is run")


def refuse_bench_options(arguments: argparse.Namespace, **usual: object) -> None:
    """Raise `InvalidValue` for options that are about a bench, beside a declared machine, and have no `usual` value."""
    for name, value in usual.items():
        if getattr(arguments, name) != value:
            raise InvalidValue(f"--{name} is about a bench, not about a declared machine", "Leave it out")


def refuse_machine(arguments: argparse.Namespace) -> None:
    """Raise `InvalidValue` for the option `--machine` beside a table of a clutch."""
    if arguments.machine is not None:
        raise InvalidValue("--machine declares another machine, and the table is of a clutch", "Leave it out")


def bench_file(text: str) -> Path:
    """The file that the option names: at this path, or for a name in the folder of tables, or a shipped one."""
    path = Path(text)
    if os.sep in text or path.is_file():
        return path
    kept = library_folder() / f"{text.removesuffix('.toml')}.toml"
    return kept if kept.is_file() else file_of(text, ".toml")


def library_folder() -> Path:
    """The folder of the benches, tables and recordings of the service."""
    return Path(os.environ.get("SLIPSTICK_TABLES", "tables"))


def add_simulated_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is simulated of a bench: the options `--model` and `--conditions`."""
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="the model to simulate, as written by `calibrate --out` or `study --extended` "
                             "(default: the nominal parameters of the bench)")
    parser.add_argument("--conditions", type=Path, metavar="FILE",
                        help="recordings whose conditions to simulate (default: the conditions of the bench)")


def open_simulated(arguments: argparse.Namespace) -> tuple[Bench, Model, Conditions]:
    """The bench, the model and the conditions of these options; raises `InvalidValue`."""
    bench = Bench.open(arguments.bench)
    conditions = open_conditions(arguments.conditions, bench.profiles) if arguments.conditions else bench.conditions
    return bench, model_of(bench, arguments.model), conditions


def open_recordings(bench: Bench, path: Path, signals: Path | None = None) -> Recordings:
    """Recordings of the bench; a CSV numbers the current profiles of the bench."""
    if path.is_file() and holds_runs(path):
        raise InvalidValue(f"'{path.name}' has runs of a declared machine", "Give its file as --machine FILE.py")
    return Recordings.open(path, signals, bench.profiles)
