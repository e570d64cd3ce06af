"""A study and a fit of simulated recordings, which compile what jobs run: `python -m worker.rehearsal`.

The image is made with it, and a worker runs it beside itself when it starts, at the lowest priority, so that no job
waits for a compiler. Numba keeps the machine code (`worker.compiling`).
"""

import os

import numpy as np

from slipstick.bench import TEMPLATE, Bench
from slipstick.clutch.ensemble import shifting_times, signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.studies import StudySettings, conclude, examine
from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.likelihood import InferenceProblem

from .compiling import compile_simulator

_ENGAGEMENTS, _SAMPLES = 24, 300  # the fewest of a study
_EFFECTS = {"stribeck_friction": {"strength": 0.2, "decay_speed": 20.0}, "output_speed_sensor_lag": {"lag": 0.02}}
_AXES = "pressure_bias", "initial_position"
_MULTIPLES = np.linspace(0.7, 1.3, 5)


def rehearse() -> None:
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
    _fit(model, recordings)  # at last, because a service that starts at the same time compiles much of it


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
    os.nice(19)
    rehearse()
