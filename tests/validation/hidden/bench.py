"""The equations of the bench: those of the paper, in which effects can change every quantity.

Lanes are engagements. States: pressure and its rate, piston position, input and output speed, and the states of effects
(dissipated energy, contact time, lagged friction and converter torque, shaft twist), which have no influence unless an
effect uses them. A phase consists of the piece of the current, the mode (rest, slip or stick) and the sign of the slip.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from .effect import Effect
from .nominal import HEAVY, Setup

REST, SLIP, STICK = range(3)
PRESSURE, RATE, PISTON, INPUT, OUTPUT, ENERGY, CONTACT, FRICTION, CONVERTER, TWIST = range(10)
TOLERANCE = np.array([1e-6, 1e-4, 1e-10, 1e-6, 1e-6, 1e-3, 1e-7, 1e-4, 1e-4, 1e-9])[:, None]
RING_DAMPING = 0.08  # damping ratio of the shaft oscillation after lock-up

Quantities = dict[str, np.ndarray]


@dataclass(frozen=True)
class Bench:
    """n engagements: `values` of the parameters, conditions, and position in the test sequence (0 to 1), each (n,).

    The current is linear between the values `knot_current` at the times `knot_time`, (n, m); the last knot may be
    repeated. The motor speed is lower than `motor_speed` by the fraction `sag` at the largest torque on the pump.
    `clocks` gives the delays of sensors in sampling periods, at most 1.
    """

    values: Mapping[str, np.ndarray]
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    sequence: np.ndarray
    knot_time: np.ndarray
    knot_current: np.ndarray
    effects: tuple[tuple[Effect, float], ...] = ()
    setup: Setup = HEAVY
    sag: float = 0.0
    clocks: Mapping[str, float] = field(default_factory=dict)

    tolerance = TOLERANCE

    def take(self, lanes: np.ndarray) -> "Bench":
        """Return the engagements at the indices `lanes`, which may repeat."""
        columns = {column.name: getattr(self, column.name) for column in fields(self)}
        arrays = {name: column[lanes] for name, column in columns.items() if isinstance(column, np.ndarray)}
        return replace(self, values={name: value[lanes] for name, value in self.values.items()}, **arrays)

    @cached_property
    def _effects_on(self) -> dict[str, list[tuple[Effect, float]]]:
        effects_on: dict[str, list[tuple[Effect, float]]] = {}
        for effect, strength in self.effects:
            effects_on.setdefault(effect.quantity, []).append((effect, strength))
        return effects_on

    def change(self, effect: Effect, strength: float, abscissa: np.ndarray) -> np.ndarray:
        """Return the change of the effect's quantity at values of its abscissa, in the units of both."""
        scale = self.setup.scale
        change = effect.law(strength, abscissa / scale.get(effect.abscissa, 1.0))
        return change * scale.get(effect.quantity, 1.0) if effect.kind == "difference" else change

    def _with_effects(self, quantity: str, value: np.ndarray, q: Quantities) -> np.ndarray:
        for effect, strength in self._effects_on.get(quantity, ()):
            change = self.change(effect, strength, q[effect.abscissa])
            value = value * change if effect.kind == "ratio" else value + change
        q[quantity] = value
        return value

    def limit(self, phase: np.ndarray) -> np.ndarray:
        return self.knot_time[np.arange(phase.shape[1]), phase[0] + 1]

    def advance(self, phase: np.ndarray, lanes: np.ndarray) -> None:
        phase[0, lanes] += 1

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Return states and phases at time 0, with the input speed at which converter torque and losses balance."""
        n = len(self.motor_speed)
        state, phase = np.zeros((len(TOLERANCE), n)), np.zeros((3, n), int)
        phase[2] = 1
        state[PISTON] = self.values["x30"]
        low, high = 0.5 * self.motor_speed, self.motor_speed.copy()
        for _ in range(60):
            state[INPUT] = (low + high) / 2
            q = self.quantities(np.zeros(n), state, phase)
            driven = q["converter_torque"] > q["input_drag"]
            low, high = np.where(driven, state[INPUT], low), np.where(driven, high, state[INPUT])
        state[CONVERTER] = q["converter_torque"]
        slipping = self.quantities(np.zeros(n), state, phase)["margin"] < 0
        phase[1, slipping] = SLIP
        return state, phase

    def rates(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = self.quantities(time, state, phase)
        return q["rates"], q["margin"]

    def switch(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray, lanes: np.ndarray) -> None:
        if not len(lanes):
            return
        # Transitions: rest -> slip, stick -> slip, and slip -> stick if the speeds are equal, otherwise slip -> rest.
        new_state, mode = state[:, lanes], phase[1, lanes]
        ratio = self.values["gr"][lanes]
        synchronised = (mode == SLIP) & (phase[2, lanes] * (new_state[INPUT] / ratio - new_state[OUTPUT]) < 0)
        q = self.take(lanes).quantities(time[lanes], new_state, phase[:, lanes])
        stopped = (mode == SLIP) & ~synchronised
        new_state[OUTPUT] = np.where(stopped, 0, np.where(synchronised, new_state[INPUT] / ratio, new_state[OUTPUT]))
        new_state[TWIST] = np.where(synchronised, q["shaft_compliance"] * q["output_torque"], new_state[TWIST])
        phase[1, lanes] = np.where(synchronised, STICK, np.where(mode == SLIP, REST, SLIP))
        phase[2, lanes] = np.where(mode == STICK, np.sign(q["output_torque"]), phase[2, lanes])
        state[:, lanes] = new_state

    def quantities(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> Quantities:
        """Return all quantities of the equations, (n,) each, with the `rates` of the states and the `margin`.

        The mode of an engagement ends when its margin becomes negative.
        """
        q: Quantities = {
            "time": time, "sequence": self.sequence, "motor_speed": self.motor_speed, "pressure": state[PRESSURE],
            "piston": state[PISTON], "input_speed": state[INPUT], "output_speed": state[OUTPUT],
            "energy": state[ENERGY], "contact_time": state[CONTACT], "pump_angle": 0.5 * self.motor_speed * time,
        }
        rates = np.zeros_like(state)
        self._hydraulics(q, rates, state, phase)
        self._clutch(q, rates, state, phase)
        self._shafts(q, rates, state, phase)
        q["rates"] = rates
        return q

    def _hydraulics(self, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v, lane, piece = self.values, np.arange(phase.shape[1]), phase[0]
        time, before = self.knot_time[lane, piece], self.knot_current[lane, piece]
        slope = (self.knot_current[lane, piece + 1] - before) / (self.knot_time[lane, piece + 1] - time)
        q["current"] = before + slope * (q["time"] - time)
        shifted = {"current": q["current"] + 1e-6}
        current = self._with_effects("valve_current", q["current"], q)
        slope = slope * (self._with_effects("valve_current", shifted["current"], shifted) - current) / 1e-6
        gain = self._with_effects("pressure_gain", v["k"], q)
        demand = self._with_effects("pressure_demand", gain * (current - v["a"]), q)
        rates[PRESSURE] = state[RATE]
        rates[RATE] = (6 * (demand - state[PRESSURE]) / v["tau"] - 4 * state[RATE] - 2 * gain * slope) / v["tau"]

        chamber = self._with_effects("chamber_pressure", state[PRESSURE], q)
        spring = self._with_effects("spring_rate", v["d2"], q) * state[PISTON]
        feed = self._with_effects("piston_feed", v["a2"], q) * state[RATE]
        q["driving_pressure"] = chamber - v["aa"] + (feed - spring) / v["b2"]
        q["free_piston_rate"] = v["b2"] / v["c2"] * self._with_effects("net_pressure", q["driving_pressure"], q)
        rates[PISTON] = self._with_effects("piston_rate", q["free_piston_rate"], q)

    def _clutch(self, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v = self.values
        clearance = self._with_effects("clearance", v["z_contact"], q)
        z = np.minimum(clearance, np.maximum(0, self._with_effects("oil_temperature_gain", v["kT"], q) * state[PISTON]))
        s = np.minimum(np.maximum(0, (z / clearance - 1 + v["eps"]) / v["eps"]), 1)
        regime = s * s * (3 - 2 * s)
        contact = z / (clearance - v["beta"]) * np.maximum(0, q["chamber_pressure"])
        slip = state[INPUT] / v["gr"] - state[OUTPUT]
        q.update(piston_position=z, contact_pressure=contact, slip=np.abs(slip),
                   load_point=self.motor_speed / 150 * contact / 5)
        friction = regime * self._with_effects("friction_coefficient", v["alpha"], q) * 1e5 * contact
        friction = self._lagged("friction_lag", FRICTION, friction, q, rates, state)
        film = self._with_effects("film_coefficient", v["gamma"], q)
        shortest = v["eps"] * clearance
        inverse_gap = np.where(s > 0, (1 - s) * (1 + 2 * s) / shortest, 1 / np.maximum(clearance - z, shortest))
        q["friction_torque"] = friction
        q["slip_torque"] = friction * phase[2] + film * inverse_gap * slip
        rates[ENERGY] = np.where(phase[1] == STICK, 0, friction * v["gr"] * np.abs(slip))
        rates[CONTACT] = regime

    def _shafts(self, q: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v, mode, speed = self.values, phase[1], state[INPUT]
        converter = self._with_effects("converter_torque", self._converter_torque(speed), q)
        lagged = self._lagged("converter_lag", CONVERTER, converter, q, rates, state)
        drive = lagged - self._with_effects("input_drag", v["biv"] * speed + v["Tic"], q)
        brake = self._with_effects("brake_torque", self.brake_torque, q)
        load = self._with_effects("load_torque", v["bov"] * state[OUTPUT] + brake, q)

        slip = speed / v["gr"] - state[OUTPUT]
        rigid = (drive - load / v["gr"]) / (v["Ji"] + self.load_inertia / v["gr"] ** 2)
        held_torque = drive - v["Ji"] * rigid
        stick_margin = q["friction_torque"] * (1 + 1e-6) - np.abs(held_torque)
        compliance = self._with_effects("shaft_compliance", np.zeros_like(speed), q)
        if "shaft_compliance" in self._effects_on:  # a compliant shaft never slips again after lock-up
            reduced = 1 / (1 / self.load_inertia + 1 / (v["Ji"] * v["gr"] ** 2))
            damping = 2 * RING_DAMPING * np.sqrt(reduced / compliance)
            held_torque = (state[TWIST] / compliance + damping * slip) / v["gr"]
            stick_margin = np.ones_like(speed)
            rates[TWIST] = np.where(mode == STICK, slip, 0)
        torque = np.where(mode == STICK, held_torque, q["slip_torque"])
        rates[INPUT] = (drive - torque) / v["Ji"]
        rates[OUTPUT] = np.where(mode == REST, 0, (v["gr"] * torque - load) / self.load_inertia)
        q["output_torque"] = v["gr"] * torque
        q["margin"] = np.choose(
            mode, [load - v["gr"] * torque, np.minimum(phase[2] * slip, state[OUTPUT]), stick_margin])

    def _converter_torque(self, speed: np.ndarray) -> np.ndarray:
        setup, motor_speed = self.setup, self.motor_speed
        largest = (np.max(setup.motor_speed) / setup.capacity[0]) ** 2
        for _ in range(2 if self.sag else 0):
            pump = (motor_speed / np.interp(speed / motor_speed, setup.speed_ratio, setup.capacity)) ** 2
            motor_speed = self.motor_speed * (1 - self.sag * pump / largest)
        ratio = speed / motor_speed
        capacity = np.interp(ratio, setup.speed_ratio, setup.capacity)
        return motor_speed**2 * (np.interp(ratio, setup.speed_ratio, setup.torque_ratio) / capacity**2)

    def _lagged(self, lag: str, memory: int, value: np.ndarray, q: Quantities,
                rates: np.ndarray, state: np.ndarray) -> np.ndarray:
        if lag not in self._effects_on:
            return value
        rates[memory] = (value - state[memory]) / self._with_effects(lag, np.zeros_like(value), q)
        return state[memory]
