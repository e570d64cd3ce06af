"""`python -m service`: serve the application at the configured address; `... token NAME ROLE`: make a token."""

import argparse
import sys

from service.tokens import ROLES, new_token
from slipstick.errors import SlipstickError


def main() -> int:
    """Serve until SIGTERM or SIGINT, or make a token; return 1 for every `SlipstickError`."""
    parser = argparse.ArgumentParser(prog="python -m service", description="Serve tables, recordings, fits and studies "
                                     "over REST. docs/settings.md lists the settings, which are environment variables.")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    token = commands.add_parser("token", help="make a token, instead of serving: its line of the token file on "
                                "standard output, the token itself on standard error")
    token.add_argument("name", help="name of its owner, which appears in the log")
    token.add_argument("role", choices=ROLES, help="what its owner may do; each role includes those before it")
    arguments = parser.parse_args()
    try:
        if arguments.command == "token":
            secret, line = new_token(arguments.name, arguments.role)
            print(f"The token of {arguments.name} is shown this once:\n{secret}", file=sys.stderr)
            print(line)
        else:
            from service.server import make_server  # takes seconds, which a token need not wait for
            from service.settings import Settings
            from slipstick.storage.database import open_database

            settings = Settings()
            open_database(settings.jobs).dispose()  # its error in one line, which the server would log as a traceback
            make_server(settings).run()
    except SlipstickError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
