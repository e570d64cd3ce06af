"""A machine that is driven by a measured signal, whose noise is in what the equations are driven by."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.fit import Fit
from slipstick.engine.noise import Noise, draw_noise
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import settle
from slipstick.engine.simulation import simulate
from slipstick.engine.study import _confirm, estimate_parameters, fit_parameters, identify_runs
from slipstick.errors import InvalidValue
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor, list_experiments

RUNS, TIME = 24, np.linspace(0, 1, 401)
INERTIA, VISCOUS = 0.5, 0.05


def declare(drives: Sensor | Command, drag: float = 0.0) -> Machine:
    """A rotor under a torque, which is measured or commanded, and a `drag` in N m s^2 that it lacks otherwise."""
    rotor = Block("rotor", gives="speed", reads=("torque",), states=("speed",),
                  parameters=(Parameter("inertia", "kg m^2", value=INERTIA, within=0.03, scatter=0.02),
                              Parameter("viscous", "N m s", value=VISCOUS, scatter=0.2)),
                  quantities=(Quantity("drag torque", "N m", size=3.0),))
    rotor.rate(lambda x, u, q, p: (u.torque - q.drag_torque - (p.viscous + drag * x.speed) * x.speed) / p.inertia)
    is_measured = isinstance(drives, Sensor)
    return Machine("rotor", (rotor,), (*((drives,) if is_measured else ()), Sensor("speed", "rad/s")),
                   () if is_measured else (drives,), duration=1.0, step=0.0025)


MEASURED = declare(Sensor("torque", "N m"))


def record(noise: Noise, inertia: float = INERTIA, drag: float = 0.0, seed: int = 2) -> Runs:
    """Runs of the rotor as it is declared, but for its inertia."""
    rng = np.random.default_rng(seed)
    corners = np.column_stack([np.zeros(RUNS), rng.uniform(0.2, 0.5, RUNS), np.ones(RUNS)])
    profile = Profile(corners, np.column_stack([np.full(RUNS, 5.0), *rng.uniform(40, 80, (2, RUNS))]))
    values = {"inertia": inertia * np.exp(0.01 * rng.standard_normal(RUNS)),
              "viscous": VISCOUS * np.exp(0.1 * rng.standard_normal(RUNS))}
    speed = simulate(declare(Command("torque", "N m"), drag), TIME, {"torque": profile}, values)["speed"]
    return Runs(TIME, {"torque": profile.at(TIME) + draw_noise(noise, speed.shape, rng),
                       "speed": speed + 0.2 * rng.standard_normal(speed.shape)}, order=np.arange(float(RUNS)))


@pytest.mark.parametrize("noise", [
    pytest.param(Noise(10.0, 0.0), marks=pytest.mark.slow, id="white"), pytest.param(Noise(10.0, 0.9), id="slow"),
    pytest.param(Noise(5.0, 0.7), marks=pytest.mark.slow, id="some")])
def test_noise_of_a_measured_input_is_no_law_and_no_parameter(noise: Noise) -> None:
    recorded = prepare(MEASURED, record(noise))
    answer = identify(recorded)
    assert answer.findings == ()
    assert answer.unexplained == ()
    assert abs(deviation_of(answer.fits[0])) < 2
    shown = answer.fits[0].recorded.parts[0].noise["torque"]
    assert 0.75 < shown.power / noise.power < 1.35  # its own differences say almost nothing of it
    # Columns from the smoothed input share noise with the residual: parameters are biased, and laws named.
    smoothed = tuple(replace(before, noise=part.noise, sensors=part.sensors) for before, part in zip(
        recorded.parts, answer.fits[0].recorded.parts, strict=True))
    assert deviation_of(answer.fits[0].again(replace(answer.fits[0].recorded, parts=smoothed))) > 2.5


def deviation_of(fitted: Fit, inertia: float = INERTIA) -> float:
    """How far the inertia is off, in standard errors."""
    estimate = estimate_parameters(fitted)[0]
    return (estimate.mean - inertia) / estimate.error


@pytest.mark.slow
def test_a_strong_effect_is_no_noise_of_the_input_and_the_whole_machine_confirms_it() -> None:
    """Taken off with the noise, the effect would be in the columns, and other laws named."""
    runs = record(Noise(1.0, 0.0), drag=4e-3, seed=1)
    named = identify_runs(MEASURED, runs)
    (finding,), confirmation = named.findings, _confirm(MEASURED, runs, None, named, lambda _: None)
    # What a sensor reads too much is a drag.
    assert {finding.pair, *finding.rivals} == {("drag torque", "speed"), ("torque sensor", "speed")}
    assert confirmation is not None
    assert confirmation.gap.closed is not None
    assert confirmation.control_gap.closed is not None
    assert confirmation.gap.closed > 0.9 > confirmation.control_gap.closed
    assert confirmation.fit.recorded.parts[0].noise == named.fits[0].recorded.parts[0].noise


def test_a_calibration_is_not_biased_by_the_noise_of_an_input() -> None:
    assert abs(deviation_of(fit_parameters(MEASURED, record(Noise(10.0, 0.9), inertia=0.49)), 0.49)) < 2


def test_a_machine_that_is_driven_by_a_measured_signal_cannot_be_simulated() -> None:
    for call in (lambda: list_experiments(MEASURED), lambda: simulate(MEASURED, TIME, {}, {})):
        with pytest.raises(InvalidValue, match="it reads 'torque', which no block gives") as refused:
            call()
        assert "declare a Command" in refused.value.remedy


def test_samples_that_are_not_equidistant_are_refused() -> None:
    runs = record(Noise(1.0, 0.0))
    with pytest.raises(InvalidValue, match=r"not equidistant: one is 0.5 ms from where .* steps of 2.5 ms"):
        prepare(MEASURED, replace(runs, time=TIME + 5e-4 * (np.arange(len(TIME)) % 2)))


def test_a_machine_without_commands_and_conditions_has_one_experiment() -> None:
    rotor = Block("rotor", gives="speed", reads=(), states=("speed",),
                  parameters=(Parameter("rate", "1/s", value=1.0),))
    rotor.rate(lambda x, u, q, p: -p.rate * x.speed)
    machine = Machine("rotor", (rotor,), (Sensor("speed", "rad/s"),), duration=1.0, step=0.1)
    assert len(list_experiments(machine)) == 1


def test_settled_fits_know_the_input_without_its_noise() -> None:
    noise = Noise(10.0, 0.9)
    runs = record(noise)
    (settled,) = settle(prepare(MEASURED, runs), EngineSettings())
    part = settled.recorded.parts[0]
    exact = record(Noise(1e-9, 0.0))  # drawn by the same seed
    off = (part.inputs["torque"][:, ::part.fine] - exact.signals["torque"])[:, 5:-5]
    assert off.std() < 0.6 * noise.std
