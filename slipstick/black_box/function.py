"""A Python callable as simulator: one number for one point under one condition, all arguments by name."""

import hashlib
import importlib
import importlib.machinery
import importlib.util
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from slipstick.black_box.cases import Cases
from slipstick.errors import InvalidValue


class NoResult(Exception):
    """A run failed; the text is the reason."""


@dataclass(frozen=True)
class Function:
    """The function `reference`, "module:function", of a module in `folder` or of an installed one.

    It is called with every input and every column of the conditions by name, in their units, and returns the output;
    None or NaN if there is none. A call that takes more than `timeout` s fails.
    """

    reference: str
    folder: str
    timeout: float

    @property
    def identity(self) -> str:
        """The function and the digest of its source, so that results of another version are not mixed with its own.

        Raises `InvalidValue` if there is no such module.
        """
        digest = hashlib.sha256(self._find_source().read_bytes()).hexdigest()
        return f"Python callable {self.reference}, source {digest}"

    def _find_source(self) -> Path:
        """The file of the module: in the folder, also where one of its name was imported from another, or installed."""
        module = self.reference.partition(":")[0]
        self._add_folder()
        try:
            beside = importlib.machinery.PathFinder.find_spec(module, [str(Path(self.folder, *module.split(".")[:-1]))])
            spec = beside or importlib.util.find_spec(module)
        except (ImportError, ValueError) as error:
            raise _loading_error(self.reference, str(error)) from error
        if spec is None or not spec.origin or not Path(spec.origin).is_file():
            raise _loading_error(self.reference, f"there is no module '{module}' in {self.folder} or installed")
        return Path(spec.origin)

    def run(self, inputs: Mapping[str, float], cases: Cases) -> list[float | NoResult]:
        """The output under each of the n conditions, NaN where there is none; raises `InvalidValue`."""
        function = self._load()
        names = [quantity.name for quantity in cases.quantities]
        return [self._call(function, {**inputs, **dict(zip(names, row.tolist(), strict=True))})
                for row in cases.values]

    def _call(self, function: Callable[..., Any], arguments: Mapping[str, float]) -> float | NoResult:
        try:
            with limit_time(self.timeout):
                value = function(**arguments)
            return np.nan if value is None else float(value)
        except Exception as error:
            return NoResult(f"{type(error).__name__}: {error}")

    def _load(self) -> Callable[..., Any]:
        module, _, name = self.reference.partition(":")
        self._add_folder()
        try:
            function = getattr(importlib.import_module(module), name)
        except Exception as error:
            raise _loading_error(self.reference, f"{type(error).__name__}: {error}") from error
        if not callable(function):
            raise _loading_error(self.reference, "it is not callable")
        loaded: Callable[..., Any] = function
        return loaded

    def _add_folder(self) -> None:
        if self.folder not in sys.path:
            sys.path.insert(0, self.folder)  # stays, because the function may import further modules when it runs


def _loading_error(reference: str, reason: str) -> InvalidValue:
    return InvalidValue(f"The callable '{reference[:100]}' cannot be loaded: {reason}",
                        'Write callable = "module:function", with the module beside the file of the machine')


@contextmanager
def limit_time(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` in the block after `seconds` s, in a main thread, as that of a worker is."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"no result within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
