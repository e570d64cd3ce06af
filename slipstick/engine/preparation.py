"""Recordings of a machine are prepared for fits: nominal parameters, steps per sample, drawn states, terms."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.engine.bases import late
from slipstick.engine.equations import refine
from slipstick.engine.noise import Noise, estimate_loudness, estimate_sensor_noise
from slipstick.engine.recordings import (
    MEASURED,
    Part,
    Recorded,
    Term,
    clock_of,
    list_signals,
    pose_nominal,
    smooth_signal,
)
from slipstick.engine.trajectory import Trajectory, solve
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Block, Machine, Namespace, as_tuple, identifier_of
from slipstick.machine.runs import Runs
from slipstick.machine.system import AT_INSTANTS, States, system_of
from slipstick.numerics.equal_steps import require_equal_steps
from slipstick.numerics.levels import list_levels

_LOOSE = 0.3
"""Standard deviation of the prior of a mean that is to be calibrated, in the scale of its parameter."""
_SUBSTEPS, _EXACT = (1, 2, 4, 8, 16, 32, 64), 0.125
"""Numbers of steps in a sample, and the nats in all runs by which twice as many may differ: no decision depends on so
many, and they move no coefficient by more than half of its standard error, the root of twice as many."""
_BETWEEN = 1 / 3
"""Samples by which a sensor reads late where steps are chosen for an output that jumps with a command: no instant of
any number of steps is there."""
_STATED = 1e-3
"""Standard deviation of the mean of a condition over the runs, beside the errors of its levels."""
_DRAWN = 25.0
"""Samples in which a state that may come to rest is drawn to its measured value: where it rests a moment too long or
too short, a simulation never comes back to the recording, and has no slope that would tell why."""
_SLOW = 0.9
"""Autocorrelation of a disturbance from sample to sample, to begin with."""


def prepare(machine: Machine, runs: Runs, values: Mapping[str, float] | None = None,
            is_free: bool = False) -> Recorded:
    """Return a machine with its recorded runs, at nominal `values` of its parameters by name.

    States that may come to rest are drawn to the recordings, unless the simulation `is_free`. A block of which a signal
    or an input was not recorded is left out. Raises `InvalidValue` where a parameter has no value, a signal has no
    noise, or samples are not equidistant.
    """
    require_equal_steps(runs.time)
    signals = {name: np.asarray(value, float) for name, value in runs.signals.items()}
    noise = {name: estimate_sensor_noise(name, value) for name, value in signals.items()}
    smooth = {name: smooth_signal(value) for name, value in signals.items()}
    known = {*signals, *runs.commands, *runs.conditions, *runs.channels}
    blocks = [block for block in machine.blocks if set(block.signals) <= set(signals) and set(block.reads) <= known]
    nominal = _find_nominal(machine, blocks, runs, signals, values or {})
    alone = [_prepare_part(block, machine, runs, signals, smooth, noise, nominal, is_free) for block in blocks]
    steps = {signal: part.fine for part in alone for signal in part.signals}
    # A part that reads what another one gives takes as many steps, to know how it bends between samples.
    parts = tuple(_prepare_part(part.block, machine, runs, signals, smooth, noise, nominal, is_free, least)
                  if part.block.states and least > part.fine else part for part in alone
                  for least in [max((steps.get(name, 1) for name in part.block.reads), default=1)])
    within = list_signals(machine, runs, smooth)
    read = {name for block in blocks for name in block.reads}
    random, shared = _list_terms(machine, runs, parts, read)
    return Recorded(machine, runs, parts, random, shared, within, np.arange(len(runs)))


def straighten(signal: np.ndarray) -> np.ndarray:
    """Return samples (n, k) between which a line has the integral of a signal that bends between its samples.

    It is less than the trapezoid by a twelfth of the change of its slope (the Euler-Maclaurin formula).
    """
    out = signal.copy()
    out[:, 1:-1] -= (signal[:, 2:] - 2 * signal[:, 1:-1] + signal[:, :-2]) / 12
    return out


def _find_nominal(machine: Machine, blocks: Sequence[Block], runs: Runs, signals: Mapping[str, np.ndarray],
                  values: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Return the nominal parameters and the stated conditions (n, 1) by name."""
    nominal = dict[str, np.ndarray]()
    for parameter in dict.fromkeys(each for block in blocks for each in block.parameters):
        value = values.get(parameter.name, parameter.value)
        if parameter.first_of is not None and parameter.first_of in signals:
            nominal[parameter.name] = signals[parameter.first_of][:, :1]
            continue
        if value is None:
            raise InvalidValue(f"The parameter '{parameter.name}' of the machine '{machine.name}' has no value",
                               "State it among the values, or in its declaration")
        nominal[parameter.name] = np.full((len(runs), 1), float(value))
    for condition in machine.conditions:
        if condition.name in runs.conditions:
            nominal[condition.name] = np.asarray(runs.conditions[condition.name], float)[:, None]
    return nominal


@np.errstate(over="ignore", invalid="ignore")  # a nominal machine may have no finite solution
def _prepare_part(block: Block, machine: Machine, runs: Runs, signals: Mapping[str, np.ndarray],
                  smooth: Mapping[str, np.ndarray], noise: Mapping[str, Noise],
                  nominal: Mapping[str, np.ndarray], is_free: bool, least: int = 1) -> Part:
    conditions = {each.name for each in machine.conditions}
    parameters = {identifier_of(name): nominal[name] for name in
                  (*(each.name for each in block.parameters), *(name for name in block.reads if name in conditions))}
    counted = np.ones((len(runs), len(block.signals), len(runs.time)), bool)
    if block.window is not None:
        named = Namespace(**{identifier_of(name): value for name, value in {**smooth, **runs.channels}.items()},
                          time=runs.time)
        for place, samples in enumerate(as_tuple(block.window(named))):
            counted[:, place] = samples

    loudness = {name: estimate_loudness(np.diff(signals[name], axis=1), counted[:, 0, 1:]) for name in block.reads
                if name in signals}

    # What is read between samples, if there are states that it drives.
    driving, beyond = ({name: straighten(value) if block.states else value for name, value in each.items()}
                       for each in (smooth, {name: signals[name] - smooth[name] for name in signals}))

    profiles = {name: runs.commands[name] for name in block.reads if name in runs.commands}
    may_pass_on = block.output_function is not None and bool(profiles)

    def at(fine: int) -> Part:
        instants = np.linspace(runs.time[0], runs.time[-1], fine * (len(runs.time) - 1) + 1)
        commands = {name: profile.approximate(instants) if block.states else profile.at(instants)
                    for name, profile in profiles.items()}
        for name in block.reads:
            if name in runs.channels:
                channel = np.asarray(runs.channels[name], float)
                shape = len(runs), len(runs.time)
                commands[name] = refine(np.broadcast_to(channel.reshape(len(runs), -1), shape), fine)
        measured = [name for name in block.reads if name in signals]
        part = Part(block, system_of(block), runs.step / fine, fine,
                    {identifier_of(name): value for name, value in
                     {**commands, **{name: refine(driving[name], fine) for name in measured}}.items()},
                    {identifier_of(name): beyond[name] for name in measured},
                    {identifier_of(name): noise[name] for name in measured}, parameters,
                    np.stack([signals[name] for name in block.signals], axis=1), counted,
                    tuple(noise[name] for name in block.signals), np.ones((len(runs), len(block.signals))),
                    np.stack([loudness[name] for name in measured], axis=1) if measured else np.ones((len(runs), 0)),
                    np.ones(len(runs)),
                    disturbances={identifier_of(each.name): Noise(each.disturbance, _SLOW)
                                  for each in block.quantities if each.disturbance > 0})
        if block.states and may_pass_on:
            system, exact = part.system.read_at_instants({
                identifier_of(name): profile.at(instants) for name, profile in profiles.items()})
            part = replace(part, system=system, inputs={**part.inputs, **exact})
        # A simulation of the whole machine goes on to the end, to be shown.
        return part if is_free else _draw(part, _DRAWN * runs.step, driving, beyond).end()

    coarse = at(max(least, _SUBSTEPS[0]))
    if not block.states and not may_pass_on:
        return coarse
    solved = solve(pose_nominal(coarse))
    clock = _BETWEEN if may_pass_on and _passes_on(solved, profiles) else 0.0
    if not block.states and not clock:
        return coarse
    before = _read_late(solved, coarse.fine, clock)
    for fine in (each for each in _SUBSTEPS if each > coarse.fine):
        finer = at(fine)
        after = _read_late(solve(pose_nominal(finer)), fine, clock)
        off = np.mean((after - before) ** 2, axis=(0, 2)) / [sensor.fresh**2 for sensor in coarse.sensors]
        if not (0.5 * off * len(runs) * len(runs.time) >= _EXACT).any():
            return coarse
        coarse, before = finer, after
    return coarse


def _passes_on(nominal: Trajectory, commands: Iterable[str]) -> bool:
    """Return whether an output changes with a command at the same instant."""
    prefix = AT_INSTANTS if nominal.problem.system.states else ""
    return any(nominal.direction("input", prefix + identifier_of(name), 1.0).D.any() for name in commands)


def _draw(part: Part, time: float, smooth: Mapping[str, np.ndarray], beyond: Mapping[str, np.ndarray]) -> Part:
    """Return a part whose states that may come to rest are drawn to what their sensors read within a `time` in s.

    This is a model in innovations form (Ljung, System Identification, 1999, section 4.3) with fixed gains. A state that
    is not measured is drawn by the sensor of one whose rate it is, so that both errors decay with that time.
    """
    pulls, states = list[tuple[int, str, float]](), part.block.states
    for name in part.block.switches:
        if name in part.signals:
            pulls.append((states.index(name), name, 1 / time))
            continue
        for measured in (signal for signal in part.signals if signal in states):
            slope = _differentiate_rate(part, states.index(measured), states.index(name))
            if slope:
                pulls += [(states.index(measured), measured, 2 / time), (states.index(name), measured,
                                                                        1 / (slope * time**2))]
                break
    if not pulls:
        return part
    read = {name: MEASURED + identifier_of(name) for _, name, _ in pulls}

    def rate(x: Any, u: Any, q: Any, p: Any) -> States:
        rates = list(as_tuple(part.system.rate(x, u, q, p)))
        for place, name, gain in pulls:
            rates[place] = rates[place] + gain * (getattr(u, read[name]) - getattr(x, identifier_of(name)))
        return tuple(rates)

    return replace(part, system=replace(part.system, rate=rate), inputs={**part.inputs, **{
        name: refine(smooth[signal], part.fine) for signal, name in read.items()}}, beyond={**part.beyond, **{
            name: beyond[signal] for signal, name in read.items()}})


def _differentiate_rate(part: Part, of: int, on: int) -> float:
    """Return the derivative of the rate of a state with another one, at the begin of the first run."""
    system, u, p = part.system, Namespace(**{name: value[:1, 0] for name, value in part.inputs.items()}), Namespace(
        **{name: value[:1, 0] for name, value in part.parameters.items()})
    q, sides = Namespace(**part.quantities), {place: np.ones(1) for place in system.switches}
    x = [np.broadcast_to(state, 1) for state in as_tuple(system.start(u, q, p))]
    before = as_tuple(system.rate(system.name(tuple(x), sides), u, q, p))[of]
    x[on] = x[on] + 1.0
    return float(np.squeeze(as_tuple(system.rate(system.name(tuple(x), sides), u, q, p))[of] - before))


def _read_late(nominal: Trajectory, fine: int, clock: float) -> np.ndarray:
    """Return the samples (n, o, k) of sensors that are late by so many samples."""
    return late(nominal.outputs, fine * clock, fine) if clock else nominal.outputs[:, :, ::fine]


def _list_terms(machine: Machine, runs: Runs, parts: tuple[Part, ...],
                read: set[str]) -> tuple[tuple[Term, ...], tuple[Term, ...]]:
    random, shared, ones = list[Term](), list[Term](), np.ones(len(runs))
    used = {name for part in parts for name in part.parameters}
    for parameter in machine.parameters:
        place = identifier_of(parameter.name)
        if place not in used:
            continue
        nominal = next(part.parameters[place] for part in parts if place in part.parameters)
        size = parameter.scale or float(np.abs(nominal).mean()) or 1.0
        within = parameter.within if np.isfinite(parameter.within) else _LOOSE
        term = Term(parameter.name, "parameter", place, size, ones, within, parameter.scatter,
                    is_factor=parameter.is_factor(nominal))
        (random if parameter.scatter > 0 else shared).append(term)
    for condition in machine.conditions:
        if condition.name not in read:
            continue
        place, stated = identifier_of(condition.name), np.asarray(runs.conditions[condition.name], float)
        if condition.scatter > 0:
            random.append(Term(condition.name, "parameter", place, 1.0, np.abs(stated), _STATED, condition.scatter))
        if condition.within > 0:
            shared += [Term(f"{condition.name} {number}", "parameter", place, 1.0, np.abs(stated) * level,
                            condition.within)
                       for number, level in enumerate(list_levels(stated, runs.order if condition.drifts else None))]
    for part in parts:
        shared += [Term(f"clock of {signal} in {part.name}", "clock", clock_of(part, signal), 1.0, ones, std=0.5,
                        target=0.5) for signal in (*part.signals, *part.noise)]
    return tuple(random), tuple(shared)
