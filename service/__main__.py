"""`python -m service`: serve the application at the configured address; `... token NAME ROLE`: make a token."""

import sys

from slipstick.extras import remedy_of
from slipstick.interruption import exit_with


def main() -> int:
    """Serve until SIGTERM or Ctrl-C, or make a token; return 1 where the extra of the service is not installed."""
    try:
        from . import command_line  # takes half a second, in which Ctrl-C ends the program in one line too

        return command_line.main()  # which imports the server
    except ImportError as error:
        remedy = remedy_of(error)
        if remedy is None:
            raise
        print(f"error: {remedy}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    exit_with(main)
