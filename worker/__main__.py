"""The command: `slipstick COMMAND`, or `python -m worker COMMAND` from the root of a checkout.

Each command is a module of this package with `add_arguments` and `run`, imported only when it runs.
"""

import argparse
import importlib
import keyword
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from slipstick import __version__
from slipstick.errors import SlipstickError, UnknownName, within_memory
from slipstick.extras import remedy_of
from slipstick.interruption import exit_with, interrupt_by_exception

from .program import program

GROUPS = {
    "first steps": {
        "demo": "show tables, fits, a study and the pages of the service on shipped recordings, within two minutes",
        "study": "identify the physical effect that recordings show and the model lacks, and measure the improvement",
        "import": "make recordings of the files of a data-acquisition system (MDF, MATLAB, CSV, Parquet), by a mapping",
        "bench": "write a template of a bench file (`new`), or check one and show what the bench does (`check`)",
        "machine": "write a template of any other machine (`new`), or check one and show what it does (`check`)"},
    "tables": {
        "build": "simulate a table of shifting times on a grid; the same command resumes a build that was interrupted",
        "surrogate": "train a neural-network table over any number of parameters on simulations at random points",
        "verify": "check the integrity of a table, describe it, and compare it with direct simulation",
        "simulate": "write recordings of a simulated bench, to see beforehand what a study of them would show"},
    "parameters": {
        "calibrate": "fit the uncertain parameters of a bench and their scatter from run to run to recordings",
        "fit": "fit mean and scatter of parameters to measured shifting times, on a table or by direct simulation",
        "likelihood": "compute the likelihood of recordings under a distribution of the inputs of a table",
        "propagate": "propagate uncertain inputs through a table: mean, std, quantiles and Sobol indices"},
    "service": {
        "serve": "start the REST service and its pages, with a worker if wanted (`--with-worker`)",
        "work": "run the jobs submitted to the service; interrupted jobs resume at the next start",
        "token": "make a token for a user of the service",
        "completion": "print the completion of commands and options for bash, zsh or fish"},
}
"""Group -> command -> description."""
COMMANDS = {name: description for group in GROUPS.values() for name, description in group.items()}
_FORMER = {"serve-jobs": "work"}
"""Former name of a command -> its name."""


def command() -> NoReturn:
    """The program `slipstick`."""
    exit_with(main)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 1 for every `SlipstickError`, and where files fail."""
    groups = [[f"{group}:", *(f"  {name:11} {description}" for name, description in names.items())]
              for group, names in GROUPS.items()]
    listing = "\n\n".join("\n".join(lines) for lines in groups)
    parser = argparse.ArgumentParser(
        prog=program(), usage="%(prog)s COMMAND ...",
        epilog=f"{listing}\n\n{program()} COMMAND --help lists the options of a command.",
        description="Find where the simulation of a machine and its test bench disagree, and which effect explains it.",
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", action="version", version=f"Slipstick {__version__}")
    parser.add_argument("command", metavar="COMMAND", help="one of the commands below")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    words = sys.argv[1:] if arguments is None else list(arguments)
    if not words:
        parser.print_help()
        return 0
    parsed = parser.parse_args(words)
    if parsed.command not in (*COMMANDS, *_FORMER):
        parser.error(str(UnknownName.of("command", parsed.command, COMMANDS)))
    try:
        given = command_parser(parsed.command).parse_args(parsed.arguments)
        interrupt_by_exception()
        with within_memory():
            return int(module_of(parsed.command).run(given))
    except SlipstickError as error:
        message = str(error)
    except ImportError as error:
        remedy = remedy_of(error)
        if remedy is None:
            raise
        message = remedy
    except OSError as error:  # such as a folder that cannot be written
        where = f" '{error.filename}'" if error.filename else ""
        message = f"{error.strerror or error}{where}"
    print(f"error: {message}", file=sys.stderr)
    return 1


def command_parser(name: str) -> argparse.ArgumentParser:
    """The parser of a command."""
    name = _FORMER.get(name, name)
    parser = argparse.ArgumentParser(prog=f"{program()} {name}", description=COMMANDS[name])
    module_of(name).add_arguments(parser)
    return parser


def module_of(name: str) -> Any:
    """The module of a command; that of a keyword of Python, such as `import`, ends in an underscore."""
    name = _FORMER.get(name, name)
    return importlib.import_module(f"{__package__}.{name}{'_' if keyword.iskeyword(name) else ''}")


if __name__ == "__main__":
    command()
