"""DC motor: a commanded voltage drives a rotor against friction and a load, which both hold it while it rests.

The equations are, with the current i in A, the speed w in rad/s and the angle in rad,

    inductance i' = V + dV - resistance value i - motor constant w - brush voltage
    rotor inertia w' = motor constant i - viscous coefficient w - sign(w) (dry torque + load torque) - friction torque
    angle' = w

where dV, brush voltage and friction torque are zero, and resistance, constant, inertia, viscous and dry friction are
multiplied by 1, without an effect. At w = 0 the rotor rests while the torque of the current, less the friction torque,
does not exceed dry and load torque. Every start and end of a rest is located in time.
"""

from dataclasses import dataclass

import numpy as np

from .runs import PAST, Inputs, Runs

PARAMETERS = {"resistance value": 1.0, "inductance": 3e-3, "motor constant": 0.05, "rotor inertia": 1e-4,
              "viscous coefficient": 3e-5, "dry torque": 0.015}
"""Typical parameters in ohm, H, N m/A, kg m^2, N m s/rad and N m."""
SIGNALS = {"current": "A", "speed": "rad/s"}
RATIOS = ("resistance", "torque constant", "inertia", "viscous friction", "dry friction")
"""Quantities that change by a share of themselves; voltages in V and "friction torque" in N m by a difference."""
FINE, COARSE = 6, 1
"""Steps of the integrator in a sampling period for recordings, and for the strength of effects."""
_REACHED = np.array([1e-9, 1e-12])  # rad/s and N m: what counts as no crossing of speed 0, and of the holding torque
_EVENTS, _TRIALS = 40, 60  # most events in a step, and most trials of the search for each


@dataclass(frozen=True, eq=False)
class _Motion:
    """The runs, and the voltages (3, n), commanded, applied and past, at the beginning and the end of a step."""

    runs: Runs
    inputs: Inputs
    begin: float
    ends: tuple[np.ndarray, np.ndarray]

    def balance(self, part: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return rate of current (n,) in A/s, driving and holding torque (n,) in N m, and inertia (n,) in kg m^2.

        `state` (3, n) is current, speed and angle, and `part` (n,) the part of the step that is over.
        """
        runs, values = self.runs, self.runs.values
        current, speed, angle = state
        commanded, applied, past = self.ends[0] + part * (self.ends[1] - self.ends[0])
        abscissas = {**self.inputs.fixed, "time": self.begin + part * self.inputs.step, "voltage": commanded,
                     PAST: past, "current": current, "speed": speed, "position": angle}

        def changed(quantity: str) -> np.ndarray | float:
            return runs.evaluate(quantity, abscissas)

        constant = values["motor constant"] * (1.0 + changed("torque constant"))
        drop = values["resistance value"] * (1.0 + changed("resistance")) * current + changed("brush voltage")
        rate = (applied + changed("voltage") - drop - constant * speed) / values["inductance"]
        viscous = values["viscous coefficient"] * (1.0 + changed("viscous friction")) * speed
        driving = constant * current - viscous - changed("friction torque")
        holding = values["dry torque"] * (1.0 + changed("dry friction")) + runs.conditions["load torque"]
        return rate, driving, holding, values["rotor inertia"] * (1.0 + changed("inertia"))

    def rates(self, part: np.ndarray, state: np.ndarray, sense: np.ndarray) -> np.ndarray:
        """Return the rates (3, n) of rotors that turn in the `sense` (n,) of -1 or 1, or rest, which is 0."""
        rate, driving, holding, inertia = self.balance(part, state)
        turns = sense != 0
        rates = np.empty_like(state)
        rates[0], rates[1], rates[2] = rate, turns * (driving - sense * holding) / inertia, turns * state[1]
        return rates

    def advance(self, part: np.ndarray, state: np.ndarray, sense: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Return the state (3, n) after a Runge-Kutta step of the `length` (n,), as a part of the whole step."""
        time = length * self.inputs.step
        first = self.rates(part, state, sense)
        second = self.rates(part + 0.5 * length, state + 0.5 * time * first, sense)
        third = self.rates(part + 0.5 * length, state + 0.5 * time * second, sense)
        fourth = self.rates(part + length, state + time * third, sense)
        return state + time / 6.0 * (first + 2.0 * (second + third) + fourth)

    def guard(self, part: np.ndarray, state: np.ndarray, sense: np.ndarray) -> np.ndarray:
        """Return (n,) what is negative where a turning rotor has passed speed 0, or a resting one is not held."""
        turning = sense * state[1] + _REACHED[0]
        if np.all(sense != 0):
            return turning
        _, driving, holding, _ = self.balance(part, state)
        return np.where(sense != 0, turning, holding - np.abs(driving) + _REACHED[1])

    def choose_sense(self, part: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Return the sense (n,) in which a rotor at speed 0 starts to turn, or 0."""
        _, driving, holding, _ = self.balance(part, state)
        return np.where(np.abs(driving) > holding, np.sign(driving), 0.0)


def integrate(runs: Runs, inputs: Inputs) -> dict[str, np.ndarray]:
    """Return current, speed and position (n, K + 1) on the grid of the inputs; every run starts at rest, at angle 0.

    Raises `RuntimeError` where rests and reversals do not end.
    """
    count, n = len(inputs.commanded), len(runs.order)
    states, part = np.zeros((count, 3, n)), np.zeros(n)
    ends = np.stack([inputs.commanded, inputs.applied, inputs.past], axis=1)
    motion = _Motion(runs, inputs, 0.0, (ends[0], ends[0]))
    sense = motion.choose_sense(part, states[0])
    for index, begin in enumerate(inputs.time[:-1]):
        motion = _Motion(runs, inputs, begin, (ends[index], ends[index + 1]))
        states[index + 1], sense = _step(motion, states[index], sense)
    return {"current": states[:, 0].T, "speed": states[:, 1].T, "position": states[:, 2].T}


def _step(motion: _Motion, state: np.ndarray, sense: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return state (3, n) and sense (n,) at the end of a step, which stops at every event on the way."""
    part, left = np.zeros(state.shape[1]), np.ones(state.shape[1])
    for _ in range(_EVENTS):
        ahead = motion.advance(part, state, sense, left)
        guard = motion.guard(part + left, ahead, sense)
        passed = (guard < 0) & (left > 0)
        if not passed.any():
            return ahead, sense
        length = _locate(motion, part, state, sense, np.where(passed, left, 0.0), guard)
        state = np.where(passed, motion.advance(part, state, sense, length), ahead)
        part = np.where(passed, part + length, 1.0)
        left = np.where(passed, left - length, 0.0)
        state[1] = np.where(passed, 0.0, state[1])
        sense = np.where(passed, motion.choose_sense(part, state), sense)
    raise RuntimeError("a rotor that does not come to an end of its rests and reversals")


def _locate(motion: _Motion, part: np.ndarray, state: np.ndarray, sense: np.ndarray, left: np.ndarray,
            guard: np.ndarray) -> np.ndarray:
    """Return the parts (n,) of a step after which the guard is 0; it is negative, `guard`, after `left` (n,).

    The Illinois method, in all runs at once; where `left` is 0 there is nothing to find.
    """
    low, high, side = np.zeros_like(left), left.copy(), np.zeros_like(left)
    at_low, at_high = np.maximum(motion.guard(part, state, sense), 0.0), np.minimum(guard, -1e-300)
    for _ in range(_TRIALS):
        middle = np.where(left > 0, (low * at_high - high * at_low) / (at_high - at_low), 0.0)
        at_middle = motion.guard(part + middle, motion.advance(part, state, sense, middle), sense)
        beyond = at_middle < 0
        at_low = np.where(beyond, np.where(side > 0, 0.5 * at_low, at_low), at_middle)
        at_high = np.where(beyond, at_middle, np.where(side < 0, 0.5 * at_high, at_high))
        low, high, side = np.where(beyond, low, middle), np.where(beyond, middle, high), np.where(beyond, 1.0, -1.0)
        if np.all((beyond & (at_middle > -1e-11)) | (high - low < 1e-12) | (left <= 0)):
            break
    return high
