"""The step of a calibration, of a bench or of a declared machine; each takes some seconds to some minutes."""

from typing import Any

from slipstick.clutch.model import Model
from slipstick.interface.calibrate import calibrate
from slipstick.machine import Machine
from slipstick.storage.library import Library
from slipstick.time_budget import clock_times, stage_times

from .computing import Report
from .executors import cluster_at
from .orders import Order, bench_of, require_same, runs_of, time_left


def calibrate_bench(library: Library, report: Report, order: Order) -> dict[str, Any]:
    """The output of the job; after its time budget, the iteration that runs is the last one."""
    begin, recordings = clock_times(), library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "calibration")
    start = None if order["model"] is None else Model.from_spec(order["model"])
    result = calibrate(bench_of(library, order, "calibration"), recordings, model=start, budget=time_left(order, {}),
                       progress=report.say)
    return {"result": result.to_dict(), **stage_times({}, "calibrate", begin)}


def calibrate_declared(library: Library, report: Report, machine: str, dask: str | None,
                       order: Order) -> dict[str, Any]:
    """The output of the job of a declared machine, of whose file this is the path, by a Dask scheduler if given."""
    begin, runs = clock_times(), runs_of(library, order, "calibration")
    with cluster_at(dask) as executor:
        result = calibrate(Machine.open(machine), runs, progress=report.say, executor=executor)
    return {"result": result.to_dict(), **stage_times({}, "calibrate", begin)}
