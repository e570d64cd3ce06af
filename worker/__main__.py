"""`python -m worker COMMAND`: each command is a module of this package with `add_arguments` and `run`."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from slipstick.errors import SlipstickError

COMMANDS = {
    "build": "simulate a table of shifting times; killed, the same command goes on where it was",
    "calibrate": "fit the seven uncertain parameters to recordings by least squares",
    "serve-jobs": "run the fits and studies that the service takes in; killed, it goes on where it was",
    "study": "name the physical effect that recordings show and the model lacks, and show the gap shrink",
    "surrogate": "train a table over any number of parameters on simulations at random points",
    "verify": "check a table, say what it is, and measure its interpolation against direct simulation",
}
"""Command -> what it does; `some-name` lives in worker/some_name.py, loaded only when asked for."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status, 1 for every error raised on purpose."""
    listed = "\n".join(f"  {name:12} {does}" for name, does in COMMANDS.items())
    parser = argparse.ArgumentParser(prog="python -m worker", epilog=f"commands:\n{listed}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="one of those below; COMMAND --help")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    command = importlib.import_module(f"worker.{chosen.command.replace('-', '_')}")
    own = argparse.ArgumentParser(prog=f"python -m worker {chosen.command}", description=COMMANDS[chosen.command])
    command.add_arguments(own)
    try:
        return int(command.run(own.parse_args(chosen.arguments)))
    except SlipstickError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
