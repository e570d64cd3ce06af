"""What the tests of child processes let these compute."""

import json
import os
import signal
import time

from slipstick.errors import BadTable
from slipstick.numerics.quantities import unit_registry


def processes(_: bytes) -> bytes:
    return json.dumps([os.getpid(), os.getppid()]).encode()


def doubled(content: bytes) -> bytes:
    return 2 * content


def count_registries(_: bytes) -> bytes:
    return str(unit_registry.cache_info().currsize).encode()


def refuse(content: bytes) -> bytes:
    raise BadTable(content.decode(), "Build it again")


def crash(_: bytes) -> bytes:
    os.kill(os.getpid(), signal.SIGSEGV)
    raise AssertionError


def compute_for_ever(_: bytes) -> bytes:
    while True:
        pass


def sleep_for_ever(_: bytes) -> bytes:
    signal.alarm(1)  # instead of six times the limit
    time.sleep(1e6)
    raise AssertionError
