from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.ensemble import shifting_times, signals
from slipstick.clutch.model import Model
from slipstick.interface.study import Study
from slipstick.pictures import rendering
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.studies import StudyResult, StudySettings, conclude, examine
from slipstick.studies.figures import Figures
from slipstick.table import Axis, Grid
from tests.benches import HEAVY, NOMINAL
from tests.distribution import Once

TRUTH = (("pressure_bias", 1.05), ("initial_position", 0.95))
NOISE = {"pressure": 0.05, "input_speed": 0.25, "output_speed": 0.08, "output_torque": 6.0}
CONDITIONS = HEAVY.conditions.take([3, 40, 77, 100, 150, 180, 199, 215])


@pytest.fixture(scope="session")
def small_table() -> Grid:
    """A table of 8 conditions on a grid of 5 x 5 points."""
    model, values = NOMINAL, np.linspace(0.7, 1.3, 5)
    axes = (Axis("pressure_bias", values, 1.6, "bar"), Axis("initial_position", values, 5e-4, "m"))
    points = np.array(list(product(values, values)))
    times, status = shifting_times(model, CONDITIONS, [axis.name for axis in axes], points)
    return Grid(axes, times.reshape(5, 5, 8), status.reshape(5, 5, 8), CONDITIONS, model, "the tests")


@pytest.fixture(scope="session")
def small_recordings() -> Recordings:
    """The same 8 conditions, simulated at `TRUTH` with 8 ms of noise on the shifting times."""
    names, multiples = zip(*TRUTH, strict=True)
    time = np.arange(0.0, 1.5, 0.01)
    response = signals(NOMINAL, CONDITIONS, time, names, np.array([multiples]))
    measured = response.shifting_time[0] + 0.008 * np.random.default_rng(2).standard_normal(8)
    return Recordings(CONDITIONS, measured, Signals(time, *(getattr(response, name)[0] for name in SIGNAL_UNITS)))


def bench(recordings: Recordings, model: Model) -> Recordings:
    """Recordings of `model` under the same conditions, with run-to-run variation and sensor noise."""
    rng, n, conditions = np.random.default_rng(7), len(recordings), recordings.conditions
    vectors = np.tile(model.parameters, (n, 1))
    for name, std in (("pressure_bias", 0.05), ("initial_position", 0.08)):
        vectors[:, parameters.index(name)] *= 1 + std * rng.standard_normal(n)
    time = np.arange(0.0, 2.0, 0.004)
    response = ensemble.simulate(HEAVY.physics.converter, vectors, np.tile(model.coefficients(), (n, 1)), conditions,
                                 time, paired=True)
    measured = Signals(time, *(getattr(response, name) + NOISE[name] * rng.standard_normal((n, len(time)))
                               for name in SIGNAL_UNITS))
    return replace(recordings, measured_time=response.shifting_time + 0.003 * rng.standard_normal(n), signals=measured)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Empty pictures, for tests of the text of a page: drawing all of them takes a second, and has tests of its own."""
    empty = '<svg class="marks" width="1" height="1" viewBox="0 0 1 1"></svg>'
    monkeypatch.setattr(rendering, "svg", lambda picture: empty)


@pytest.fixture
def both_fits(made: Callable[..., dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Invented fits on the tables of a study's two models: 120 decades apart, with output std of 12 ms and 3 ms."""
    fits = {which: {"id": f"fit-{which}", "table": f"table-{which}", "table_digest": digest, **made()}
            for which, digest in (("before", "a1b2"), ("after", "c3d4"))}
    fits["before"]["result"] |= {"log10_likelihood": -389.0, "output_std": 0.012}
    fits["after"]["result"] |= {"output_std": 0.003}
    return fits


@pytest.fixture(scope="session")
def studied(few_recordings: Path, study_of_few: Study, once: Once) -> Callable[[str], tuple[StudyResult, Figures]]:
    """Real studies of 24 engagements, each run once.

    `friction`: shipped recordings, which contain friction that depends on slip; `drag` and `nothing`: simulated by a
    model with a quadratic load drag and by the model without effects; `torque` and `times`: those with friction, of
    which only every second sample of the output torque, or the shifting times, were recorded. Of `torque` a single
    effect is tried, as each takes a fit of the whole simulation.
    """
    few = Recordings.open(few_recordings / "few.h5")
    signals = few.signals
    assert signals is not None
    recordings: dict[str, Callable[[], Recordings]] = {
        "drag": lambda: bench(few, NOMINAL.with_effect("quadratic_load_drag", {"drag": 0.03})),
        "nothing": lambda: bench(few, NOMINAL),
        "torque": lambda: replace(few, signals=Signals(signals.time[::2], output_torque=signals.output_torque[:, ::2])),
        "times": lambda: replace(few, signals=None)}

    def run(name: str) -> tuple[StudyResult, Figures]:
        settings = StudySettings(catalogue=("stribeck_friction",)) if name == "torque" else StudySettings()
        given = recordings[name]()
        return conclude(settings, HEAVY, given, examine(settings, HEAVY, given))

    def study(name: str) -> tuple[StudyResult, Figures]:
        if name == "friction":
            return study_of_few.result, study_of_few.figures
        found: tuple[StudyResult, Figures] = once(f"study_{name}", lambda: run(name))
        return found

    return study
