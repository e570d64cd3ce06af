"""`token`: make a token for a user of the service, by the program of the service."""

import argparse
import subprocess
import sys

from .program import SERVICE


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("name", help="name of its owner, which appears in the log")
    parser.add_argument("role", choices=("read", "run", "admin"),
                        help="what its owner may do; each role includes those before it")


def run(arguments: argparse.Namespace) -> int:
    """Print the line of the token file on standard output, and the token on standard error."""
    return subprocess.run([sys.executable, "-m", SERVICE, "token", arguments.name, arguments.role],
                          check=False).returncode
