"""A straightforward implementation: eqs. 1-4 in Python for `solve_ivp` of SciPy, one engagement at a time."""

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.benches import HEAVY
from slipstick.bench import Conditions

CONVERTER = HEAVY.physics.curves


def shifting_time(p: dict[str, float], conditions: Conditions, i: int, rtol: float = 1e-5) -> float:
    speed, inertia, brake = conditions.motor_speed[i], conditions.load_inertia[i], conditions.brake_torque[i]
    time = conditions.profile_time[conditions.current_profile[i]]
    current = conditions.profile_current[conditions.current_profile[i]]
    tau, k, gear = p["current_delay"], p["current_gain"], p["gear_ratio"]
    width = p["ramp_share"] * p["contact_position"]

    def rates(t, y, slope):
        x1, x2, x3, w, v = y
        u = np.interp(t, time, current)
        dx2 = (6 * k * (u - p["current_bias"]) - 6 * x1) / tau**2 - (4 * x2 + 2 * k * slope) / tau
        dx3 = (p["piston_pressure"] * (x1 - p["pressure_bias"]) + p["piston_pressure_rate"] * x2
               - p["piston_return"] * x3) / p["piston_inertia"]
        z = min(p["contact_position"], max(0.0, p["temperature_gain"] * x3))
        s = min(1.0, max(0.0, 1 - (p["contact_position"] - z) / width))
        freg = s * s * (3 - 2 * s)
        per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / (p["contact_position"] - z)
        contact = z / (p["contact_position"] - p["contact_length"]) * 1e5 * max(0.0, x1)
        torque = p["film_coefficient"] * per_gap * (w / gear - v) + freg * p["friction_coefficient"] * contact
        drive = CONVERTER.torque(w, speed) - p["input_viscous"] * w - p["input_coulomb"]
        net = gear * torque - brake - p["output_viscous"] * v
        return [x2, dx2, dx3, (drive - torque) / p["input_inertia"], net / inertia if v > 0 or net > 0 else 0.0]

    def locks(t, y, slope):
        return y[3] / gear - y[4]

    locks.terminal, locks.direction = True, -1
    low, high = 0.0, 2 * speed
    for _ in range(50):
        w = 0.5 * (low + high)
        surplus = CONVERTER.torque(w, speed) - p["input_viscous"] * w - p["input_coulomb"]
        low, high = (w, high) if surplus > 0 else (low, w)
    y = np.array([0.0, 0.0, p["initial_position"], w, 0.0])
    for start, end, first, last in zip(time, time[1:], current, current[1:]):  # noqa: B905
        slope = (last - first) / (end - start)
        solution = solve_ivp(rates, (start, end), y, args=(slope,), events=locks, rtol=rtol, atol=1e-7, max_step=0.02)
        if solution.status == 1:
            return solution.t[-1]
        y = solution.y[:, -1]
    return np.nan
