"""The readable twin of `ensemble`: eqs. 1-4 for one engagement on scipy's `solve_ivp`, with located transitions.

It shares the parameters, the converter curves and the effects' formulas with the compiled integrator, nothing else.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from slipstick.clutch import converter, effects, parameters
from slipstick.clutch.conditions import Conditions
from slipstick.clutch.effects.effect import Signals
from slipstick.clutch.model import Model

REST, SLIP, STICK = "rest", "slip", "stick"


class Engagement:
    """One engagement; states y are x1, x2, x3, Omega, omega. Mode and direction of the slip are frozen in a solve."""

    def __init__(self, model: Model, conditions: Conditions, condition: int) -> None:
        """Take condition number `condition` of `conditions`, at t = 0 and at rest."""
        self.p = SimpleNamespace(**dict(zip(parameters.NAMES, model.parameters, strict=True)))
        self.effects = [(effect, model.coefficients_of(effect)) for effect in effects.CATALOGUE
                        if effect.name in model.effects]
        self.motor_speed = float(conditions.motor_speed[condition])
        self.load_inertia = float(conditions.load_inertia[condition])
        self.brake_torque = float(conditions.brake_torque[condition])
        profile = conditions.current_profile[condition]
        self.profile_time, self.profile_current = conditions.profile_time[profile], conditions.profile_current[profile]
        self.mode, self.direction = REST, 1.0

    def initial_state(self) -> np.ndarray:
        """At rest, with the input speed at which the converter drives just the input losses: shape (5,)."""
        def surplus(speed: float) -> float:
            losses = self.p.input_viscous * speed + self.p.input_coulomb
            return float(converter.torque(speed, self.motor_speed) - losses)
        speed = brentq(surplus, 0.0, 2 * self.motor_speed, xtol=1e-13)
        return np.array([0.0, 0.0, self.p.initial_position, speed, 0.0])

    def changed(self, quantity: str, value: float, t: float, y: np.ndarray) -> float:
        """`value` after all effects of the model on `quantity`."""
        x1, x2, x3, speed, load_speed = y
        seen = Signals(t, x1, x2, x3, speed, load_speed, speed - self.p.gear_ratio * load_speed, self.motor_speed)
        for effect, coefficients in self.effects:
            if effect.quantity == quantity:
                value = effect.formula(value, seen, coefficients)
        return value

    def hydraulics(self, t: float, y: np.ndarray, slope: float) -> tuple[list[float], float, float]:
        """Eq. 1 with the current rising at `slope` A/s: rates of x1, x2, x3; clearance in m; contact pressure in Pa."""
        p, (x1, x2, x3) = self.p, y[:3]
        current = self.changed("valve current", float(np.interp(t, self.profile_time, self.profile_current)), t, y)
        chamber = self.changed("chamber pressure", x1, t, y)
        tau, gain = p.current_delay, p.current_gain
        curvature = (6 * gain / tau**2 * (current - p.current_bias) - 2 * gain / tau * slope
                     - 6 / tau**2 * x1 - 4 / tau * x2)
        piston_rate = (p.piston_pressure * (chamber - p.pressure_bias) + p.piston_pressure_rate * x2
                       - p.piston_return * x3) / p.piston_inertia
        z = min(p.contact_position, max(0.0, p.temperature_gain * x3))
        clearance = self.changed("clearance", p.contact_position - z, t, y)
        share = max(0.0, (p.contact_position - clearance) / (p.contact_position - p.contact_length))
        contact = self.changed("contact pressure", share * 1e5 * max(0.0, chamber), t, y)
        return [x2, curvature, self.changed("piston rate", piston_rate, t, y)], clearance, contact

    def evaluate(self, t: float, y: np.ndarray, slope: float) -> SimpleNamespace:
        """Eqs. 1-4: `rates` (5,), `torque` through the clutch, what is left to move the load (`net`), `excess` of the
        torque that sticking needs over what the plates can hold (N m), and `piston` position (m)."""
        p = self.p
        hydraulic, clearance, contact = self.hydraulics(t, y, slope)
        width = p.ramp_share * p.contact_position
        s = min(1.0, max(0.0, 1 - clearance / width))
        per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / clearance
        film = self.changed("film torque", p.film_coefficient * per_gap * (y[3] / p.gear_ratio - y[4]), t, y)
        capacity = s * s * (3 - 2 * s) * self.changed("friction coefficient", p.friction_coefficient, t, y) * contact
        drive = (self.changed("converter torque", converter.torque(y[3], self.motor_speed), t, y)
                 - p.input_viscous * y[3] - p.input_coulomb)
        load = self.changed("load torque", self.brake_torque + p.output_viscous * y[4], t, y)

        stick_rate = (drive - load / p.gear_ratio) / (p.input_inertia + self.load_inertia / p.gear_ratio**2)
        stick_torque = drive - p.input_inertia * stick_rate
        torque = stick_torque if self.mode == STICK else film + capacity * self.direction
        net = p.gear_ratio * torque - load
        if self.mode == STICK:
            shafts = [stick_rate, stick_rate / p.gear_ratio]
        else:
            shafts = [(drive - torque) / p.input_inertia, net / self.load_inertia if self.mode == SLIP else 0.0]
        return SimpleNamespace(rates=[*hydraulic, *shafts], torque=torque, net=net, stick_torque=stick_torque,
                               excess=abs(stick_torque) - capacity, piston=p.contact_position - clearance)

    def ends(self) -> list[Callable[..., float]]:
        """What ends the present mode, as events for `solve_ivp`."""
        def locks(t: float, y: np.ndarray, slope: float) -> float:
            return float(self.direction * (y[3] / self.p.gear_ratio - y[4]))

        def stops(t: float, y: np.ndarray, slope: float) -> float:
            return float(y[4])

        def breaks_away(t: float, y: np.ndarray, slope: float) -> float:
            return -float(self.evaluate(t, y, slope).net)

        def releases(t: float, y: np.ndarray, slope: float) -> float:
            return -float(self.evaluate(t, y, slope).excess)

        found: list[Callable[..., float]] = {REST: [breaks_away], SLIP: [locks, stops], STICK: [releases]}[self.mode]
        for event in found:
            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return found

    def change_mode(self, t: float, y: np.ndarray, slope: float, stopped: bool) -> None:
        """Go from the mode that has just ended to the one that begins; the load never runs backwards."""
        if self.mode == STICK:
            self.mode, self.direction = SLIP, float(np.sign(self.evaluate(t, y, slope).stick_torque))
        elif self.mode == REST:
            self.mode = SLIP
        elif stopped:
            self.mode, y[4] = REST, 0.0
        else:
            self.mode, y[4] = STICK, y[3] / self.p.gear_ratio
            if self.evaluate(t, y, slope).excess > 0:
                self.change_mode(t, y, slope, stopped=False)


def simulate(model: Model, conditions: Conditions, condition: int, sample_times: np.ndarray | None = None,
             tolerance: float = 1e-9) -> tuple[float, np.ndarray]:
    """Shifting time in s (NaN if it does not lock while its current profile lasts) and signals (k, 5) of an engagement.

    `sample_times` (k,) in s, within the profile. Columns: pressure bar, input speed rad/s, output speed rad/s, output
    torque N m, piston position m.
    """
    run = Engagement(model, conditions, condition)
    wanted = np.empty(0) if sample_times is None else np.asarray(sample_times, float)
    signals, shifting_time = np.full((len(wanted), 5), np.nan), np.nan
    t, y = 0.0, run.initial_state()
    for start, end, low, high in zip(run.profile_time, run.profile_time[1:], run.profile_current,
                                     run.profile_current[1:], strict=False):
        slope = (high - low) / (end - start)
        while t < end:
            solution: Any = solve_ivp(lambda t, y, slope: run.evaluate(t, y, slope).rates, (t, end), y, args=(slope,),
                                      rtol=tolerance, atol=tolerance * 1e-3, max_step=0.005, dense_output=True,
                                      events=run.ends())
            for row in np.flatnonzero((wanted >= t) & (wanted <= solution.t[-1])):
                state = solution.sol(wanted[row])
                now = run.evaluate(wanted[row], state, slope)
                signals[row] = state[0], state[3], state[4], run.p.gear_ratio * now.torque, now.piston
            t, y = float(solution.t[-1]), solution.y[:, -1]
            if solution.status == 1:
                stopped = run.mode == SLIP and len(solution.t_events[1]) > 0
                if run.mode == SLIP and not stopped and np.isnan(shifting_time):
                    shifting_time = t
                run.change_mode(t, y, slope, stopped)
        if not np.isnan(shifting_time) and (len(wanted) == 0 or t >= wanted[-1]):
            break
    return float(shifting_time), signals
