"""`python -m worker COMMAND`: each command is a module of this package with `add_arguments` and `run`."""

import argparse
import importlib
import keyword
import sys
from collections.abc import Sequence

from slipstick.errors import SlipstickError
from slipstick.interruption import exit_with, interrupt_by_exception

COMMANDS = {
    "bench": "write a template of a bench file (`new`), or check one and show what the bench does (`check`)",
    "build": "simulate a table of shifting times on a grid; after an interruption the same command resumes the build",
    "calibrate": "fit the uncertain parameters of a bench and their scatter from run to run to recordings",
    "import": "make recordings of the files of a data-acquisition system (MDF, MATLAB, CSV, Parquet), by a mapping",
    "serve-jobs": "run the fits and studies submitted to the service; interrupted jobs resume at the next start",
    "simulate": "write recordings of a simulated bench, with noise, scatter and effects, to study what they would show",
    "study": "identify the physical effect that recordings show and the model lacks, and measure the improvement",
    "surrogate": "train a neural-network table over any number of parameters on simulations at random points",
    "verify": "check the integrity of a table, describe it, and compare it with direct simulation",
}
"""Command -> description. The command `some-name` is the module worker/some_name.py, imported only when it runs; the
module of a command that is a keyword of Python, such as `import`, ends in an underscore."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 1 for every `SlipstickError`, and where files or memory fail."""
    listing = "\n".join(f"  {name:12} {description}" for name, description in COMMANDS.items())
    parser = argparse.ArgumentParser(prog="python -m worker", epilog=f"commands:\n{listing}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND",
                        help="one of the commands below; COMMAND --help lists its options")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    parsed = parser.parse_args(arguments)
    module = parsed.command.replace("-", "_")
    command = importlib.import_module(f"{__package__}.{module}{'_' if keyword.iskeyword(module) else ''}")
    command_parser = argparse.ArgumentParser(prog=f"python -m worker {parsed.command}",
                                             description=COMMANDS[parsed.command])
    command.add_arguments(command_parser)
    parsed = command_parser.parse_args(parsed.arguments)
    interrupt_by_exception()
    try:
        return int(command.run(parsed))
    except SlipstickError as error:
        print(f"error: {error}", file=sys.stderr)
    except OSError as error:  # such as a folder that cannot be written
        where = f" '{error.filename}'" if error.filename else ""
        print(f"error: {error.strerror or error}{where}", file=sys.stderr)
    except MemoryError as error:
        print(f"error: There is not enough memory: {error}. Give fewer points, runs or axes.", file=sys.stderr)
    return 1


if __name__ == "__main__":
    exit_with(main)
