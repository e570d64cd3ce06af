"""The bench: the paper's equations as the reference README spells them out, with every quantity open to effects.

Lanes are engagements. States: pressure, its rate, piston, input and output speed, and the memories of effects
(dissipated energy, contact time, lagged friction and converter torque, shaft twist), idle where none uses them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from .effect import Effect
from .nominal import CAPACITY, SPEED_RATIO, TORQUE_RATIO

REST, SLIP, STICK = range(3)
PRESSURE, RATE, PISTON, INPUT, OUTPUT, ENERGY, CONTACT, FRICTION, CONVERTER, TWIST = range(10)
TOLERANCE = np.array([1e-6, 1e-4, 1e-10, 1e-6, 1e-6, 1e-3, 1e-7, 1e-4, 1e-4, 1e-9])[:, None]
RING_DAMPING = 0.08  # of the critical one

Quantities = dict[str, np.ndarray]


@dataclass(frozen=True)
class Bench:
    """n engagements: `values` of the parameters, conditions, place in the sequence (0 to 1), each (n,).

    The current runs through `knot_current` at `knot_time`, (n, m); the last knots may repeat.
    """

    values: Mapping[str, np.ndarray]
    motor_speed: np.ndarray
    load_inertia: np.ndarray
    brake_torque: np.ndarray
    sequence: np.ndarray
    knot_time: np.ndarray
    knot_current: np.ndarray
    effects: tuple[tuple[Effect, float], ...] = ()

    tolerance = TOLERANCE

    def take(self, lanes: np.ndarray) -> "Bench":
        """Return the engagements `lanes`, which may repeat."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        taken = {name: column[lanes] for name, column in columns.items() if isinstance(column, np.ndarray)}
        return replace(self, values={name: value[lanes] for name, value in self.values.items()}, **taken)

    @cached_property
    def _acting(self) -> dict[str, list[tuple[Effect, float]]]:
        acting: dict[str, list[tuple[Effect, float]]] = {}
        for effect, strength in self.effects:
            acting.setdefault(effect.quantity, []).append((effect, strength))
        return acting

    def _acted(self, quantity: str, value: np.ndarray, now: Quantities) -> np.ndarray:
        for effect, strength in self._acting.get(quantity, ()):
            change = effect.law(strength, now[effect.abscissa])
            value = value * change if effect.kind == "ratio" else value + change
        now[quantity] = value
        return value

    def limit(self, phase: np.ndarray) -> np.ndarray:
        return self.knot_time[np.arange(phase.shape[1]), phase[0] + 1]

    def advance(self, phase: np.ndarray, lanes: np.ndarray) -> None:
        phase[0, lanes] += 1

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """Return states and phases at time 0: the input runs where the converter balances its losses."""
        n = len(self.motor_speed)
        state, phase = np.zeros((len(TOLERANCE), n)), np.zeros((3, n), int)
        phase[2] = 1
        state[PISTON] = self.values["x30"]
        low, high = 0.5 * self.motor_speed, self.motor_speed.copy()
        for _ in range(60):
            state[INPUT] = (low + high) / 2
            now = self.quantities(np.zeros(n), state, phase)
            driven = now["converter_torque"] > now["input_drag"]
            low, high = np.where(driven, state[INPUT], low), np.where(driven, high, state[INPUT])
        state[CONVERTER] = now["converter_torque"]
        dragged = self.quantities(np.zeros(n), state, phase)["margin"] < 0
        phase[1, dragged] = SLIP
        return state, phase

    def rates(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        now = self.quantities(time, state, phase)
        return now["rates"], now["margin"]

    def switch(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray, lanes: np.ndarray) -> None:
        if not len(lanes):
            return
        # rest -> slip; slip -> stick where the shafts have met, else the load has stopped -> rest; stick -> slip
        here, mode = state[:, lanes], phase[1, lanes]
        ratio = self.values["gr"][lanes]
        met = (mode == SLIP) & (phase[2, lanes] * (here[INPUT] / ratio - here[OUTPUT]) < 0)
        now = self.take(lanes).quantities(time[lanes], here, phase[:, lanes])
        here[OUTPUT] = np.where(met, here[INPUT] / ratio, np.where(mode == SLIP, 0, here[OUTPUT]))
        here[TWIST] = np.where(met, now["shaft_compliance"] * now["output_torque"], here[TWIST])
        phase[1, lanes] = np.where(met, STICK, np.where(mode == SLIP, REST, SLIP))
        phase[2, lanes] = np.where(mode == STICK, np.sign(now["output_torque"]), phase[2, lanes])
        state[:, lanes] = here

    def quantities(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> Quantities:
        """Return every quantity of the equations, (n,) each, the `rates` of the states and the `margin`."""
        now: Quantities = {
            "time": time, "sequence": self.sequence, "motor_speed": self.motor_speed, "pressure": state[PRESSURE],
            "piston": state[PISTON], "input_speed": state[INPUT], "output_speed": state[OUTPUT],
            "energy": state[ENERGY], "contact_time": state[CONTACT], "pump_angle": 0.5 * self.motor_speed * time,
        }
        rates = np.zeros_like(state)
        self._hydraulics(now, rates, state, phase)
        self._clutch(now, rates, state, phase)
        self._shafts(now, rates, state, phase)
        now["rates"] = rates
        return now

    def _hydraulics(self, now: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v, lane, piece = self.values, np.arange(phase.shape[1]), phase[0]
        time, before = self.knot_time[lane, piece], self.knot_current[lane, piece]
        slope = (self.knot_current[lane, piece + 1] - before) / (self.knot_time[lane, piece + 1] - time)
        now["current"] = before + slope * (now["time"] - time)
        beside = {"current": now["current"] + 1e-6}
        current = self._acted("valve_current", now["current"], now)
        slope = slope * (self._acted("valve_current", beside["current"], beside) - current) / 1e-6
        gain = self._acted("pressure_gain", v["k"], now)
        demand = self._acted("pressure_demand", gain * (current - v["a"]), now)
        rates[PRESSURE] = state[RATE]
        rates[RATE] = (6 * (demand - state[PRESSURE]) / v["tau"] - 4 * state[RATE] - 2 * gain * slope) / v["tau"]

        chamber = self._acted("chamber_pressure", state[PRESSURE], now)
        spring = self._acted("spring_rate", v["d2"], now) * state[PISTON]
        feed = self._acted("piston_feed", v["a2"], now) * state[RATE]
        now["driving_pressure"] = chamber - v["aa"] + (feed - spring) / v["b2"]
        now["free_piston_rate"] = v["b2"] / v["c2"] * self._acted("net_pressure", now["driving_pressure"], now)
        rates[PISTON] = self._acted("piston_rate", now["free_piston_rate"], now)

    def _clutch(self, now: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v = self.values
        end = self._acted("clearance", v["z_contact"], now)
        z = np.minimum(end, np.maximum(0, self._acted("oil_temperature_gain", v["kT"], now) * state[PISTON]))
        s = np.minimum(np.maximum(0, (z / end - 1 + v["eps"]) / v["eps"]), 1)
        regime = s * s * (3 - 2 * s)
        contact = z / (end - v["beta"]) * np.maximum(0, now["chamber_pressure"])
        slip = state[INPUT] / v["gr"] - state[OUTPUT]
        now.update(piston_position=z, contact_pressure=contact, slip=np.abs(slip),
                   load_point=self.motor_speed / 150 * contact / 5)
        friction = regime * self._acted("friction_coefficient", v["alpha"], now) * 1e5 * contact
        friction = self._lagged("friction_lag", FRICTION, friction, now, rates, state)
        over_gap = np.where(s > 0, (1 - s) * (1 + 2 * s) / (v["eps"] * end), 1 / np.maximum(end - z, v["eps"] * end))
        now["friction_torque"] = friction
        now["slip_torque"] = friction * phase[2] + self._acted("film_coefficient", v["gamma"], now) * over_gap * slip
        rates[ENERGY] = np.where(phase[1] == STICK, 0, friction * v["gr"] * np.abs(slip))
        rates[CONTACT] = regime

    def _shafts(self, now: Quantities, rates: np.ndarray, state: np.ndarray, phase: np.ndarray) -> None:
        v, mode, speed, ratio = self.values, phase[1], state[INPUT], state[INPUT] / self.motor_speed
        factor = np.interp(ratio, SPEED_RATIO, TORQUE_RATIO) / np.interp(ratio, SPEED_RATIO, CAPACITY) ** 2
        converter = self._acted("converter_torque", self.motor_speed**2 * factor, now)
        lagged = self._lagged("converter_lag", CONVERTER, converter, now, rates, state)
        drive = lagged - self._acted("input_drag", v["biv"] * speed + v["Tic"], now)
        brake = self._acted("brake_torque", self.brake_torque, now)
        load = self._acted("load_torque", v["bov"] * state[OUTPUT] + brake, now)

        apart = speed / v["gr"] - state[OUTPUT]
        rigid = (drive - load / v["gr"]) / (v["Ji"] + self.load_inertia / v["gr"] ** 2)
        held = drive - v["Ji"] * rigid
        grip = now["friction_torque"] * (1 + 1e-6) - np.abs(held)
        compliance = self._acted("shaft_compliance", np.zeros_like(speed), now)
        if "shaft_compliance" in self._acting:  # what twists has locked for good
            reduced = 1 / (1 / self.load_inertia + 1 / (v["Ji"] * v["gr"] ** 2))
            held = (state[TWIST] / compliance + 2 * RING_DAMPING * np.sqrt(reduced / compliance) * apart) / v["gr"]
            grip = np.ones_like(speed)
            rates[TWIST] = np.where(mode == STICK, apart, 0)
        torque = np.where(mode == STICK, held, now["slip_torque"])
        rates[INPUT] = (drive - torque) / v["Ji"]
        rates[OUTPUT] = np.where(mode == REST, 0, (v["gr"] * torque - load) / self.load_inertia)
        now["output_torque"] = v["gr"] * torque
        now["margin"] = np.choose(
            mode, [load - v["gr"] * torque, np.minimum(phase[2] * apart, state[OUTPUT]), grip])

    def _lagged(self, lag: str, memory: int, value: np.ndarray, now: Quantities,
                rates: np.ndarray, state: np.ndarray) -> np.ndarray:
        if lag not in self._acting:
            return value
        rates[memory] = (value - state[memory]) / self._acted(lag, np.zeros_like(value), now)
        return state[memory]
