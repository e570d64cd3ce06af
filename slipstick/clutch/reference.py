"""Reference implementation of eqs. 1-4: one engagement, integrated by SciPy's `solve_ivp` with event location.

It shares only the parameters, conditions, converter curves, effects and laws with the compiled integrator (`ensemble`).
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions, reversals
from slipstick.clutch import effects
from slipstick.clutch.active_effects import sensor_reading
from slipstick.clutch.effects.effect import SENSORS, Signals
from slipstick.clutch.model import Model

REST, SLIP, STICK = "rest", "slip", "stick"
DIFFERENCE_STEP = 1e-8
"""Step in s of the difference quotient of the line pressure."""


class Engagement:
    """One engagement. The state vector y is x1, x2, x3, Omega, omega, the memories of effects in catalogue order, and
    heat and time in contact for the laws.

    The discrete state (`REST`, `SLIP` or `STICK`), the sign of the slip and the segment of the profile are constant
    within a call of `solve_ivp`.
    """

    def __init__(self, model: Model, conditions: Conditions, condition: int) -> None:
        """Set up the engagement of condition number `condition`, at t = 0 and at rest."""
        self.p = SimpleNamespace(**dict(zip(parameters.NAMES, model.parameters, strict=True)))
        self.effects = [(effect, model.coefficients_of(effect)) for effect in effects.CATALOGUE
                        if effect.name in model.effects and effect.quantity not in SENSORS]
        self.memories = [effect.name for effect, _ in self.effects if effect.memory]
        self.laws = [law for law in model.laws if not law.of_sensor]
        self.formula_input: dict[str, float] = {}
        self.motor_speed = float(conditions.motor_speed[condition])
        self.converter = model.converter
        self.input_torque = 0.0 if conditions.input_torque is None else float(conditions.input_torque[condition])
        self.initial_input_speed = (None if conditions.initial_input_speed is None
                                    else float(conditions.initial_input_speed[condition]))
        self.load_inertia = float(conditions.load_inertia[condition])
        self.brake_torque = float(conditions.brake_torque[condition])
        self.run = 0.0 if conditions.run_order is None else float(conditions.run_order[condition]) / 100
        profile = conditions.current_profile[condition]
        self.profile_time, self.profile_current = conditions.profile_time[profile], conditions.profile_current[profile]
        given = conditions.profile_input_torque
        self.profile_torque = np.zeros_like(self.profile_time) if given is None else given[profile]
        self.reversals, self.segment = reversals(self.profile_current), 0
        self.discrete_state, self.direction = REST, 1.0

    def initial_state_vector(self) -> np.ndarray:
        """State vector (7 + memories,) at t = 0; at the initial input speed converter torque and losses balance."""
        def net_torque(speed: float) -> float:
            losses = self.p.input_viscous * speed + self.p.input_coulomb
            return float(self.converter.torque(speed, self.motor_speed) - losses)
        speed = self.initial_input_speed
        if speed is None:
            speed = brentq(net_torque, 0.0, 2 * self.motor_speed, xtol=1e-13)
        y = np.array([0.0, 0.0, self.p.initial_position, speed, 0.0, *np.zeros(len(self.memories)), 0.0, 0.0])
        self.evaluate(0.0, y)
        relaxed = [effect.name for effect, _ in self.effects if effect.memory and effect.memory.relaxed]
        y[5:-2] = [self.formula_input[name] if name in relaxed else 0.0 for name in self.memories]
        return y

    def signals(self, t: float, y: np.ndarray, name: str, torque: float = 0.0, power: float = 0.0) -> Signals:
        """Signals available to the effect `name`."""
        direction, reversal, swing = self.reversals[self.segment]
        memory = y[5 + self.memories.index(name)] if name in self.memories else 0.0
        return Signals(time=t, pressure=y[0], pressure_rate=y[1], piston_state=y[2], input_speed=y[3],
                       output_speed=y[4], plate_slip=y[3] - self.p.gear_ratio * y[4], motor_speed=self.motor_speed,
                       current=self.current(t), current_direction=direction, current_reversal=reversal,
                       current_swing=swing, run=self.run, stuck=float(self.discrete_state == STICK),
                       clutch_torque=torque, friction_power=power, memory=memory)

    def with_effects(self, quantity: str, value: float, t: float, y: np.ndarray) -> float:
        """`value` of `quantity` after all effects and laws on it."""
        for effect, coefficients in self.effects:
            if effect.quantity == quantity:
                self.formula_input[effect.name] = value
                signals = self.signals(t, y, effect.name)
                if t == 0 and effect.memory and effect.memory.relaxed:
                    signals = signals._replace(memory=value)
                value = effect.formula(value, signals, coefficients)
        for law in self.laws:
            if law.quantity == quantity:
                value = law.changed(value, self.dependence(law.depends_on, t, y))
        return value

    def dependence(self, name: str, t: float, y: np.ndarray) -> float:
        """What a law depends on (`laws.DEPENDENCES`)."""
        p, (x1, x2, x3, input_speed, output_speed) = self.p, y[:5]
        return float({
            "motor speed": self.motor_speed, "input speed": input_speed, "output speed": output_speed,
            "slip": abs(input_speed - p.gear_ratio * output_speed), "pressure": x1, "current": self.current(t),
            "time": t, "run order": 100 * self.run, "heat": y[-2], "time in contact": y[-1],
            "piston position": min(p.contact_position, max(0.0, p.temperature_gain * x3)),
            "piston rate": self.piston_rate(x1, x2, x3),
        }[name])

    def piston_rate(self, pressure: float, pressure_rate: float, piston_state: float) -> float:
        """x3' of eq. 1 in m/s."""
        p = self.p
        force = p.piston_pressure * (pressure - p.pressure_bias) + p.piston_pressure_rate * pressure_rate
        return float((force - p.piston_return * piston_state) / p.piston_inertia)

    def current(self, t: float) -> float:
        """Valve current of the profile in A, on the active segment."""
        time, current, i = self.profile_time, self.profile_current, self.segment
        return float(current[i] + (current[i + 1] - current[i]) / (time[i + 1] - time[i]) * (t - time[i]))

    def line_pressure(self, t: float, y: np.ndarray) -> float:
        """Steady pressure in bar commanded by the valve."""
        current = self.with_effects("valve current", self.current(t), t, y)
        return self.with_effects("line pressure", self.p.current_gain * (current - self.p.current_bias), t, y)

    def hydraulics(self, t: float, y: np.ndarray) -> tuple[list[float], float, float]:
        """Eq. 1 except for the derivative of the line pressure.

        Returns the rates of x1, x2, x3, the clearance in m and the contact pressure in Pa.
        """
        p, (x1, x2, x3), tau = self.p, y[:3], self.p.current_delay
        curvature = 6 / tau**2 * (self.line_pressure(t, y) - x1) - 4 / tau * x2
        chamber = self.with_effects("chamber pressure", x1, t, y)
        gain = self.with_effects("piston gain", p.temperature_gain, t, y)
        clearance = max(0.0, self.with_effects("clearance", p.contact_position - max(0.0, gain * x3), t, y))
        position_ratio = max(0.0, (p.contact_position - clearance) / (p.contact_position - p.contact_length))
        contact = self.with_effects("contact pressure", position_ratio * 1e5 * max(0.0, chamber), t, y)
        piston_rate = self.with_effects("piston rate", self.piston_rate(chamber, x2, x3), t, y)
        return [x2, curvature, piston_rate], clearance, contact

    def evaluate(self, t: float, y: np.ndarray) -> SimpleNamespace:
        """Eqs. 1-4: `rates` (7 + memories,), clutch `torque` (N m), `net` torque on the load (N m), stick torque of a
        `rigid` coupling (N m), its `excess` over the friction capacity (N m), and `piston` position (m)."""
        p = self.p
        hydraulic, clearance, contact = self.hydraulics(t, y)
        width = p.ramp_share * p.contact_position
        s = min(1.0, max(0.0, 1 - clearance / width))
        per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / clearance
        film = self.with_effects("film torque", p.film_coefficient * per_gap * (y[3] / p.gear_ratio - y[4]), t, y)
        friction = self.with_effects("friction coefficient", p.friction_coefficient, t, y)
        ramp = s * s * (3 - 2 * s)
        capacity = ramp * friction * contact
        given = self.converter.torque(y[3], self.motor_speed) + self.input_torque + float(
            np.interp(t, self.profile_time, self.profile_torque))
        drive = (self.with_effects("converter torque", given, t, y)
                 - p.input_viscous * y[3] - p.input_coulomb)
        brake = self.with_effects("brake torque", self.brake_torque, t, y)
        load = self.with_effects("load torque", brake + p.output_viscous * y[4], t, y)

        stick_rate = (drive - load / p.gear_ratio) / (p.input_inertia + self.load_inertia / p.gear_ratio**2)
        rigid = drive - p.input_inertia * stick_rate
        stick_torque = self.with_effects("stick torque", rigid, t, y)
        torque = stick_torque if self.discrete_state == STICK else film + capacity * self.direction
        net = p.gear_ratio * torque - load
        if self.discrete_state == STICK and stick_torque == rigid:
            shafts = [stick_rate, stick_rate / p.gear_ratio]
        else:
            load_rate = net / self.load_inertia if self.discrete_state != REST else 0.0
            shafts = [(drive - torque) / p.input_inertia, load_rate]
        power = 0.0 if self.discrete_state == STICK else capacity * abs(y[3] - p.gear_ratio * y[4])
        memory_rates = [effect.memory.rate(self.formula_input[effect.name],
                                           self.signals(t, y, effect.name, torque, power), coefficients)
                        for effect, coefficients in self.effects if effect.memory]
        rates = np.array([*hydraulic, *shafts, *memory_rates, 1e-3 * power, ramp])
        next_pressure = self.line_pressure(t + DIFFERENCE_STEP, y + DIFFERENCE_STEP * rates)
        rates[1] -= 2 / p.current_delay * (next_pressure - self.line_pressure(t, y)) / DIFFERENCE_STEP
        return SimpleNamespace(rates=rates, torque=torque, net=net, rigid=rigid, excess=abs(rigid) - capacity,
                               piston=p.contact_position - clearance)

    def events(self) -> list[Callable[..., float]]:
        """Events for `solve_ivp` that end the discrete state."""
        def locks(t: float, y: np.ndarray) -> float:
            return float(self.direction * (y[3] / self.p.gear_ratio - y[4]))

        def stops(t: float, y: np.ndarray) -> float:
            return float(y[4])

        def breaks_away(t: float, y: np.ndarray) -> float:
            return -float(self.evaluate(t, y).net)

        def releases(t: float, y: np.ndarray) -> float:
            return -float(self.evaluate(t, y).excess)

        by_state: dict[str, list[Callable[..., float]]] = {REST: [breaks_away], SLIP: [locks, stops], STICK: [releases]}
        events = by_state[self.discrete_state]
        for event in events:
            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return events

    def enter_next_state(self, t: float, y: np.ndarray, stopped: bool) -> None:
        """Enter the discrete state after an event; the load never moves backwards."""
        if self.discrete_state == STICK:
            self.discrete_state, self.direction = SLIP, float(np.sign(self.evaluate(t, y).rigid))
        elif self.discrete_state == REST:
            self.discrete_state = SLIP
        elif stopped:
            self.discrete_state, y[4] = REST, 0.0
        else:
            self.discrete_state, y[4] = STICK, y[3] / self.p.gear_ratio
            if self.evaluate(t, y).excess > 0:
                self.enter_next_state(t, y, stopped=False)


def simulate(model: Model, conditions: Conditions, condition: int, sample_times: np.ndarray | None = None,
             tolerance: float = 1e-9) -> tuple[float, np.ndarray]:
    """Shifting time in s (NaN without lock-up within the current profile) and signals (k, 5) of one engagement.

    `sample_times` (k,) are in s, within the profile. Columns: pressure bar, input speed rad/s, output speed rad/s,
    output torque N m, piston position m.
    """
    engagement = Engagement(model, conditions, condition)
    times = np.empty(0) if sample_times is None else np.asarray(sample_times, float)
    signals, shifting_time = np.full((len(times), 5), np.nan), np.nan
    t, y = 0.0, engagement.initial_state_vector()
    for segment, end in enumerate(engagement.profile_time[1:]):
        engagement.segment = segment
        while t < end:
            solution: Any = solve_ivp(lambda t, y: engagement.evaluate(t, y).rates, (t, end), y, rtol=tolerance,
                                      atol=tolerance * 1e-3, max_step=0.005, dense_output=True,
                                      events=engagement.events())
            for row in np.flatnonzero((times >= t) & (times <= solution.t[-1])):
                vector = solution.sol(times[row])
                values = engagement.evaluate(times[row], vector)
                output_torque = engagement.p.gear_ratio * values.torque
                signals[row] = vector[0], vector[3], vector[4], output_torque, values.piston
            t, y = float(solution.t[-1]), solution.y[:, -1]
            if solution.status == 1:
                slipping = engagement.discrete_state == SLIP
                stopped = slipping and len(solution.t_events[1]) > 0
                if slipping and not stopped and np.isnan(shifting_time):
                    shifting_time = t
                engagement.enter_next_state(t, y, stopped)
        if not np.isnan(shifting_time) and (len(times) == 0 or t >= times[-1]):
            break
    coefficients, true = model.coefficients()[None], signals.copy()
    for column, sensor in enumerate(SENSORS if len(times) else ()):
        signals[:, column] = sensor_reading(true[None, :, column], sensor, times, coefficients)[0]
        for law in (law for law in model.laws if law.quantity == sensor):
            for k, time in enumerate(times.tolist()):
                known = {"time": time, "motor speed": engagement.motor_speed, "run order": 100 * engagement.run,
                         **{name.removesuffix(" sensor"): true[k, place] for place, name in enumerate(SENSORS)}}
                signals[k, column] = law.changed(signals[k, column], known[law.depends_on])
    return float(shifting_time), signals
