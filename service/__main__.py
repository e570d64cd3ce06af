"""`python -m service`: serve the application at the configured address; `... token NAME ROLE`: make a token."""

from slipstick.interruption import exit_with


def main() -> int:
    """Serve until SIGTERM or Ctrl-C, or make a token."""
    from . import command_line  # takes half a second, in which Ctrl-C ends the program in one line too

    return command_line.main()


if __name__ == "__main__":
    exit_with(main)
