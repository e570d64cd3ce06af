"""The command line of the service: serve the application at the configured address, or make a token."""

import argparse
import gc
import socket
import sys
import textwrap

from pydantic import ValidationError

from slipstick import __version__
from slipstick.errors import InvalidValue, SlipstickError

from .settings import Settings
from .tokens import ROLES, new_token

_EXAMPLES = """\
examples:
  slipstick serve
  SLIPSTICK_PORT=9000 SLIPSTICK_LOG=json slipstick serve
  SLIPSTICK_HOST=0.0.0.0 SLIPSTICK_HOSTS=bench.example SLIPSTICK_TOKENS=tokens.txt slipstick serve

Jobs, such as fits and studies, also need a worker on the same job database: slipstick work
More: docs/settings.md, docs/operations.md, docs/rest.md"""
_WIDTH = 100
_SWITCH_SECONDS = 0.001
"""How long a thread may keep the others waiting: five threads that compute delay a response five times as long."""


def _description() -> str:
    """Return what the service does, and the address at which it would listen now."""
    try:
        settings = Settings()
    except ValidationError:  # of which the start tells
        settings = Settings.model_construct()
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)
    address = f"http://{f'[{host}]' if ':' in host else host}:{settings.port}"
    return ("Serve tables, recordings, fits and studies over REST until SIGTERM or Ctrl-C.\n\n"
            f"  {address}/       what the service holds and does\n"
            f"  {address}/docs   every operation, with examples to try\n")


def _epilog() -> str:
    """Return the settings with their defaults, and examples."""
    lines = ["settings (environment variables, with their defaults):"]
    for name, field in Settings.model_fields.items():
        default = "" if field.default is None else f" = {field.default}"
        lines.append(f"  SLIPSTICK_{name.upper()}{default}")
        lines += textwrap.wrap(field.description or "", _WIDTH, initial_indent=8 * " ", subsequent_indent=8 * " ")
    return "\n".join([*lines, "", _EXAMPLES])


def _require_address(settings: Settings) -> None:
    """Raise `InvalidValue` where the service cannot listen on its address, such as beside another one."""
    try:
        family, _, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        raise InvalidValue(f"The service cannot listen on {settings.host}, port {settings.port}: {error.strerror}",
                           "Set SLIPSTICK_PORT and SLIPSTICK_HOST to a free port of this machine") from None


def main() -> int:
    """Serve until SIGTERM or SIGINT, or make a token; return 1 for every `SlipstickError` and invalid setting."""
    parser = argparse.ArgumentParser(
        prog=f"python -m {__package__}", description=_description(), epilog=_epilog(),
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", action="version", version=f"Slipstick {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands (without one: serve)")
    token = commands.add_parser(
        "token", help="make a token for a user of the service", description="Make a token: its line of the token file "
        "on standard output, the token itself, which is shown this once, on standard error.",
        epilog="example: slipstick token alice run >> tokens.txt")
    token.add_argument("name", help="name of its owner, which appears in the log")
    token.add_argument("role", choices=ROLES, help="what its owner may do; each role includes those before it")
    arguments = parser.parse_args()
    try:
        if arguments.command == "token":
            secret, line = new_token(arguments.name, arguments.role)
            print(f"The token of {arguments.name} is shown this once:\n{secret}", file=sys.stderr)
            print(line)
        else:
            settings = Settings()
            _require_address(settings)
            gc.disable()  # all that is imported stays, and would be searched for garbage again and again
            from slipstick.storage.database import open_database

            from .server import make_server  # takes a second, which a token need not wait for

            open_database(settings.jobs).dispose()  # its error in one line, which the server would log as a traceback
            server = make_server(settings)
            gc.freeze()  # a full collection would look at all modules, and every request would wait for 0.1 s
            gc.enable()
            sys.setswitchinterval(_SWITCH_SECONDS)
            server.run()
    except SlipstickError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except ValidationError as error:
        for problem in error.errors():
            print(f"error: SLIPSTICK_{str(problem['loc'][0]).upper()} is invalid: {problem['msg']}. "
                  f"`python -m {__package__} --help` describes it.", file=sys.stderr)
        return 1
    return 0
