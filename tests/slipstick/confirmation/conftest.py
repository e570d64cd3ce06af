"""Recordings of the heavy bench by our own simulator, with scatter of several parameters and correlated noise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.confirmation import Traces
from slipstick.confirmation.simulated import RANDOM
from slipstick.naming import NamingSettings
from slipstick.naming.scene import Scene
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from tests.benches import HEAVY

SCATTER = {"current_gain": 0.01, "pressure_bias": 0.03, "initial_position": 0.05, "friction_coefficient": 0.01}
NOISE = {"pressure": 0.05, "input_speed": 0.25, "output_speed": 0.08, "output_torque": 6.0}
RHO = 0.5
TIMER = 0.003


def recorded(model: Model, n: int = 18, seed: int = 3) -> tuple[Recordings, dict[str, np.ndarray]]:
    """Recordings of every so many of the bench's conditions, and the relative deviations (n,) of the parameters."""
    rng = np.random.default_rng(seed)
    conditions = HEAVY.conditions.take(np.linspace(0, len(HEAVY.conditions) - 1, n).astype(int))
    conditions = replace(conditions, run_order=rng.permutation(n))
    vectors, drawn = np.tile(model.parameters, (n, 1)), {}
    for name, std in SCATTER.items():
        drawn[name] = std * rng.standard_normal(n)
        vectors[:, parameters.index(name)] *= 1 + drawn[name]
    time = np.arange(0.0, 2.0, 0.002)
    response = ensemble.simulate(HEAVY.physics.curves, vectors, np.tile(model.coefficients(), (n, 1)), conditions, time,
                                 paired=True, laws=model.laws)
    signals = {}
    for name, std in NOISE.items():
        white = rng.standard_normal((n, len(time) + 50)) * std * np.sqrt(1 - RHO**2)
        signals[name] = getattr(response, name) + lfilter([1], [1, -RHO], white)[:, 50:]
    measured = response.shifting_time + TIMER * rng.standard_normal(n)
    return Recordings(conditions, measured, Signals(time, *(signals[name] for name in SIGNAL_UNITS))), drawn


@pytest.fixture(scope="session")
def traced() -> Callable[[Model], tuple[Traces, np.ndarray]]:
    """Traces of recordings of a model, each simulated once, and points near the true parameters to start from."""
    found: dict[str, tuple[Traces, np.ndarray]] = {}

    def of(model: Model) -> tuple[Traces, np.ndarray]:
        if model.digest not in found:
            recordings, drawn = recorded(model)
            points = np.stack([drawn.get(name, np.zeros(len(recordings))) for name in RANDOM], axis=1)
            scene = Scene.of(HEAVY, recordings, NamingSettings())
            found[model.digest] = Traces.of(scene, {}, HEAVY.physics.curves), points
        return found[model.digest]

    return of
