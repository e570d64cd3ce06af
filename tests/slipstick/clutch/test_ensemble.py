"""The compiled ensemble: agreement with the reference and with closed forms, reproducibility, vectors and errors."""

import platform
import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from slipstick.bench import Bench, parameters
from slipstick.bench.conditions import Conditions
from slipstick.clutch import driveline, effects, ensemble, events, flow, hydraulics, integrator, lanes, reference, steps
from slipstick.clutch.fastmath import allocating, exp
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import BENCHES, HEAVY, NOMINAL

CONDITIONS = HEAVY.conditions
SAMPLE_TIMES = np.arange(0.0, 2.0, 0.02)


@pytest.mark.parametrize("condition", [0, 77, 215])
def test_agrees_with_the_reference_implementation(condition: int) -> None:
    time, signals = reference.simulate(NOMINAL, CONDITIONS, condition, SAMPLE_TIMES)
    fast = ensemble.signals(NOMINAL, CONDITIONS.take([condition]), SAMPLE_TIMES, accuracy=ensemble.TIGHT)
    assert abs(fast.shifting_time[0, 0] - time) < 1e-5
    columns = (fast.pressure, fast.input_speed, fast.output_speed, fast.output_torque, fast.piston_position)
    for k, column in enumerate(columns):
        assert np.max(np.abs(column[0, 0] - signals[:, k])) < 1e-4 * np.ptp(signals[:, k])


@pytest.mark.parametrize("model", [NOMINAL, NOMINAL.with_effect("supply_droop", {"droop": 0.1})], 
                         ids=["exact", "stepped"])
def test_samples_within_long_steps_lie_on_the_solution(model: Model) -> None:
    fine = np.arange(0.0, 0.3, 1e-3)  # several samples in a step, while the pressure follows the fill pulse
    rough, tight = (ensemble.signals(model, CONDITIONS.take([50, 150]), fine, accuracy=accuracy)
                    for accuracy in (ensemble.DEFAULT, ensemble.TIGHT))
    for name in ("pressure", "input_speed", "output_speed", "piston_position"):
        error = np.abs(getattr(rough, name) - getattr(tight, name))
        assert error.max() < 1e-3 * np.ptp(getattr(tight, name)), name


def test_release_and_standstill_agree_with_the_reference_implementation() -> None:
    # After lock-up the current falls, the plates release and the brake stops the load; then it engages again.
    time = np.array([[0, 0.002, 0.105, 0.115, 0.255, 0.8, 1.2, 1.21, 3.2, 3.4, 6.0]])
    current = np.array([[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7, 0.05, 0.05, 0.5, 0.7]])
    ones = np.ones(1)
    conditions = Conditions(np.zeros(1, np.int64), 105 * ones, 6 * ones, 80 * ones, time, current)
    samples = np.arange(0.0, 6.0, 0.01)
    shifting_time, signals = reference.simulate(NOMINAL, conditions, 0, samples)
    fast = ensemble.signals(NOMINAL, conditions, samples, accuracy=ensemble.TIGHT)
    slip = fast.input_speed[0, 0] / 3.2 - fast.output_speed[0, 0]
    stuck = np.abs(slip) < 1e-9
    assert stuck[110]
    assert not np.any(stuck[200:330])  # the plates released
    assert np.any(fast.output_speed[0, 0, 200:330] == 0.0)  # the load stopped
    assert stuck[-1]  # and locked again
    assert abs(fast.shifting_time[0, 0] - shifting_time) < 1e-5
    for k, column in enumerate((fast.pressure, fast.input_speed, fast.output_speed)):
        assert np.max(np.abs(column[0, 0] - signals[:, k])) < 1e-4 * np.ptp(signals[:, k])


def test_plates_that_break_away_and_lock_again_within_a_step_do_so_at_the_same_speed() -> None:
    changes = {"pressure_bias": 1.9, "initial_position": 1.9, "ramp_share": 0.25, "piston_return": 0.8}
    factors = np.array([changes.get(name, 1.0) for name in parameters.NAMES])
    gains = np.linspace(0.885, 0.895, 101)  # at some of which the plates slip for no longer than a step
    vectors = np.tile(factors * NOMINAL.parameters, (len(gains), 1))
    vectors[:, parameters.index("current_gain")] *= gains
    ones = np.ones(len(gains))
    conditions = replace(CONDITIONS.take(np.zeros(len(gains), int)), current_profile=np.full(len(gains), 3),
                         motor_speed=104.72 * ones, load_inertia=6 * ones, brake_torque=18 * ones)
    response = ensemble.simulate(HEAVY.physics.curves, vectors, np.tile(NOMINAL.coefficients(), (len(gains), 1)),
                                 conditions, np.arange(0.0, 0.9, 0.002), paired=True)
    slip = response.input_speed / NOMINAL.parameters[parameters.index("gear_ratio")] - response.output_speed
    assert np.any(slip[:, 250:] > 1e-3), "no plates break away"
    assert slip.min() > -1e-9


def test_results_do_not_depend_on_threads_or_other_engagements() -> None:
    points = np.linspace(0.6, 1.4, 60)[:, None]
    serial, _ = ensemble.shifting_times(NOMINAL, CONDITIONS, ["pressure_bias"], points, threads=1)
    threaded, _ = ensemble.shifting_times(NOMINAL, CONDITIONS, ["pressure_bias"], points, threads=5)
    alone, _ = ensemble.shifting_times(NOMINAL, CONDITIONS.take([97]), ["pressure_bias"], points[41:42])
    np.testing.assert_array_equal(serial, threaded)
    assert alone[0, 0] == serial[41, 97]


def test_engagements_that_never_lock_or_diverge_have_a_status() -> None:
    points = np.array([[1.0, 1.0], [0.01, 1.0], [1.0, 1e-6]])  # no friction; a delay too short for any step
    times, status = ensemble.shifting_times(NOMINAL, CONDITIONS, ["friction_coefficient", "current_delay"], points)
    assert np.all(status[0] == ensemble.LOCKED)
    assert np.all(status[1] == ensemble.NEVER_LOCKED)
    assert np.all(status[2] == ensemble.FAILED)
    assert np.all(np.isnan(times) == (status != ensemble.LOCKED))
    np.testing.assert_array_equal(times[0], ensemble.shifting_times(NOMINAL, CONDITIONS)[0][0])
    status = ensemble.shifting_times(NOMINAL, CONDITIONS, ["piston_inertia"], np.zeros((1, 1)))[1]
    assert np.all(status == ensemble.FAILED)


def test_signals_of_a_failed_engagement_are_nan_from_the_failure_on() -> None:
    runaway = NOMINAL.with_effect("quadratic_load_drag", {"drag": -5.0})
    response = ensemble.signals(runaway, CONDITIONS, SAMPLE_TIMES)
    undefined = np.isnan(response.output_torque[0])
    assert np.all(response.status == ensemble.FAILED)
    assert not np.any(undefined[:, 0])
    assert np.all(undefined[:, -1])
    assert np.all(np.diff(undefined.astype(int), axis=1) >= 0)


@pytest.mark.parametrize(("axis", "multiplier"), [("current_delay", 0.1), ("piston_return", 300.0)])
def test_fast_dynamics_shorten_the_steps(axis: str, multiplier: float) -> None:
    points = np.array([[multiplier]])
    times, status = ensemble.shifting_times(NOMINAL, CONDITIONS, [axis], points)
    tight, tight_status = ensemble.shifting_times(NOMINAL, CONDITIONS, [axis], points, ensemble.TIGHT)
    np.testing.assert_array_equal(status, tight_status)
    np.testing.assert_allclose(times, tight, atol=1e-4)


def test_status_does_not_depend_on_the_duration_of_the_samples() -> None:
    weak = NOMINAL.with_parameters({"friction_coefficient": 0.04 * 3.2e-4})
    times, status = ensemble.shifting_times(weak, CONDITIONS)
    sampled = ensemble.signals(weak, CONDITIONS, np.linspace(0, 8, 20))
    np.testing.assert_array_equal(sampled.shifting_time, times)
    np.testing.assert_array_equal(sampled.status, status)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 assembly")
@pytest.mark.slow
def test_loops_over_lanes_compile_to_vector_instructions() -> None:
    # A loss of vectorization is silent and costs a factor of four: count packed and scalar double arithmetic.
    buffer, active = np.zeros(lanes.BUFFER_SIZE), np.zeros(lanes.MEMORY_FLAG + 1, np.bool_)
    for function, arguments in (
        (hydraulics.hydraulics, (buffer, active)),
        (driveline.driveline, (buffer, active)),
        (flow.flow, (buffer,)),
        (steps.choose_steps, (buffer, active, 1e-3, 7e-3)),
        (integrator.other_stages, (buffer, active)),
        (events.mark_events, (buffer,)),
    ):
        # Compiled here, because the cached entry points contain no assembly to inspect.
        assembly = _assembly(function, arguments)
        packed = len(re.findall(r"v?(?:add|sub|mul|div|min|max|cmp\w*|f\w+)pd\s", assembly))
        scalar = len(re.findall(r"v?(?:add|sub|mul|div|min|max|f\w+)sd\s", assembly))
        assert packed > 5 * scalar, f"{function.__name__}: {packed} packed, {scalar} scalar"


def _assembly(function: Any, arguments: tuple[Any, ...]) -> str:
    """Machine code of an entry point with the function; it is made of no other functions."""
    entry: Any = allocating(lambda *given: function(*given))
    entry(*arguments)
    return "".join(entry.inspect_asm().values())


def test_exp_is_accurate() -> None:
    x = np.linspace(-40, 40, 4001)
    np.testing.assert_allclose([exp(value) for value in x], np.exp(x), rtol=5e-13)
    assert exp(0.0) == 1.0


def test_invalid_input_raises_an_error_with_a_remedy() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'pressure_bias'"):
        ensemble.shifting_times(NOMINAL, CONDITIONS, ["presure_bias"], np.ones((1, 1)))
    with pytest.raises(InvalidValue, match=r"Give \(m, 1\) multipliers of pressure_bias"):
        ensemble.shifting_times(NOMINAL, CONDITIONS, ["pressure_bias"], np.ones((1, 2)))
    with pytest.raises(InvalidValue, match="finite"):
        ensemble.shifting_times(NOMINAL, CONDITIONS, ["pressure_bias"], np.array([[np.nan]]))


def test_paired_results_are_the_diagonal_of_all_combinations() -> None:
    points, conditions = np.linspace(0.7, 1.3, 24)[:, None], CONDITIONS.take(range(0, 216, 9))
    vectors = np.tile(NOMINAL.parameters, (24, 1)) * np.where(np.arange(20) == 11, points, 1.0)
    typical = [value for effect in effects.CATALOGUE for value in effect.on(HEAVY.scales).typical]
    coefficients, samples = np.tile(typical, (24, 1)), np.linspace(0, 1.5, 7)
    combinations = ensemble.simulate(HEAVY.physics.converter, vectors, coefficients, conditions, samples)
    for threads in (1, 3):
        pairs = ensemble.simulate(HEAVY.physics.converter, vectors, coefficients, conditions, samples, threads=threads,
                                  paired=True)
        for column in fields(combinations):
            diagonal = np.einsum("ii...->i...", getattr(combinations, column.name))
            np.testing.assert_array_equal(getattr(pairs, column.name), diagonal)
    with pytest.raises(InvalidValue, match="24 points do not pair up with 3 conditions"):
        ensemble.simulate(HEAVY.physics.converter, vectors, coefficients, CONDITIONS.take([1, 2, 3]), paired=True)


# The exact solution of eq. 1 against the matrix exponential, and its place among the effects.


LOOSE = ensemble.Accuracy(1e-3, 24e-3)


def exact(model: Model, time: np.ndarray, current: np.ndarray, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pressure in bar and piston state in m at the samples, by the matrix exponential of eq. 1 on each segment."""
    p = dict(zip(parameters.NAMES, model.parameters, strict=True))
    tau, inertia = p["current_delay"], p["piston_inertia"]
    state, found = np.array([0.0, 0.0, p["initial_position"], 1.0, 0.0]), []
    for k in range(len(time) - 1):
        slope = (current[k + 1] - current[k]) / (time[k + 1] - time[k])
        # States: pressure, its rate, piston state, 1, time since the start of the segment.
        rates = np.zeros((5, 5))
        rates[0, 1] = 1.0
        rates[1] = [-6 / tau**2, -4 / tau, 0, 6 * p["current_gain"] / tau**2 * (current[k] - p["current_bias"])
                    - 2 * p["current_gain"] / tau * slope, 6 * p["current_gain"] / tau**2 * slope]
        rates[2] = np.array([p["piston_pressure"], p["piston_pressure_rate"], -p["piston_return"],
                             -p["piston_pressure"] * p["pressure_bias"], 0]) / inertia
        rates[4, 3] = 1.0
        state[4] = 0.0
        found += [expm(rates * (t - time[k])) @ state for t in samples[(samples >= time[k]) & (samples < time[k + 1])]]
        state = expm(rates * (time[k + 1] - time[k])) @ state
    return np.array(found)[:, 0], np.array(found)[:, 2]


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("spring", [1.0, 1e-9, 20.0])
def test_pressure_and_piston_are_exact_in_long_steps(bench: Bench, spring: float) -> None:
    model = Model(bench.physics)
    model = model.with_parameters({"piston_return": spring * model.parameters[parameters.index("piston_return")]})
    one = bench.conditions.take([0])
    time, current = one.profile_time[one.current_profile[0]], one.profile_current[one.current_profile[0]]
    samples = np.linspace(0, 0.9 * time[-1], 400)
    response = ensemble.signals(model, one, samples, accuracy=LOOSE)
    pressure, piston_state = exact(model, time, current, samples)
    assert np.abs(response.pressure[0, 0] - pressure).max() < 1e-4 * np.ptp(pressure)
    contact = model.parameters[parameters.index("contact_position")]
    gain = model.parameters[parameters.index("temperature_gain")]
    piston = np.clip(gain * piston_state, 0, contact)
    assert np.abs(response.piston_position[0, 0] - piston).max() < 1e-4 * contact


def test_a_change_of_the_pressure_shows_and_is_integrated() -> None:
    # With a line pressure that changes by a millionth, the Runge-Kutta method integrates what is exact without.
    weak, strong = (NOMINAL.with_effect("supply_droop", {"droop": value}) for value in (1e-6, 0.1))
    samples = np.linspace(0, 1, 300)
    paper, stepped, other = (ensemble.signals(model, HEAVY.conditions.take([80]), samples).pressure[0, 0]
                             for model in (NOMINAL, weak, strong))
    assert 0 < np.abs(stepped - paper).max() < 1e-3 * np.ptp(paper)
    assert np.abs(other - paper).max() > 1e-2 * np.ptp(paper)


def test_a_kink_of_f_reg_between_long_steps_costs_no_accuracy() -> None:
    # With kinks within steps of 24 ms, shifting times were off by milliseconds.
    points = np.linspace(0.6, 1.4, 9)[:, None]
    rough, tight = (ensemble.shifting_times(NOMINAL, HEAVY.conditions, ["initial_position"], points, accuracy)[0]
                    for accuracy in (LOOSE, ensemble.TIGHT))
    assert np.abs(rough - tight).max() < 1e-4
