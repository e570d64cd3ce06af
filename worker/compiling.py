"""What is compiled on its first use: the simulator before a command starts its clock, and the rest of what jobs run.

`python -m worker.compiling` compiles all of it, by a study and a fit of simulated recordings, at the lowest priority, and
with a bench file the simulator alone. The image is made with it, and a worker runs it beside itself when it starts, so
that no job waits for a compiler.

Numba keeps the machine code in NUMBA_CACHE_DIR, or beside the source, for this processor and this version of the code.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from threading import Timer
from types import FunctionType

import numpy as np

from slipstick.bench import TEMPLATE, Bench, Conditions
from slipstick.clutch.ensemble import shifting_times, signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.study import StudySettings, conclude, examine
from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.likelihood import InferenceProblem

_SILENT_SECONDS = 1.0
_ENGAGEMENTS, _SAMPLES = 24, 300  # the fewest of a study
_EFFECTS = {"stribeck_friction": {"strength": 0.2, "decay_speed": 20.0}, "output_speed_sensor_lag": {"lag": 0.02}}
_AXES = "pressure_bias", "initial_position"
_MULTIPLES = np.linspace(0.7, 1.3, 5)


def compile_simulator(model: Model, conditions: Conditions) -> None:
    """Load the compiled simulator, or compile it, and say so on standard error if that takes more than a second."""
    message = Timer(_SILENT_SECONDS, _say)
    message.start()
    try:
        _with_room(lambda: signals(model, conditions.take([0]), np.zeros(1), threads=1))
    finally:
        message.cancel()


def _call(function: Callable[[], object]) -> None:
    function()


_with_room = FunctionType(_call.__code__.replace(co_stacksize=1 << 16), globals(), "_with_room")
"""Calls a function from a frame of 0.5 MB, so that CPython maps memory for the frames of 0.5 MB more at once.

It maps 16 kB at a time, and unmaps them when the call returns that needed them. Where the many small calls of numba's
compiler come to lie across such a boundary, this took up to a third of its time: 600,000 mappings."""


def _say() -> None:
    print("Compiling the simulator, once for this installation (about 10 s)", file=sys.stderr, flush=True)


def compile_jobs() -> None:
    """Study and fit recordings that are simulated on the bench of the template, with two effects and noise."""
    bench = Bench.open(TEMPLATE)
    conditions = bench.conditions.take(np.arange(_ENGAGEMENTS) % len(bench.conditions))
    model, random = Model(bench.physics, effects=_EFFECTS), np.random.default_rng(1)
    compile_simulator(model, conditions)
    time = np.linspace(0, 1.05 * float(np.max(shifting_times(model, conditions)[0])), _SAMPLES)
    response = signals(model, conditions, time)
    measured = {name: getattr(response, name)[0] for name in SIGNAL_UNITS}
    noisy = {name: values + 0.01 * np.abs(values).max() * random.standard_normal(values.shape)
             for name, values in measured.items()}
    recordings = Recordings(conditions, response.shifting_time[0] + 0.002 * random.standard_normal(_ENGAGEMENTS),
                            Signals(time, **noisy))
    settings = StudySettings()
    conclude(settings, bench, recordings, examine(settings, bench, recordings))
    _fit(model, recordings)


def _fit(model: Model, recordings: Recordings) -> None:
    axes = [Axis(name, _MULTIPLES, 1.0, "1") for name in _AXES]
    points = np.stack(np.meshgrid(_MULTIPLES, _MULTIPLES, indexing="ij"), axis=-1)
    times, _ = shifting_times(model, recordings.conditions, _AXES, points.reshape(-1, len(_AXES)))
    table = times.reshape(*points.shape[:-1], len(recordings))
    problem = InferenceProblem(lambda points, _: interpolate(axes, table, points, "clip"), recordings.conditions,
                               recordings.measured_time, points[0, 0], points[-1, -1], _AXES, (_MULTIPLES, _MULTIPLES))
    settings = FitSettings(generations=2)
    estimate = fit.refined_estimate(settings, problem, fit.final_state(settings, problem))
    fit.with_next_interval(settings, problem, estimate)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        bench = Bench.open(Path(sys.argv[1]))
        compile_simulator(Model(bench.physics), bench.conditions)
    else:
        os.nice(19)
        compile_jobs()
