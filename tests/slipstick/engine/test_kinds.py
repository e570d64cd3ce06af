"""Kinds of laws, with the parameters that belong to their equations; a static machine, whose runs take no solver."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from slipstick.engine.kinds import _bound, find_kind
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.engine.study import MachineStudy, ParameterEstimate, estimate_parameters, fit_parameters, study
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

RUNS, TIME, NOISE = 24, np.linspace(0, 1, 201), 2e-3
GAIN, DRAG = 0.48, 0.006


def declare() -> Machine:
    motor = Block("motor", gives="torque", reads=("current",),
                  parameters=(Parameter("gain", "N m/A", value=0.5, scatter=0.02, within=0.05),),
                  quantities=(Quantity("loss", "N m", size=0.1, over=("current",)),))
    motor.output(lambda x, u, q, p: p.gain * u.current - q.loss)
    return Machine("motor", (motor,), (Sensor("torque", "N m"),), commands=(Command("current", "A"),))


def record(seed: int, drag: float = DRAG) -> Runs:
    rng = np.random.default_rng(seed)
    corners, values = np.tile([0.0, 0.5, 1.0], (RUNS, 1)), rng.uniform(-4.5, 4.5, (RUNS, 3))
    current = Profile(corners, values).at(TIME)
    gain = GAIN * np.exp(0.01 * rng.standard_normal((RUNS, 1)))
    torque = gain * current - drag * current * np.abs(current)
    return Runs(TIME, {"torque": torque + NOISE * rng.standard_normal(torque.shape)},
                {"current": Profile(corners, values)}, order=np.arange(float(RUNS)))


@pytest.fixture(scope="module")
def studied() -> MachineStudy:
    return study(declare(), record(2))


def test_parameters_beside_the_equation_of_a_law_belong_to_it_where_the_law_may_share_a_line_with_one(
        studied: MachineStudy) -> None:
    kind, = studied.kinds
    assert (kind.pair, kind.name) == (("loss", "current"), "quadratic drag")
    drag, = kind.coefficients
    assert drag.lower < DRAG < drag.upper
    gain, = studied.parameters_beside_kinds
    assert abs(gain.mean - GAIN) < 2.5 * gain.error
    measured, = studied.parameters
    assert abs(measured.mean - GAIN) > 4 * measured.error  # beside the measured law, which leaves its line to it


@pytest.mark.slow
def test_a_line_has_no_limit_that_only_noise_asks_for() -> None:
    """A saturation at the best of its limits always fits the noise a little better than a line."""
    stated = Parameter("gain", "N m/A", value=0.5, scatter=0.0, within=1e-4)
    machine = replace(declare(), blocks=(replace(declare().blocks[0], parameters=(stated,)),),
                      sensors=(Sensor("torque", "N m", without=("current", "torque")),))
    for seed in (1, 2):  # with 2, a saturation has the most evidence
        rng, corners = np.random.default_rng(seed), np.tile([0.0, 0.5, 1.0], (RUNS, 1))
        current = Profile(corners, rng.uniform(-4.5, 4.5, (RUNS, 3)))
        torque = GAIN * current.at(TIME) + NOISE * rng.standard_normal((RUNS, len(TIME)))
        runs = Runs(TIME, {"torque": torque}, {"current": current}, order=np.arange(float(RUNS)))
        fitted, = identify(prepare(machine, runs)).fits
        kind = find_kind(fitted, ("loss", "current"))
        assert kind is not None
        assert kind.name == "proportional"
        slope, = kind.coefficients
        assert slope.lower < 0.5 - GAIN < slope.upper


@pytest.mark.slow
def test_a_lag_of_a_sensor_has_any_time_and_is_stated_with_the_clock() -> None:
    rng, n, time, fine = np.random.default_rng(5), 12, 4.3 * (TIME[1] - TIME[0]), 20
    corners, values = np.tile(np.linspace(0, 1, 12), (n, 1)), rng.uniform(-4.5, 4.5, (n, 12))
    current = Profile(corners, values)
    instants = np.linspace(0, 1, fine * (len(TIME) - 1) + 1)
    torque = np.stack([
        lsim(([GAIN], [time, 1.0]), each - each[0], instants)[1] + GAIN * each[0] for each in current.at(instants)])
    runs = Runs(TIME, {"torque": torque[:, ::fine] + NOISE * rng.standard_normal((n, len(TIME)))},
                {"current": current}, order=np.arange(float(n)))
    fitted, = identify(prepare(declare(), runs)).fits
    kind = find_kind(fitted, ("torque sensor", "lag"))
    assert kind is not None
    assert kind.name == "first-order lag"
    share, lag, late = kind.coefficients
    for each, true in ((share, 1.0), (lag, 4.3), (late, 0.0)):
        assert each.lower < true < each.upper
    assert lag.upper - lag.lower < 0.5
    assert (lag.unit, late.unit) == ("samples", "samples")


def test_a_parameter_that_is_held_at_the_end_of_what_is_declared_has_no_interval_of_the_recordings() -> None:
    runs = record(1, drag=0.0)
    stronger = replace(runs, signals={"torque": 1.6 * runs.signals["torque"]})
    gain, = estimate_parameters(fit_parameters(declare(), stronger))
    assert gain.mean < 0.6 < 1.6 * GAIN
    assert gain.beyond
    assert not gain.known
    assert gain.error > 0.04 * gain.mean


def test_a_scatter_is_outside_of_what_is_declared_where_the_runs_tell_that_it_is_larger() -> None:
    """Runs that tell little of a parameter often have an estimate of its scatter that is larger than the truth."""
    def estimate(seed: int, scatter: float, noise: float) -> ParameterEstimate:
        rng, runs = np.random.default_rng(seed), record(seed, drag=0.0)
        signal = runs.signals["torque"] * np.exp(scatter * rng.standard_normal((RUNS, 1)))
        signal = signal + noise * rng.standard_normal(signal.shape)
        gain, = estimate_parameters(fit_parameters(declare(), replace(runs, signals={"torque": signal})))
        return gain

    loud = [estimate(seed, 0.0, 1.0) for seed in range(8)]
    assert sum(each.scatter > 0.02 * each.mean for each in loud) > 1
    assert not any(each.beyond for each in loud)
    wide = estimate(1, 0.06, 0.0)
    assert wide.scatter > 0.03 * wide.mean
    assert wide.beyond


def test_nothing_is_named_of_a_machine_that_rests_in_all_runs() -> None:
    drive = Block("drive", gives="current", reads=("set point",), states=("current",),
                  parameters=(Parameter("lag", "s", value=0.05, scatter=0.0, within=0.2),),
                  quantities=(Quantity("gain", relative=True),))
    drive.rate(lambda x, u, q, p: (u.set_point * (1 + q.gain) - x.current) / p.lag)
    machine = Machine("drive", (drive,), (Sensor("current", "A"),), commands=(Command("set point", "A"),))
    noise = NOISE * np.random.default_rng(1).standard_normal((RUNS, len(TIME)))
    still = Profile(np.tile([0.0, 1.0], (RUNS, 1)), np.zeros((RUNS, 2)))
    assert not identify(prepare(machine, Runs(TIME, {"current": noise}, {"set point": still}))).findings


def test_a_control_is_of_another_dependence_where_finding_and_rivals_are_of_all_quantities(
        studied: MachineStudy) -> None:
    finding, = studied.findings
    assert {pair[0] for pair in (finding.pair, *finding.rivals)} == {"loss", "torque sensor"}
    assert studied.confirmation is not None
    assert studied.confirmation.control not in (finding.pair, *finding.rivals)
    closed, by_control = studied.confirmation.gap.closed, studied.confirmation.control_gap.closed
    assert closed is not None
    assert by_control is not None
    assert by_control < 0.5 < closed


def test_ends_of_a_shape_are_within_the_shapes() -> None:
    """A shape that is hardly told from larger ones has no end below all of them, as a normal one would."""
    shapes = np.array([3.0, 1.0, 2.0, 40.0])
    lower, upper = _bound(shapes, np.array([0.2, 0.5, 0.2, 0.1]))
    assert 1 < lower < 1.1
    assert 21 < upper < 40
    assert _bound(np.array([5.0]), np.ones(1)) == (5.0, 5.0)


@pytest.mark.slow
def test_a_gain_may_fall_with_the_magnitude_of_a_current() -> None:
    motor = replace(declare().blocks[0], quantities=(Quantity("gain change", relative=True, over=("current",)),))
    motor.output(lambda x, u, q, p: p.gain * (1 + q.gain_change) * u.current)
    fitted, = identify(prepare(replace(declare(), blocks=(motor,)), record(3, drag=0.05 * GAIN))).fits
    kind = find_kind(fitted, ("gain change", "current"))
    assert kind is not None
    assert kind.name == "linear in the magnitude"
    slope, = kind.coefficients  # the constant is that of the gain
    assert slope.value * estimate_parameters(kind.fit)[0].mean == pytest.approx(-0.05 * GAIN, rel=0.01)
