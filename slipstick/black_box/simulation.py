"""Runs of a simulator: at many points under all conditions, here or in workers."""

import multiprocessing
import os
import threading
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import TypeVar

import numpy as np

from slipstick import interruption
from slipstick.black_box.bridge import Bridge
from slipstick.black_box.cases import Cases
from slipstick.black_box.declared import Declared
from slipstick.black_box.function import Function, NoResult
from slipstick.black_box.reader import BlackBox
from slipstick.errors import InvalidValue

T = TypeVar("T", float, np.ndarray)
DONE, NONE, FAILED = 0, 1, 2
"""Statuses of a run, with the numbers of a table: an output, no output (None or NaN), or an error or timeout."""
OUTCOMES = {DONE: "with an output", NONE: "without an output", FAILED: "failed"}


@dataclass(frozen=True, eq=False)
class Simulation:
    """The simulator of a `file` over multiples of the inputs `axes`; the other inputs are nominal."""

    file: BlackBox
    axes: tuple[str, ...]

    def simulate(self, points: np.ndarray, cases: Cases) -> tuple[np.ndarray, np.ndarray]:
        """Outputs and statuses (m, n) at the points (m, d), one after the other.

        Raises `InvalidValue` also if the simulator, here, is not that of the machine.
        """
        if self.file.simulator.identity != self.file.description.simulator:
            raise InvalidValue("The source of the Python callable differs from that of the machine's file, or has "
                               "changed", "Give all machines the same source, and repeat the command")
        if isinstance(self.file.simulator, Declared):
            outputs = self.file.simulator.evaluate(self._inputs(points.T, np.ones(len(points))), cases)
            defined = np.isfinite(outputs)
            return np.where(defined, outputs, np.nan), np.where(defined, DONE, NONE).astype(np.uint8)
        outputs = np.full((len(points), len(cases)), np.nan)
        status = np.full(outputs.shape, NONE, np.uint8)
        for row, point in enumerate(points):
            for column, result in enumerate(self._run(point, cases)):
                if isinstance(result, NoResult):
                    status[row, column] = FAILED
                elif np.isfinite(result):
                    outputs[row, column], status[row, column] = result, DONE
        return outputs, status

    def reason(self, point: np.ndarray, cases: Cases, row: int) -> str:
        """Why the run of condition `row` fails at a point (d,)."""
        result = self._run(point, cases.take([row]) if self._by_condition else cases)[0 if self._by_condition else row]
        return str(result) if isinstance(result, NoResult) else "the run does not fail when it is repeated"

    def require_working(self, cases: Cases) -> None:
        """Raise `InvalidValue` if the simulator fails at the nominal values, under the first condition."""
        point = np.array([np.clip(1.0, self.file.description.input(name).lower, self.file.description.input(name).upper)
                          for name in self.axes])
        result = self._run(point, cases.take([0]) if self._by_condition else cases)[0]
        if isinstance(result, NoResult):
            raise InvalidValue(f"The simulator fails at the nominal values for {cases.described(0)}: {result}",
                               "Correct it, or its arguments and timeout in the file of the machine")

    @property
    def _by_condition(self) -> bool:
        """Whether single conditions can be simulated."""
        simulator = self.file.simulator
        columns = {quantity.name for quantity in self.file.description.columns}
        return not isinstance(simulator, Bridge) or any(columns.intersection(vector) for vector in simulator.arguments)

    def _run(self, point: np.ndarray, cases: Cases) -> Sequence[float | NoResult]:
        return self.file.simulator.run(self._inputs(point.tolist(), 1.0), cases)

    def _inputs(self, multiples: Iterable[T], nominal: T) -> dict[str, T]:
        """All inputs, in their units, at multiples along the axes; those of the others are `nominal`."""
        along = dict(zip(self.axes, multiples, strict=True))
        return {entry.name: entry.nominal * along.get(entry.name, nominal) for entry in self.file.description.inputs}


class Workers:
    """`count` workers that run simulations of a `file`: processes or threads, as of `start_executor`.

    By default they are on this machine, and start when they are needed; `executor` is `count` others.
    """

    def __init__(self, file: BlackBox, count: int, executor: Executor | None = None) -> None:
        self.file, self.count, self._executor = file, count, executor

    @property
    def executor(self) -> Executor:
        """What runs the simulations, which this starts."""
        if self._executor is None:
            self._executor = start_executor(self.file, self.count)
        return self._executor

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, *_: object) -> None:
        """End the workers that have started."""
        if self._executor is not None:
            self._executor.shutdown()

    def simulate(self, axes: tuple[str, ...], points: np.ndarray, cases: Cases) -> tuple[np.ndarray, np.ndarray]:
        """As `Simulation.simulate`, in the workers; raises `InvalidValue` also if one of them is killed."""
        simulation = Simulation(self.file, axes)
        simulator, count = self.file.simulator, 4 * self.count
        if isinstance(simulator, Declared):
            count = len(points) * len(cases) // simulator.most_runs + 1
            if count == 1 and self._executor is None:  # a process takes a second to start
                return simulation.simulate(points, cases)
        parts = np.array_split(points, max(1, min(len(points), count)))
        try:
            results = list(self.executor.map(simulation.simulate, parts, [cases] * len(parts)))
        except BrokenProcessPool as error:
            self._executor = None
            raise killed() from error
        return np.concatenate([outputs for outputs, _ in results]), np.concatenate([status for _, status in results])


def killed() -> InvalidValue:
    """The error of a worker that ended, as by a segmentation fault or for lack of memory."""
    return InvalidValue("A process of the simulator was killed or crashed",
                        "Correct what ends it, such as a lack of memory; the same command resumes a build")


def start_executor(file: BlackBox, count: int) -> Executor:
    """`count` processes for a Python callable or a declared machine, threads for others, which have processes.

    A single one is a thread for a declared machine, too: no time limit ends its runs.
    """
    if not isinstance(file.simulator, Function | Declared) or (count == 1 and isinstance(file.simulator, Declared)):
        return ThreadPoolExecutor(count)
    return start_processes(count)


def start_processes(count: int) -> ProcessPoolExecutor:
    """`count` processes that run functions in their main thread and end with this process.

    Signals, which end a call that takes too long, reach the main thread of a process only.
    """
    executor = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _end_with_parent, (os.getpid(),))
    resource_tracker.ensure_running()  # when it starts, it unblocks the signal
    with interruption.unheard():
        for _ in range(count):
            executor.submit(os.getpid)  # starts a process
    return executor


def _end_with_parent(parent: int) -> None:
    """End this process when its parent has ended, which a killed one does not tell; Ctrl-C is for the parent."""
    interruption.leave_to_parent()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
