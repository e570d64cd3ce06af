"""Ctrl-C: a program ends in one line with exit status 130, and the processes that it has started without a word."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

STATUS = 128 + signal.SIGINT
"""Exit status of a program that Ctrl-C has ended, as shells have it."""


def exit_with(main: Callable[[], int]) -> NoReturn:
    """Run a program and end the process with its exit status, or with `STATUS` after Ctrl-C.

    Until `main` calls `interrupt_by_exception`, Ctrl-C ends the process on the spot: while modules are imported there
    is nothing to finish, and some of them catch every exception.
    """
    _handle(signal.default_int_handler, _end)
    try:
        status = main()
    except KeyboardInterrupt:
        _say()
        status = STATUS
    if status == STATUS:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # another Ctrl-C would print a traceback from the end of Python
        for child in multiprocessing.active_children():
            child.kill()
    sys.exit(status)


def interrupt_by_exception() -> None:
    """Let Ctrl-C raise `KeyboardInterrupt` from now on, so that files are closed and partial results kept."""
    _handle(_end, signal.default_int_handler)


@contextmanager
def unheard() -> Iterator[None]:
    """Start processes in the block that do not hear Ctrl-C, which a terminal sends to all processes of a program."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def leave_to_parent() -> None:
    """In a process that was started `unheard`: let the programs that it starts hear Ctrl-C, and still do nothing.

    A signal that is blocked or ignored is so in these programs, too; one with a handler is not.
    """
    signal.signal(signal.SIGINT, lambda number, frame: None)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _handle(before: object, handler: Callable[[int, FrameType | None], object]) -> None:
    """Exchange the handler of Ctrl-C, unless it is another one or, as for a program in the background, ignored."""
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is before:
        signal.signal(signal.SIGINT, handler)


def _end(number: int, frame: FrameType | None) -> NoReturn:
    _say()
    os._exit(STATUS)


def _say() -> None:
    with suppress(Exception):  # the signal may have come amid a print
        sys.stdout.flush()
    os.write(2, b"\nInterrupted.\n" if os.isatty(2) else b"Interrupted.\n")
