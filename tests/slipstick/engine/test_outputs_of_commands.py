"""Outputs that jump with a command, such as the voltage of a cell with its current."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine import settling
from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Part, pose_nominal
from slipstick.engine.selection import identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import settle
from slipstick.engine.trajectory import solve
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

RUNS, TIME, RISE = 24, np.linspace(0, 1, 101), 1e-4


def command() -> Profile:
    rng = np.random.default_rng(0)
    height, instant = rng.uniform(0.5, 3, (RUNS, 1)), rng.uniform(0.3, 0.7, (RUNS, 1))
    instant[::2] = np.round(instant[::2], 2)
    return Profile(np.hstack([0 * instant, instant, instant + RISE]), np.hstack([0 * height, 0 * height, height]))


def record(signal: np.ndarray, profile: Profile) -> Runs:
    noise = 0.05 * np.random.default_rng(1).standard_normal(signal.shape)
    return Runs(TIME, {"force": signal + noise}, {"current": profile}, order=np.arange(float(RUNS)))


def predict(part: Part) -> np.ndarray:
    return solve(pose_nominal(part)).outputs[:, 0, ::part.fine]


@pytest.mark.parametrize("late", [0.0, 0.004, *(pytest.param(late, marks=pytest.mark.slow) for late in (0.001, 0.008))])
def test_nothing_is_missing_where_an_output_without_states_follows_jumps_of_a_command(late: float) -> None:
    coil = Block("coil", gives="force", reads=("current",), parameters=(Parameter("constant", "N/A", value=10.0),),
                 quantities=(Quantity("share", relative=True), Quantity("stray", "N")))
    coil.output(lambda x, u, q, p: p.constant * u.current * (1 + q.share) + q.stray)
    machine = Machine("coil", (coil,), (Sensor("force", "N"),), (Command("current", "A"),))
    scatter = np.exp(0.01 * np.random.default_rng(2).standard_normal((RUNS, 1)))
    profile = command()
    recorded = prepare(machine, record(10 * scatter * profile.at(TIME - late), profile))
    assert np.allclose(predict(recorded.parts[0]), 10 * profile.at(TIME))
    answer = identify(recorded)
    assert not answer.findings
    assert not answer.unexplained


def declare_fading() -> Machine:
    coil = Block("coil", gives="force", reads=("current",), states=("heat",), parameters=(
        Parameter("constant", "N/A", value=10.0), Parameter("fade", "N/A", value=1.0)),
        quantities=(Quantity("stray", "N"),))
    coil.rate(lambda x, u, q, p: u.current - x.heat)
    coil.output(lambda x, u, q, p: p.constant * u.current - p.fade * x.heat + q.stray)
    return Machine("coil", (coil,), (Sensor("force", "N"),), (Command("current", "A"),))


def test_a_law_over_a_command_that_jumps_has_its_levels_as_knots() -> None:
    """The lines that drive the equations go beyond them beside jumps between samples."""
    lag = Block("lag", gives="force", reads=("current",), states=("force",),
                quantities=(Quantity("stray", "N", over=("current",)),))
    lag.rate(lambda x, u, q, p: u.current + q.stray - x.force)
    machine = Machine("lag", (lag,), (Sensor("force", "N"),), (Command("current", "A"),))
    profile = command()
    levels = replace(profile, value=np.round(profile.value))
    recorded = prepare(machine, record(levels.at(TIME), levels))
    law, = (each for each in list_candidates(recorded, {part.name: {} for part in recorded.parts})
            if each.pair == ("stray", "current"))
    assert recorded.parts[0].inputs["current"].min() < -0.1
    np.testing.assert_array_equal(law.variable.knots, np.unique(levels.value))


def fade(profile: Profile, time: np.ndarray) -> np.ndarray:
    """The force of the coil, but for its constant: the current has a jump."""
    instant, height = profile.time[:, 1:2], profile.value[:, 2:]
    return np.asarray(height * (1 - np.exp(-np.maximum(time - instant, 0))))


def test_an_output_beside_states_reads_the_command_itself_at_the_instant_of_a_jump() -> None:
    profile = command()
    signal = 10 * profile.at(TIME) - fade(profile, TIME)
    predicted = predict(prepare(declare_fading(), record(signal, profile)).parts[0])
    assert np.abs(predicted - signal).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.0, 0.009])
def test_the_clock_of_an_output_that_jumps_is_found_from_afar(late: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit that begins at half a sample ends there: the samples beside a jump do not tell of the way."""
    profile = command()
    recorded = prepare(declare_fading(), record(10 * profile.at(TIME - late) - fade(profile, TIME - late), profile))
    fitted, = settle(recorded, EngineSettings())
    clock, = (value for term, value in zip(recorded.shared, fitted.state.shared, strict=True) if term.kind == "clock")
    assert abs(clock - late / 0.01) < 0.1
    assert fitted.chi_square["coil"].mean() < 1.1
    monkeypatch.setattr(settling, "_try_clocks", lambda fitted: fitted)
    stuck, = settle(recorded, EngineSettings())
    assert stuck.chi_square["coil"].mean() > 10
