"""The exact solution of eq. 1 against the matrix exponential, and its place among the effects."""

import numpy as np
import pytest
from scipy.linalg import expm

from slipstick.bench import Bench, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from tests.benches import BENCHES, HEAVY, NOMINAL

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
