"""The equations of a declared machine along its recordings: measured rates beside declared ones, and columns of both.

Rates are derivatives of signals, and a state that no sensor reads is the
derivative or the integral of one that is measured. A column is what a change of a parameter, of a quantity or of a
sensor adds to the residual "measured rate less declared rate".
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from slipstick.engine.bases import lag, late
from slipstick.engine.laws import CONSTANT, GAIN, LAG, PAST, Candidate
from slipstick.engine.preparation import straighten
from slipstick.engine.recordings import Part, Recorded, pose_nominal, refine, smooth_signal
from slipstick.engine.trajectory import solve
from slipstick.machine.declaration import SENSOR, Namespace, as_tuple, identifier_of
from slipstick.machine.system import System, system_of
from slipstick.numerics.memory import play

Differentiate = Callable[[np.ndarray], np.ndarray]
"""Rates (..., k) of signals (..., k) that have a sample time of 1."""
STEP = 1e-4
"""Relative step of numerical derivatives of declared rates."""
RESTING = 0.02
"""Part of the largest speed below which a state that switches may be at rest, where its equation does not hold."""
WIDTHS, TIMES, DELAYS = (0.01, 0.03, 0.1), (4.0, 16.0, 64.0), (1.0, 4.0, 16.0)
"""Of plays, over the range of an input, of lags and of dead times in samples: the columns of a past and of a lag."""


@dataclass(frozen=True, eq=False)
class Equation:
    """The rate of a state of a part: `measured` (n, k) in its unit per s, where it is `valid` (n, k).

    `states` and `inputs` (n, k) are as the signals have them; `signal` is the sensor that the rate comes from, as its
    derivative of the `order` 1 or 2.
    """

    part: Part
    system: System
    place: int
    signal: str
    order: int
    measured: np.ndarray
    valid: np.ndarray
    states: tuple[np.ndarray, ...]
    inputs: Mapping[str, np.ndarray]
    step: float
    differentiate: Differentiate

    def rate(self, factors: Mapping[str, np.ndarray | float], quantities: Mapping[str, Any] | None = None,
             changes: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
        """Return the declared rate (n, k), with parameters times factors or plus differences, as `scale_of` has it."""
        p = {name: shift(self.part, name, value, factors.get(name, 0.0))
             for name, value in self.part.parameters.items()}
        changes, q = changes or {}, {**self.part.quantities, **(quantities or {})}
        x = tuple(state + changes.get(name, 0.0) for name, state in zip(self.system.states, self.states, strict=True))
        u = {name: value + changes.get(name, 0.0) for name, value in self.inputs.items()}
        sides = {place: np.sign(self.states[place]) for place in self.system.switches}
        rates = as_tuple(self.system.rate(self.system.name(x, sides), Namespace(**u), Namespace(**q), Namespace(**p)))
        return np.broadcast_to(rates[self.place], self.measured.shape)

    def residual(self, factors: Mapping[str, np.ndarray | float]) -> np.ndarray:
        """Return the measured rate less the declared one (n, k)."""
        return self.measured - scipy.ndimage.convolve1d(self.rate(factors), [0.25, 0.5, 0.25], axis=1)

    def over_parameter(self, name: str, factors: Mapping[str, np.ndarray | float]) -> np.ndarray:
        """Return the derivative (n, k) of the rate with a parameter."""
        moved = [self.rate({**factors, name: factors.get(name, 0.0) + step}) for step in (STEP, -STEP)]
        return (moved[0] - moved[1]) / (2 * STEP)

    def over_quantity(self, name: str, size: float, factors: Mapping[str, np.ndarray | float]) -> np.ndarray:
        """Return the derivative (n, k) of the rate with a quantity, times its size."""
        moved = [self.rate(factors, {identifier_of(name): step * size}) for step in (STEP, -STEP)]
        return (moved[0] - moved[1]) / (2 * STEP)

    def over_delay(self, name: str) -> np.ndarray:
        """Return what an input that comes later by a sample adds to measured less declared rate (n, k)."""
        step = STEP * float(np.abs(self.inputs[name]).max())
        moved = [self.rate({}, changes={name: np.full(self.measured.shape, sign * step)}) for sign in (1, -1)]
        return np.asarray((moved[1] - moved[0]) / (2 * step) * self.differentiate(self.inputs[name]))

    def over_error(self, signal: str, error: np.ndarray, factors: Mapping[str, np.ndarray | float],
                   change: np.ndarray | None = None) -> np.ndarray:
        """Return what an error (n, m, k) of a sensor adds to measured less declared rate (n, m, k).

        `change` (n, m, k) is that of the error from sample to sample, where it is known better than by differences.
        """
        out, name = np.zeros_like(error), identifier_of(signal)
        changes = {name: error}
        if signal == self.signal:
            slope = (self.differentiate(error) if change is None else change) / self.step
            out += slope if self.order == 1 else self.differentiate(slope) / self.step
            if self.order == 2:
                changes[self.system.states[self.place]] = slope
        for changed, by in changes.items():
            if changed in self.system.states or changed in self.inputs:
                known = self.inputs.get(changed)
                values = known if known is not None else self.states[self.system.states.index(changed)]
                step = STEP * float(np.abs(values).max())
                moved = [self.rate(factors, changes={changed: np.full(values.shape, sign * step)}) for sign in (1, -1)]
                out -= ((moved[0] - moved[1]) / (2 * step))[:, None] * by
        return out


def scale_of(part: Part, name: str) -> float:
    """Return the unit of a change of a parameter: 0 where it is the logarithm of a factor."""
    declared = next((each for each in part.block.parameters if identifier_of(each.name) == name), None)
    if declared is None:
        return 0.0
    return declared.scale or (0.0 if np.all(part.parameters[name]) else 1.0)


def shift(part: Part, name: str, value: np.ndarray, by: np.ndarray | float) -> np.ndarray:
    """Return a parameter after a change."""
    scale = scale_of(part, name)
    return np.asarray(value + scale * by if scale else value * np.exp(by))


def pose(recorded: Recorded, signals: Mapping[str, np.ndarray], delays: Mapping[str, float],
         differentiate: Differentiate) -> list[Equation]:
    """Return the equations of all parts along `signals` (n, k), whose sensors have `delays` in samples.

    Each part has the clock of the signal that it gives. Rates are averages over a sample to either side, for which
    signals that bend between samples are straightened.
    """
    return [equation for part in recorded.parts
            for equation in _pose_part(recorded, part, signals, delays, differentiate)]


def synchronize(recorded: Recorded, delays: Mapping[str, float]) -> Recorded:
    """Return the recordings with inputs of each part at the clock of the signal that it gives."""
    runs, smooth = recorded.runs, {name: smooth_signal(np.asarray(value, float))
                                   for name, value in recorded.runs.signals.items()}

    def known(part: Part) -> Part:
        own = delays[part.signals[0]]
        instants = np.linspace(runs.time[0], runs.time[-1], part.fine * (len(runs.time) - 1) + 1) - own * runs.step
        commands = {identifier_of(name): profile.approximate(instants) for name, profile in runs.commands.items()
                    if name in part.block.reads}
        read = {name: refine(straighten(_advance(smooth[signal], delays[signal] - own)), part.fine)
                for signal, name in _sources(part).items()}
        return replace(part, inputs={**part.inputs, **commands, **read})

    return replace(recorded, parts=tuple(known(part) for part in recorded.parts))


def _sources(part: Part) -> dict[str, str]:
    """Return the inputs that sensors read, by the name of the signal."""
    read = {signal: identifier_of(signal) for signal in part.block.reads if identifier_of(signal) in part.noise}
    return {**read, **part.drawn}


def _advance(values: np.ndarray, by: float) -> np.ndarray:
    """Return signals (n, k) that come earlier by some samples."""
    return late(np.asarray(values, float), -by, 1) if by else values


def simulate(recorded: Recorded, factors: Mapping[str, float], delays: Mapping[str, float],
             passes: int) -> dict[str, np.ndarray]:
    """Return the signals (n, k) that each block gives with its inputs, with changes of its parameters.

    Inputs are measured at first, and those of the pass before in each further one, so that less and less of their noise
    is left.
    """
    simulated = dict[str, np.ndarray]()
    for _ in range(passes):
        before, simulated = simulated, {}
        for part in recorded.parts:
            own = delays[part.signals[0]]
            read = {identifier_of(name): refine(straighten(_advance(before[name], delays[name] - own)), part.fine)
                    for name in part.block.reads if name in before}
            parameters = {name: shift(part, name, value, factors.get(name, 0.0))
                          for name, value in part.parameters.items()}
            posed = pose_nominal(replace(part, inputs={**part.inputs, **read}, parameters=parameters))
            outputs = solve(posed).outputs
            simulated |= {name: outputs[:, place, ::part.fine] for place, name in enumerate(part.signals)}
    return simulated


def _pose_part(recorded: Recorded, part: Part, signals: Mapping[str, np.ndarray],
               delays: Mapping[str, float], differentiate: Differentiate) -> list[Equation]:
    system, step = system_of(part.block), recorded.runs.step
    by_identifier = {identifier_of(name): value for name, value in signals.items()}
    own = delays[part.signals[0]]
    read = {identifier_of(name): straighten(_advance(signals[name], delays[name] - own)) for name in part.block.reads
            if name in signals}
    inputs = {name: read[name] if name in read else value[:, ::part.fine] for name, value in part.inputs.items()}
    shape = next(iter(signals.values())).shape
    known = {place: by_identifier[name] for place, name in enumerate(system.states) if name in by_identifier}
    origin = {place: (part.block.states[place], 1) for place in known}
    probes = [np.full(shape, 1.0 + place) for place in range(len(system.states))]
    u, q, p = (Namespace(**values) for values in (inputs, part.quantities, part.parameters))
    sides = {place: np.ones(shape) for place in system.switches}
    rates = as_tuple(system.rate(system.name(tuple(probes), sides), u, q, p))
    is_rate = {of: place for of, rate in enumerate(rates) for place, probe in enumerate(probes)
               if np.allclose(np.broadcast_to(rate, shape), probe)}
    for of, place in is_rate.items():
        if of in known and place not in known:
            known[place] = differentiate(known[of]) / step
            origin[place] = part.block.states[of], 2
        elif place in known and of not in known:
            known[of] = scipy.integrate.cumulative_trapezoid(known[place], dx=step, axis=1, initial=0.0)
    if len(known) < len(system.states):
        return []
    states = tuple(straighten(known[place]) for place in range(len(system.states)))
    valid = np.ones(shape, bool)
    for place in system.switches:
        valid &= np.abs(states[place]) > RESTING * np.abs(states[place]).max()
    return [Equation(part, system, place, *origin[place], differentiate(known[place]) / step, valid, states, inputs,
                     step, differentiate)
            for place in range(len(system.states)) if place not in is_rate and place in origin]


def read_variable(recorded: Recorded, equation: Equation, name: str) -> np.ndarray:
    """Return what a law depends on (n, k), as the equation has it, or (n,) of what is constant in a run."""
    part, identifier = equation.part, identifier_of(name)
    if name in equation.system.own:
        named = Namespace(**dict(zip(equation.system.states, equation.states, strict=True)))
        return np.asarray(equation.system.own[name](named, Namespace(**equation.inputs), Namespace(**part.parameters)))
    return equation.inputs[identifier] if identifier in equation.inputs else recorded.signals[name]


def read_memory(candidate: Candidate, values: np.ndarray) -> np.ndarray:
    """Return the columns (n, m, k) of the past of an input, or of the lag of a sensor, of its `values` (n, k)."""
    values = np.ascontiguousarray(values)
    if candidate.pair[1] == LAG:
        kept = [*(late(values, delay, 1) for delay in DELAYS), *(lag(values, time) for time in TIMES[:2])]
    else:
        span = float(np.ptp(values))
        kept = [*(play(values, width * span) for width in WIDTHS), *(lag(values, time) for time in TIMES)]
    return np.stack(kept, axis=1) - values[:, None]


def name_variable(candidate: Candidate) -> str:
    """Return the signal or the constant of runs of which the columns of a candidate are."""
    quantity, on = candidate.pair
    return quantity.removesuffix(SENSOR) if on in (LAG, GAIN) else on.removeprefix(PAST)


def add_columns(recorded: Recorded, equation: Equation, candidate: Candidate, factors: Mapping[str, np.ndarray | float],
                curves: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return what the functions of a candidate add to measured less declared rate (n, m, k).

    These are `curves` of what it depends on, functions (n, m, k) of (n, k), or plays and lags.
    """
    quantity, shape, name = candidate.quantity, equation.measured.shape, name_variable(candidate)
    is_memory = candidate.variable.kind in ("past", "lags")
    if candidate.pair[1] == CONSTANT:
        values, basis = None, np.ones((shape[0], 1, shape[1]))
    else:
        values = read_variable(recorded, equation, name)
        values = np.broadcast_to(values if values.ndim == 2 else values[:, None], shape)
        basis = read_memory(candidate, values) if is_memory else curves(values)
    if not quantity.name.endswith(SENSOR):
        return np.asarray(equation.over_quantity(quantity.name, candidate.size, factors)[:, None] * basis)
    change, signal = None, quantity.name.removesuffix(SENSOR)
    if values is not None and equation.order == 1 and name == equation.signal == signal:
        rate = equation.rate(factors) * equation.step
        change = candidate.size * (read_memory(candidate, rate) if is_memory
                                   else 0.5 * (curves(values + rate) - curves(values - rate)))
    return equation.over_error(signal, candidate.size * basis, factors, change)


def add_delay(recorded: Recorded, equation: Equation, signal: str,
              factors: Mapping[str, np.ndarray | float]) -> np.ndarray:
    """Return what a delay of a sensor by a sample adds to the residual of an equation (n, k)."""
    if not (signal == equation.signal or identifier_of(signal) in equation.inputs):
        return np.zeros_like(equation.measured)
    if signal == equation.signal and equation.order == 1:
        slope = equation.rate(factors) * equation.step
        change = equation.differentiate(slope)
        return equation.over_error(signal, -slope[:, None], factors, -change[:, None])[:, 0]
    slope = equation.differentiate(read_variable(recorded, equation, signal))
    return equation.over_error(signal, -slope[:, None], factors)[:, 0]
