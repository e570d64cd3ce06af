"""The step of a build, which goes on where an earlier one of the same runs was stopped."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from slipstick.black_box import BlackBox
from slipstick.building.axes import Spans
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, LimitExceeded, UnknownName
from slipstick.interface.build import build
from slipstick.storage.library import Library
from slipstick.time_budget import clock_times, stage_times

from .computing import Report
from .executors import cluster_at
from .orders import Order, bench_of, require_same

_MOST_BY_DEFAULT = 100_000
"""Runs of a table of a machine where no axes are given: seconds to minutes for most simulators."""


def build_table(library: Library, report: Report, files: Sequence[BlackBox], dask: str | None,
                order: Order) -> dict[str, Any]:
    """The output of the job; `files` are the machines that the worker was given."""
    begin, file = clock_times(), _machine_of(files, order)
    axes = order["axes"] if file is None else _axes_of(file, order)
    recordings = None if order["recordings"] is None else library.recording(order["recordings"])
    if recordings is not None:
        require_same(order, "recordings", recordings.digest, "build")
    with cluster_at(dask, file) as executor:
        table = build(file or bench_of(library, order, "build"), axes,
                      model=None if order["model"] is None else Model.from_spec(order["model"]), conditions=recordings,
                      out=library.staged_table(order["name"]), accuracy=order["accuracy"], executor=executor,
                      progress=report.say)
    library.keep_staged_table(order["name"])
    locked, never_locked, failed = np.bincount(table.status.ravel(), minlength=3).tolist()
    return {"result": {"digest": table.digest, "shape": list(table.times.shape),
                       "statuses": {"locked": locked, "never_locked": never_locked, "failed": failed}},
            **stage_times({}, "build", begin)}


def _axes_of(file: BlackBox, order: Order) -> Spans:
    """The axes of a table of a machine, whose conditions the service does not know; raises `LimitExceeded`.

    By default those of all inputs, with so few points each that the runs are no more than `_MOST_BY_DEFAULT`.
    """
    inputs, conditions, most = file.description.inputs, len(file.cases), order["most_runs"]
    points_each = max(2, int((_MOST_BY_DEFAULT / conditions) ** (1 / len(inputs))))
    axes: Spans = order["axes"] or {entry.name: (entry.lower, entry.upper, min(points, points_each))
                                    for entry, points in zip(inputs, file.points, strict=True)}
    runs = conditions * math.prod(int(count) for *_, count in axes.values())
    if runs > most:
        raise LimitExceeded(f"The table has {runs:,} runs; the limit is {most:,}",
                            f"Give `axes` of fewer inputs ({', '.join(entry.name for entry in inputs)}) or with fewer "
                            "points, or let the administrator increase SLIPSTICK_BUILD_RUNS")
    return axes


def _machine_of(files: Sequence[BlackBox], order: Order) -> BlackBox | None:
    """The machine of the job, None for a bench; raises `InvalidValue` and `UnknownName`."""
    if order["machine"] is None:
        return None
    named = [file for file in files if file.description.title == order["machine"]]
    if not named:
        known = ", ".join(dict.fromkeys(file.description.title for file in files)) or "none"
        raise InvalidValue(f"This worker has no machine '{order['machine']}'; it has: {known}",
                           "Start it with `work --machine FILE`, the file of the machine")
    outputs = {file.description.output.name: file for file in named}
    output = order["output"] or next(iter(outputs))
    if output not in outputs:
        raise UnknownName.of("output", output, outputs)
    return outputs[output]
