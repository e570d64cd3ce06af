"""What a declared machine does in its own experiments, and what about its declaration is implausible."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipstick.engine.laws import list_candidates
from slipstick.engine.measured_law import Law
from slipstick.engine.model import nominal_own_values
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded, pose_nominal
from slipstick.engine.simulation import FINE, simulate_runs
from slipstick.engine.tape import EQUATIONS, Layout, record_equations
from slipstick.errors import InvalidValue
from slipstick.machine import Experiments, Machine, Runs, evaluate_output, list_experiments
from slipstick.machine.declaration import identifier_of
from slipstick.plausibility.finding import Finding

_FINE = 1e-3
"""Change of a signal, over its range, above which the result of a simulation depends on its step."""
_UNCHANGED = 1e-9
"""Change of a signal, over its size, that is rounding."""
_LARGE = 0.1
"""Large change of a relative quantity."""
_NOISY = 0.2
"""Share of the range of a signal above which noise hides it."""


@dataclass(frozen=True, eq=False)
class MachineInspection:
    """The runs of a machine's experiments without noise, its `outputs` (n,) by name, the number of `candidates` that a
    study compares, and the findings.
    """

    machine: Machine
    runs: Runs
    outputs: dict[str, np.ndarray]
    candidates: int
    findings: tuple[Finding, ...]


def inspect_machine(machine: Machine) -> MachineInspection:
    """Simulate the experiments of a machine, and check its declaration; raises `InvalidValue` where it cannot run."""
    experiments = list_experiments(machine)
    runs = simulate_runs(machine, experiments)
    for name, signal in runs.signals.items():
        if not np.isfinite(signal).all():
            run, sample = np.argwhere(~np.isfinite(signal))[0]
            raise InvalidValue(f"'{name}' is not finite from {runs.time[sample]:g} s on in experiment {run}",
                               "Look for a division by zero, a root of a negative number, a wrong sign by which a "
                               "state grows without end, or a time constant that is shorter than the step")
    outputs = {output.name: evaluate_output(output, runs.time, runs.signals) for output in machine.outputs}
    recorded = prepare(machine, simulate_runs(machine, experiments, seed=0))
    candidates = list_candidates(recorded, {part.name: nominal_own_values(part) for part in recorded.parts})
    findings = [*_check_blocks(machine), *_check_names(machine, {each.pair[1] for each in candidates}),
                *_check_speed(recorded), *_check_signals(machine, experiments, runs),
                *_check_outputs(outputs), *_check_quantities(machine, experiments, runs),
                *_check_parameters(machine, experiments, runs)]
    return MachineInspection(machine, runs, outputs, len(candidates), tuple(findings))


def _check_blocks(machine: Machine) -> Iterator[Finding]:
    read = {name for block in machine.blocks for name in block.reads}
    for name in (*(each.name for each in machine.commands), *(each.name for each in machine.conditions)):
        if name not in read:
            yield Finding(name, "no block reads it", "it changes nothing", "Let a block read it, or leave it out")
    given = {signal for block in machine.blocks for signal in block.signals}
    for sensor in machine.sensors:
        if sensor.signal not in given:
            yield Finding(sensor.signal, "it is measured, and no block gives it",
                          "it is only something that laws may depend on",
                          "Declare the block that gives it, or accept that what is missing there is not found")
    for block in machine.blocks:
        if not block.quantities:
            yield Finding(block.name, "the block has no quantity", "nothing that is missing there can be named",
                          "Declare the places of its equations that may be wrong")


def _check_names(machine: Machine, known: set[str]) -> Iterator[Finding]:
    """Yield names on which laws are to depend, or not to, and which nothing has: a further channel may be meant."""
    names = {*(each.signal for each in machine.sensors), *(each.name for each in machine.commands),
             *(each.name for each in machine.conditions), *machine.signals, *machine.inputs,
             *(name for block in machine.blocks for name in (*block.states, *block.derived))}
    known = known | names | {"time", "run order"} | {f"past {name}" for name in names}
    named = [(each.name, name) for each in machine.quantities for name in (*(each.over or ()), *each.without)]
    named += [(each.name, each.on) for each in machine.effects]
    for place, name in dict.fromkeys(named):
        if name not in known:
            yield Finding(place, f"it names '{name}', and neither a signal nor a condition is called so",
                          "what is said of it counts only where recordings have a further channel of this name",
                          "Correct the name, if no such channel is meant")


def _check_speed(recorded: Recorded) -> Iterator[Finding]:
    for part in recorded.parts:
        problem = pose_nominal(part)
        for what in EQUATIONS:
            reason = record_equations(problem, Layout.of(problem), what)
            if isinstance(reason, str):
                yield Finding(part.name, f"its {what} cannot be recorded: {reason}",
                              "simulations and studies take some 50 times as long",
                              "Use arithmetic and plain functions of numpy, and numpy.where in the place of if")
                break


def _check_signals(machine: Machine, experiments: Experiments, runs: Runs) -> Iterator[Finding]:
    finer = simulate_runs(machine, experiments, fine=2 * FINE)
    for sensor in machine.sensors:
        if sensor.signal not in runs.signals:
            continue
        signal = runs.signals[sensor.signal]
        span = float(np.ptp(signal))
        if span == 0:
            yield Finding(sensor.signal, "it does not change in any experiment", "a study sees nothing in it",
                          "Check the equations, the profiles of the commands and the start")
            continue
        change = float(np.abs(finer.signals[sensor.signal] - signal).max()) / span
        if change > _FINE:
            yield Finding(sensor.signal, f"half the step changes it by {100 * change:.2g} % of its range",
                          "the simulation is not accurate", "Give the machine a shorter step, or look for a jump of "
                          "its equations: declare its state among `switches`")
        if not sensor.noise:
            yield Finding(sensor.signal, "its sensor has no noise", "simulated recordings of it are perfect",
                          "Give the sensor the standard deviation of a sample as `noise`")
        elif sensor.noise > _NOISY * span:
            yield Finding(sensor.signal, f"its noise is {100 * sensor.noise / span:.2g} % of its range",
                          "little is seen in it", "Check the units of the noise and of the signal")


def _check_outputs(outputs: dict[str, np.ndarray]) -> Iterator[Finding]:
    for name, values in outputs.items():
        missing = int(np.isnan(values).sum())
        if missing:
            yield Finding(name, f"{missing} of {len(values)} experiments have no such output",
                          "tables have no value there", "Choose a level that every experiment reaches")


def _check_quantities(machine: Machine, experiments: Experiments, runs: Runs) -> Iterator[Finding]:
    """Yield quantities of which a large change is seen in no signal."""
    for quantity in dict.fromkeys(each for block in machine.blocks for each in block.quantities):
        size = _LARGE if quantity.relative else quantity.size
        law = Law((quantity.name, "time"), "curve", quantity.unit, "s", np.array([0.0, 1.0]), np.full(2, size),
                  np.zeros((2, 2)), 0)
        changed = simulate_runs(machine, experiments, laws=[law])
        if _is_same(changed, runs):
            yield Finding(quantity.name, "no signal changes with it in any experiment",
                          "a law over it can never be found",
                          f"Write q.{identifier_of(quantity.name)} in the equations, add an experiment that reaches "
                          "it, or leave it out")


def _check_parameters(machine: Machine, experiments: Experiments, runs: Runs) -> Iterator[Finding]:
    """Yield parameters that are known to no share of their values, and those of which no signal shows a large change.

    The latter are such as a start that no function returns.
    """
    for parameter in machine.parameters:
        value = parameter.value or 0.0
        for what, share in (("scatter", parameter.scatter), ("within", parameter.within)):
            if parameter.is_factor(value) and 1 < share < np.inf:
                yield Finding(parameter.name, f"its `{what}` is {100 * share:g} % of its value",
                              "a study takes what is missing for a change of it",
                              f"Give a share, such as 0.05 for 5 %, or a `scale`, in units of which `{what}` then is")
        changed = value * (1 + _LARGE) if parameter.is_factor(value) else value + (parameter.scale or 1.0)
        if _is_same(simulate_runs(machine, experiments, {parameter.name: changed}), runs):
            yield Finding(parameter.name, "no signal changes with it in any experiment",
                          "no recording tells its value",
                          f"Read p.{identifier_of(parameter.name)} in the rates, the start or the output of its block, "
                          "add an experiment that reaches it, or leave it out")


def _is_same(changed: Runs, runs: Runs) -> bool:
    """Return whether no signal has changed but for rounding."""
    return all(np.abs(changed.signals[name] - signal).max() <= _UNCHANGED * np.abs(signal).max()
               for name, signal in runs.signals.items())
