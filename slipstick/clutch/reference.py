"""The readable twin of `ensemble`: eqs. 1-4 for one engagement on scipy's `solve_ivp`, with located transitions.

It shares the parameters, the conditions, the converter curves and the effects with the compiled integrator, no more.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from slipstick.clutch import converter, effects, parameters
from slipstick.clutch.active_effects import sensor_reading
from slipstick.clutch.conditions import Conditions, reversals
from slipstick.clutch.effects.effect import SENSORS, Signals
from slipstick.clutch.model import Model

REST, SLIP, STICK = "rest", "slip", "stick"
MOMENT = 1e-8
"""Difference in s from which the slope of the line pressure is taken."""


class Engagement:
    """One engagement; states y are x1, x2, x3, Omega, omega, and what effects remember, in the order of the catalogue.

    Mode and direction of the slip are frozen in a solve, and so is the straight line of the current.
    """

    def __init__(self, model: Model, conditions: Conditions, condition: int) -> None:
        """Take condition number `condition` of `conditions`, at t = 0 and at rest."""
        self.p = SimpleNamespace(**dict(zip(parameters.NAMES, model.parameters, strict=True)))
        self.effects = [(effect, model.coefficients_of(effect)) for effect in effects.CATALOGUE
                        if effect.name in model.effects and effect.quantity not in SENSORS]
        self.memories = [effect.name for effect, _ in self.effects if effect.memory]
        self.given: dict[str, float] = {}
        self.motor_speed = float(conditions.motor_speed[condition])
        self.load_inertia = float(conditions.load_inertia[condition])
        self.brake_torque = float(conditions.brake_torque[condition])
        self.run = 0.0 if conditions.run_order is None else float(conditions.run_order[condition]) / 100
        profile = conditions.current_profile[condition]
        self.profile_time, self.profile_current = conditions.profile_time[profile], conditions.profile_current[profile]
        self.reversals, self.line = reversals(self.profile_current), 0
        self.mode, self.direction = REST, 1.0

    def initial_state(self) -> np.ndarray:
        """At rest, with the input speed at which the converter drives just the input losses: shape (5 + memories,)."""
        def surplus(speed: float) -> float:
            losses = self.p.input_viscous * speed + self.p.input_coulomb
            return float(converter.torque(speed, self.motor_speed) - losses)
        speed = brentq(surplus, 0.0, 2 * self.motor_speed, xtol=1e-13)
        y = np.array([0.0, 0.0, self.p.initial_position, speed, 0.0, *np.zeros(len(self.memories))])
        self.evaluate(0.0, y)
        relaxed = [effect.name for effect, _ in self.effects if effect.memory and effect.memory.relaxed]
        y[5:] = [self.given[name] if name in relaxed else 0.0 for name in self.memories]
        return y

    def seen(self, t: float, y: np.ndarray, name: str, torque: float = 0.0, power: float = 0.0) -> Signals:
        """What the effect `name` may look at."""
        direction, turn, swing = self.reversals[self.line]
        remembered = y[5 + self.memories.index(name)] if name in self.memories else 0.0
        return Signals(time=t, pressure=y[0], pressure_rate=y[1], piston_state=y[2], input_speed=y[3],
                       output_speed=y[4], plate_slip=y[3] - self.p.gear_ratio * y[4], motor_speed=self.motor_speed,
                       current=self.current(t), current_direction=direction, current_reversal=turn, current_swing=swing,
                       run=self.run, stuck=float(self.mode == STICK), clutch_torque=torque, friction_power=power,
                       memory=remembered)

    def changed(self, quantity: str, value: float, t: float, y: np.ndarray) -> float:
        """`value` after all effects of the model on `quantity`."""
        for effect, coefficients in self.effects:
            if effect.quantity == quantity:
                self.given[effect.name] = value
                seen = self.seen(t, y, effect.name)
                if t == 0 and effect.memory and effect.memory.relaxed:
                    seen = seen._replace(memory=value)
                value = effect.formula(value, seen, coefficients)
        return value

    def current(self, t: float) -> float:
        """Valve current of the profile in A, on its present straight line."""
        time, current, i = self.profile_time, self.profile_current, self.line
        return float(current[i] + (current[i + 1] - current[i]) / (time[i + 1] - time[i]) * (t - time[i]))

    def line_pressure(self, t: float, y: np.ndarray) -> float:
        """The pressure in bar that the valve asks for."""
        current = self.changed("valve current", self.current(t), t, y)
        return self.changed("line pressure", self.p.current_gain * (current - self.p.current_bias), t, y)

    def hydraulics(self, t: float, y: np.ndarray) -> tuple[list[float], float, float]:
        """Eq. 1 but for the slope of the line pressure: rates of x1, x2, x3; clearance in m; contact pressure in Pa."""
        p, (x1, x2, x3), tau = self.p, y[:3], self.p.current_delay
        curvature = 6 / tau**2 * (self.line_pressure(t, y) - x1) - 4 / tau * x2
        chamber = self.changed("chamber pressure", x1, t, y)
        piston_rate = (p.piston_pressure * (chamber - p.pressure_bias) + p.piston_pressure_rate * x2
                       - p.piston_return * x3) / p.piston_inertia
        gain = self.changed("piston gain", p.temperature_gain, t, y)
        clearance = max(0.0, self.changed("clearance", p.contact_position - max(0.0, gain * x3), t, y))
        share = max(0.0, (p.contact_position - clearance) / (p.contact_position - p.contact_length))
        contact = self.changed("contact pressure", share * 1e5 * max(0.0, chamber), t, y)
        return [x2, curvature, self.changed("piston rate", piston_rate, t, y)], clearance, contact

    def evaluate(self, t: float, y: np.ndarray) -> SimpleNamespace:
        """Eqs. 1-4: `rates` (5 + memories,), `torque` through the clutch, what is left to move the load (`net`),
        `excess` of the torque that sticking needs over what the plates can hold (N m), and `piston` position (m)."""
        p = self.p
        hydraulic, clearance, contact = self.hydraulics(t, y)
        width = p.ramp_share * p.contact_position
        s = min(1.0, max(0.0, 1 - clearance / width))
        per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / clearance
        film = self.changed("film torque", p.film_coefficient * per_gap * (y[3] / p.gear_ratio - y[4]), t, y)
        capacity = s * s * (3 - 2 * s) * self.changed("friction coefficient", p.friction_coefficient, t, y) * contact
        drive = (self.changed("converter torque", converter.torque(y[3], self.motor_speed), t, y)
                 - p.input_viscous * y[3] - p.input_coulomb)
        load = self.changed("load torque", self.brake_torque + p.output_viscous * y[4], t, y)

        stick_rate = (drive - load / p.gear_ratio) / (p.input_inertia + self.load_inertia / p.gear_ratio**2)
        rigid = drive - p.input_inertia * stick_rate
        stick_torque = self.changed("stick torque", rigid, t, y)
        torque = stick_torque if self.mode == STICK else film + capacity * self.direction
        net = p.gear_ratio * torque - load
        if self.mode == STICK and stick_torque == rigid:
            shafts = [stick_rate, stick_rate / p.gear_ratio]
        else:
            shafts = [(drive - torque) / p.input_inertia, net / self.load_inertia if self.mode != REST else 0.0]
        power = 0.0 if self.mode == STICK else capacity * abs(y[3] - p.gear_ratio * y[4])
        moves = [effect.memory.rate(self.given[effect.name], self.seen(t, y, effect.name, torque, power), coefficients)
                 for effect, coefficients in self.effects if effect.memory]
        rates = np.array([*hydraulic, *shafts, *moves])
        later = self.line_pressure(t + MOMENT, y + MOMENT * rates)
        rates[1] -= 2 / p.current_delay * (later - self.line_pressure(t, y)) / MOMENT
        return SimpleNamespace(rates=rates, torque=torque, net=net, rigid=rigid, excess=abs(rigid) - capacity,
                               piston=p.contact_position - clearance)

    def ends(self) -> list[Callable[..., float]]:
        """What ends the present mode, as events for `solve_ivp`."""
        def locks(t: float, y: np.ndarray) -> float:
            return float(self.direction * (y[3] / self.p.gear_ratio - y[4]))

        def stops(t: float, y: np.ndarray) -> float:
            return float(y[4])

        def breaks_away(t: float, y: np.ndarray) -> float:
            return -float(self.evaluate(t, y).net)

        def releases(t: float, y: np.ndarray) -> float:
            return -float(self.evaluate(t, y).excess)

        found: list[Callable[..., float]] = {REST: [breaks_away], SLIP: [locks, stops], STICK: [releases]}[self.mode]
        for event in found:
            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return found

    def change_mode(self, t: float, y: np.ndarray, stopped: bool) -> None:
        """Go from the mode that has just ended to the one that begins; the load never runs backwards."""
        if self.mode == STICK:
            self.mode, self.direction = SLIP, float(np.sign(self.evaluate(t, y).rigid))
        elif self.mode == REST:
            self.mode = SLIP
        elif stopped:
            self.mode, y[4] = REST, 0.0
        else:
            self.mode, y[4] = STICK, y[3] / self.p.gear_ratio
            if self.evaluate(t, y).excess > 0:
                self.change_mode(t, y, stopped=False)


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
    for line, end in enumerate(run.profile_time[1:]):
        run.line = line
        while t < end:
            solution: Any = solve_ivp(lambda t, y: run.evaluate(t, y).rates, (t, end), y, rtol=tolerance,
                                      atol=tolerance * 1e-3, max_step=0.005, dense_output=True, events=run.ends())
            for row in np.flatnonzero((wanted >= t) & (wanted <= solution.t[-1])):
                state = solution.sol(wanted[row])
                now = run.evaluate(wanted[row], state)
                signals[row] = state[0], state[3], state[4], run.p.gear_ratio * now.torque, now.piston
            t, y = float(solution.t[-1]), solution.y[:, -1]
            if solution.status == 1:
                stopped = run.mode == SLIP and len(solution.t_events[1]) > 0
                if run.mode == SLIP and not stopped and np.isnan(shifting_time):
                    shifting_time = t
                run.change_mode(t, y, stopped)
        if not np.isnan(shifting_time) and (len(wanted) == 0 or t >= wanted[-1]):
            break
    coefficients = model.coefficients()[None]
    for column, sensor in enumerate(SENSORS if len(wanted) else ()):
        signals[:, column] = shown(signals[None, :, column], sensor, wanted, coefficients)[0]
    return float(shifting_time), signals
