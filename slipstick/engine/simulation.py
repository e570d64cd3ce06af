"""The simulation of a whole machine from its commands and conditions, with laws that were measured of it."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.engine.equations import OwnLaw, Problem
from slipstick.engine.measured_law import Law
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue
from slipstick.machine.declaration import SENSOR, Machine, identifier_of
from slipstick.machine.experiments import Experiments, require_simulated
from slipstick.machine.runs import Profile, Runs
from slipstick.machine.runs_file import units_of
from slipstick.machine.system import System, system_of
from slipstick.machine.whole import compose

FINE = 4
"""Steps of an integration between two samples."""


def simulate(machine: Machine, time: np.ndarray, commands: Mapping[str, Profile],
             values: Mapping[str, float | np.ndarray], laws: Sequence[Law] = (), fine: int = FINE) -> dict[str,
             np.ndarray]:
    """Return the signals (n, k) of a machine at equidistant instants `time` (k,) in s, for n runs.

    `values` are the parameters and the conditions by name, numbers or (n,). The equations are integrated with `fine`
    steps between two instants. Raises `InvalidValue` for a value that is missing, for a machine that is driven by a
    measured signal, and for a law over something that a simulation does not have.
    """
    require_simulated(machine)
    block = compose(machine).blocks[0]
    system, count = system_of(block), _count_runs(commands, values)
    instants = np.linspace(time[0], time[-1], fine * (len(time) - 1) + 1)
    lines = {name: profile.approximate(instants) if block.states else profile.at(instants)
             for name, profile in commands.items()}
    inputs = {identifier_of(name): values for name, values in lines.items() if name in block.reads}
    if block.states:
        system, exact = system.read_at_instants({identifier_of(name): profile.at(instants)
                                                 for name, profile in commands.items() if name in block.reads})
        inputs |= exact
    inputs.setdefault("time", np.broadcast_to(instants, (count, len(instants))))
    names = [*(each.name for each in block.parameters),
             *(each.name for each in machine.conditions if each.name in block.reads)]
    known = {name: np.reshape(_value_of(machine, name, values), (-1, 1)) for name in names}
    parameters = {identifier_of(name): np.broadcast_to(value, (count, 1)) for name, value in known.items()}
    quantities: dict[str, float | np.ndarray] = {identifier_of(each.name): 0.0 for each in block.quantities}
    inner = list[OwnLaw]()
    for law in laws:
        quantity, on = identifier_of(law.pair[0]), law.pair[1]
        if law.pair[0].endswith(SENSOR):
            continue  # an error of a sensor changes nothing of the machine
        if on in system.own:
            place = block.states.index(on) if law.jumps else None
            inner.append(OwnLaw("quantity", quantity, on, law.x, law.change, place))
        else:
            quantities[quantity] = quantities[quantity] + _evaluate(law, lines, values, instants)
    problem = Problem(system, float(instants[1] - instants[0]), inputs, quantities, parameters, tuple(inner))
    outputs = solve(problem).outputs[:, :, ::fine]
    return {name: outputs[:, place] for place, name in enumerate(block.signals)}


def compile_kernels() -> None:
    """Load what steps the equations of all machines, or compile it, before a clock starts."""
    system = System(("x",), ("x",), lambda x, u, q, p: -x.x, lambda u, q, p: 1.0, lambda x, u, q, p: x.x)
    solve(Problem(system, 1.0, {"u": np.zeros((1, 2))}, {}, {})).A  # noqa: B018, computed when it is asked for


def simulate_runs(machine: Machine, experiments: Experiments, values: Mapping[str, float] | None = None,
                  laws: Sequence[Law] = (), seed: int | None = None, fine: int = FINE) -> Runs:
    """Return runs of experiments as they would be recorded, in a random order.

    Parameters scatter between runs by half of what is declared at most, and sensors have their noise. Without a `seed`
    there is neither, and the order is that of the experiments.
    """
    count, random = len(experiments), np.random.default_rng(seed)
    values = {**{each.name: each.value for each in machine.parameters if each.value is not None}, **(values or {})}
    if seed is not None:
        experiments = experiments.take(random.permutation(count))
    drawn: dict[str, float | np.ndarray] = {**values, **experiments.conditions}
    for each in machine.parameters if seed is not None else ():
        if each.scatter > 0 and each.name in values:
            change = each.scatter / 2 * random.standard_normal(count)
            nominal = values[each.name]
            drawn[each.name] = (nominal * np.exp(change) if each.is_factor(nominal)
                                else nominal + (each.scale or 1.0) * change)
    signals = simulate(machine, experiments.time, experiments.commands, drawn, laws, fine)
    if seed is not None:
        noise = {each.signal: each.noise for each in machine.sensors}
        signals = {name: signal + noise[name] * random.standard_normal(signal.shape)
                   for name, signal in signals.items()}
    return Runs(experiments.time, signals, experiments.commands, experiments.conditions, {}, np.arange(float(count)),
                units_of(machine), machine.name, "Simulated recordings of the machine as it is declared")


def _count_runs(commands: Mapping[str, Profile], values: Mapping[str, float | np.ndarray]) -> int:
    """Return the number of runs, of a machine without commands by its values."""
    if commands:
        return len(next(iter(commands.values())).time)
    return max((np.size(value) for value in values.values()), default=1)


def _value_of(machine: Machine, name: str, values: Mapping[str, float | np.ndarray]) -> float | np.ndarray:
    declared = {each.name: each.value for each in machine.parameters}
    value = values.get(name, declared.get(name))
    if value is None:
        raise InvalidValue(f"'{name}' of the machine '{machine.name}' has no value",
                           "Declare its `value`, or give it among the values")
    return value


def _evaluate(law: Law, commands: Mapping[str, np.ndarray], values: Mapping[str, float | np.ndarray],
              instants: np.ndarray) -> np.ndarray:
    """Return a law (n, K), or (n, 1) over what is constant in a run; `commands` are (n, K)."""
    on = law.pair[1]
    if law.kind == "past" and on.removeprefix("past ") in commands:
        variable = law.variable(float(instants[1] - instants[0]))
        return variable.weigh(law.change, commands[on.removeprefix("past ")])
    if on in commands:
        return law.at(commands[on])
    if on == "time":
        return law.at(instants - instants[0])[None]
    if on in values:
        return law.at(np.reshape(values[on], (-1, 1)))
    raise InvalidValue(f"The law of '{law.pair[0]}' depends on '{on}', which the simulation does not have",
                       "Give it among the values, if it is constant in a run")
