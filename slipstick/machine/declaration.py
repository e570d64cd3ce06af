"""What a machine is: blocks with equations, the parameters and quantities in them, sensors, commands and conditions.

The functions of a block are ordinary numpy code over arrays that broadcast: states `x`, inputs `u`, quantities `q` and
parameters `p` are namespaces with an attribute for each name (a space or a hyphen becomes an underscore). They are
evaluated for many runs and instants at once, so that `numpy.where` takes the place of `if`. Nothing is compiled:
arithmetic and plain functions of numpy are recorded once (`engine.tape`); what else they call is slower.

    tank = Block("tank", gives="level", reads=("voltage",), states=("level",), parameters=(GAIN, OUTLET, AREA, START),
                 quantities=(LEAK,), lowest={"level": 0.0})

    @tank.rate
    def _(x, u, q, p):
        return (p.pump_gain * u.voltage - p.outlet * np.sqrt(x.level) - q.leak) / p.area

    @tank.start
    def _(u, q, p):
        return p.start_level
"""

import keyword
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.machine.kinds import KINDS, MEMORIES, Kind
from slipstick.machine.values import require_corners, require_numbers, require_tuples

Namespace = SimpleNamespace
Rate = Callable[[Any, Any, Any, Any], Any]
Start = Callable[[Any, Any, Any], Any]

TAKEN = ("end", "largest", "smallest", "mean")
"""What an output may be of a signal, where it is no time."""
SENSOR = " sensor"
"""What the name of the quantity "error of a sensor" adds to the name of its signal."""


def identifier_of(name: str) -> str:
    """Return the attribute by which equations read a name."""
    return re.sub(r"\W", "_", name)


def as_tuple(values: Any) -> tuple[Any, ...]:
    """Return what a declared function returns as a tuple."""
    return values if isinstance(values, tuple) else (values,)


@dataclass(frozen=True)
class Parameter:
    """A constant of the equations in `unit`, which may scatter between runs.

    It is its nominal value times a factor; with a `scale`, or a nominal value of 0, changes are additive in units of
    that. `scatter` is the largest standard deviation of such a change, or of the logarithm of the factor, between runs,
    and `within` that by which the mean over the runs is known, infinite where it is calibrated. `value` is the nominal
    value, where no other one is given; in recordings, with `first_of`, it is the first value of that signal in each
    run, to which changes are added.
    """

    name: str
    unit: str = ""
    scatter: float = 0.05
    within: float = math.inf
    value: float | None = None
    scale: float | None = None
    first_of: str | None = None

    def is_factor(self, nominal: float | np.ndarray) -> bool:
        """Return whether changes multiply a nominal value, which may differ between runs."""
        return self.scale is None and self.first_of is None and bool(np.all(nominal))


@dataclass(frozen=True)
class Quantity:
    """A named place of the equations that a law or an effect may change; 0 where the model has it as declared.

    A `relative` quantity is a share. `size`, in `unit`, is that of a large change. By default it may depend on all that
    is known within a run or of a run; `without` are names on which it cannot, for a physical reason, and `over` says
    on what alone it may. `disturbance`, in `unit`, is the largest standard deviation by which it fluctuates within a
    run for reasons that are not modelled.
    """

    name: str
    unit: str = ""
    relative: bool = False
    size: float = 1.0
    over: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    disturbance: float = 0.0


@dataclass(frozen=True)
class Curve:
    """An error of a curve of the data sheet: a law of `quantity` over an own variable with a known prior.

    `within` is its standard deviation, `knots` the number of coefficients over the range that the runs visit.
    """

    quantity: str
    over: str
    within: float
    knots: int = 8


Corners = tuple[tuple[float, float], ...]
"""Instants in s and values of a command, linear between them and constant beyond."""


@dataclass(frozen=True)
class Command:
    """An input that is known exactly, as a function of time; `profiles` are those of the machine's own experiments."""

    name: str
    unit: str = ""
    profiles: tuple[Corners, ...] = ()


@dataclass(frozen=True)
class Condition:
    """A constant of a run, in `unit`, that its protocol states.

    Its levels are off by errors with the relative standard deviation `within`, and each run by at most `scatter`.
    `drifts` tells that the error may also change over the run order. `levels` are those of the machine's own
    experiments.
    """

    name: str
    unit: str = ""
    within: float = 0.02
    scatter: float = 0.05
    drifts: bool = False
    levels: tuple[float, ...] = ()


@dataclass(frozen=True)
class Sensor:
    """A measured signal; what its error may depend on is excluded by `without` where physics forbids it.

    `noise` is the standard deviation of what simulated runs get; that of recordings is estimated.
    """

    signal: str
    unit: str = ""
    without: tuple[str, ...] = ()
    noise: float = 0.0

    @property
    def quantity(self) -> Quantity:
        """The error of the sensor: what it reads too much."""
        return Quantity(self.signal + SENSOR, self.unit, without=self.without)


@dataclass(frozen=True)
class Output:
    """A number of each run, which tables, propagations and fits are about, in `unit`.

    It is the time in s at which the signal `of` first rises `above` or falls `below` a level, if there is one, and else
    what is to `take` of it: its value at the "end", or the "largest", the "smallest" or the "mean".
    """

    name: str
    unit: str
    of: str
    above: float | None = None
    below: float | None = None
    take: str = "end"


@dataclass(frozen=True)
class Effect:
    """A physical effect that may be missing: a law of a `kind` of `quantity` over `on`, which is called by its `name`.

    The kind is one that all machines have, by its name, or the machine's own one. Effects name laws; a study compares
    all pairs and all kinds, whether they have a name or not.
    """

    name: str
    quantity: str
    on: str
    kind: str | Kind


@dataclass(eq=False)
class Block:
    """A part of a machine between signals: `reads` inputs, and `gives` the signal of a sensor, or several ones.

    `states` are integrated, and never below their `lowest` value. A state among `switches` has a surface at 0 where its
    rate may jump: equations read its side, -1 or 1, as the attribute `<state>_side` of `x`, and it rests at 0 while the
    rates of both sides point there. Its side is then the value between at which its rate is 0. `window` maps the
    namespace of measured signals to the samples that count. `derived` are further own variables that laws may depend
    on, functions of `x`, `u` and `p`.
    """

    name: str
    gives: str | tuple[str, ...]
    reads: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    curves: tuple[Curve, ...] = ()
    lowest: Mapping[str, float] = field(default_factory=dict)
    switches: tuple[str, ...] = ()
    derived: Mapping[str, Callable[[Any, Any, Any], Any]] = field(default_factory=dict)
    window: Callable[[Any], np.ndarray] | None = None
    rate_function: Rate | None = None
    start_function: Start | None = None
    output_function: Rate | None = None

    def rate(self, function: Rate) -> Rate:
        """Declare the rates of the states: `function(x, u, q, p)` returns one array, or a tuple in their order."""
        self.rate_function = function
        return function

    def start(self, function: Start) -> Start:
        """Declare the states at the begin of a run: `function(u, q, p)`; they are 0 without it."""
        self.start_function = function
        return function

    def output(self, function: Rate) -> Rate:
        """Declare the signal that the block gives: `function(x, u, q, p)`, or a tuple; without it, it is the state of
        that name, or else the first one."""
        self.output_function = function
        return function

    @property
    def signals(self) -> tuple[str, ...]:
        """The signals that the block gives."""
        return (self.gives,) if isinstance(self.gives, str) else self.gives

    @property
    def given_states(self) -> tuple[str, ...]:
        """The states that are the signals of a block without an output of its own; none where that cannot be."""
        named = {identifier_of(state): state for state in self.states}
        signals = [identifier_of(signal) for signal in self.signals]
        if set(signals) <= set(named):
            return tuple(named[signal] for signal in signals)
        return self.states[:1] if len(signals) == 1 else ()


@dataclass(frozen=True, eq=False)
class Machine:
    """`blocks` with what drives them and what is measured of them; raises `InvalidValue` for what does not fit.

    `signals` are further signals within a run that laws may depend on, functions of the namespace of measured signals.
    `inputs` are recorded channels that only equations and windows read. The machine's own experiments are all
    combinations of the profiles of its commands and the levels of its conditions; they take `duration` s with a sample
    every `step` s, and `outputs` are numbers of each.
    """

    name: str
    blocks: tuple[Block, ...]
    sensors: tuple[Sensor, ...]
    commands: tuple[Command, ...] = ()
    conditions: tuple[Condition, ...] = ()
    signals: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    duration: float = 0.0
    step: float = 0.0
    outputs: tuple[Output, ...] = ()
    effects: tuple[Effect, ...] = ()

    @classmethod
    def open(cls, path: Path | str) -> "Machine":
        """Return the machine that a Python file declares, or a shipped one by its name."""
        from slipstick.machine.opening import open_machine  # which needs this class

        return open_machine(path)

    def __post_init__(self) -> None:
        """Refuse values that cannot be, names that collide, inputs that nobody gives, and blocks without equations."""
        self._require_values()
        require_names([*(each.name for each in self.blocks)], "blocks")
        known = [*(each.name for each in self.commands), *(each.signal for each in self.sensors),
                 *(each.name for each in self.conditions), *self.signals, *self.inputs]
        require_names(known, "inputs")
        given = [signal for each in self.blocks for signal in each.signals]
        for block in self.blocks:
            self._require_block(block, set(known) | set(given))
        require_names([*(each.name for each in self.parameters), *(each.name for each in self.conditions)],
                      "parameters and conditions")
        require_names([each.name for each in self.quantities], "quantities")
        for output in self.outputs:
            self._require_output(output)
        for effect in self.effects:
            self._require_effect(effect)

    def _require_values(self) -> None:
        place = f"The machine '{self.name}'"
        require_tuples(self, place, ("blocks", "sensors", "commands", "conditions", "inputs", "outputs", "effects"))
        require_numbers(self, place, other=("duration", "step"))
        for block in self.blocks:
            require_tuples(block, f"The block '{block.name}' of the machine '{self.name}'",
                           ("reads", "states", "parameters", "quantities", "curves", "switches"))
            for parameter in block.parameters:
                require_numbers(parameter, f"The parameter '{parameter.name}'", above=("scale",),
                                least=("scatter", "within"), other=("value",))
            for quantity in block.quantities:
                require_numbers(quantity, f"The quantity '{quantity.name}'", above=("size",), least=("disturbance",))
                require_tuples(quantity, f"The quantity '{quantity.name}'", ("without",))
        for sensor in self.sensors:
            require_numbers(sensor, f"The sensor '{sensor.signal}'", least=("noise",))
            require_tuples(sensor, f"The sensor '{sensor.signal}'", ("without",))
        for command in self.commands:
            require_tuples(command, f"The command '{command.name}'", ("profiles",))
            require_corners(command.profiles, f"the command '{command.name}'")
        for condition in self.conditions:
            require_numbers(condition, f"The condition '{condition.name}'", least=("within", "scatter"))
            require_tuples(condition, f"The condition '{condition.name}'", ("levels",))

    def _require_effect(self, effect: Effect) -> None:
        place = f"The effect '{effect.name}' of the machine '{self.name}'"
        known = [each.name for each in self.quantities]
        if effect.quantity not in known:
            raise InvalidValue(f"{place} changes '{effect.quantity}', which is no quantity",
                               f"Name one of: {', '.join(known)}")
        kinds = [*(each.name for each in KINDS), *MEMORIES]
        if isinstance(effect.kind, str) and effect.kind not in kinds:
            raise InvalidValue(f"{place} is of a kind '{effect.kind}' that does not exist",
                               f"Give a Kind, or one of: {', '.join(kinds)}")

    def kinds_of(self, pair: tuple[str, str]) -> tuple[Kind, ...]:
        """Return the kinds that a law of a pair of quantity and dependence may be of: own ones, and those of all."""
        own = tuple(effect.kind for effect in self.effects
                    if isinstance(effect.kind, Kind) and (effect.quantity, effect.on) == pair)
        return (*own, *KINDS)

    def effect_of(self, pair: tuple[str, str], kind: str) -> Effect | None:
        """Return the effect that a law of a pair and a kind is, None where none is declared."""
        for effect in self.effects:
            name = effect.kind.name if isinstance(effect.kind, Kind) else effect.kind
            if (effect.quantity, effect.on, name) == (*pair, kind):
                return effect
        return None

    def _require_output(self, output: Output) -> None:
        place = f"The output '{output.name}' of the machine '{self.name}'"
        if output.of not in (signals := [sensor.signal for sensor in self.sensors]):
            raise InvalidValue(f"{place} is of '{output.of}', which no sensor measures",
                               f"Name one of: {', '.join(signals)}")
        if output.above is not None and output.below is not None:
            raise InvalidValue(f"{place} has two levels", "Give `above` or `below`")
        if output.take not in TAKEN:
            raise InvalidValue(f"{place} is to take '{output.take}'", f"Give one of: {', '.join(TAKEN)}")

    def _require_block(self, block: Block, known: set[str]) -> None:
        place = f"The block '{block.name}' of the machine '{self.name}'"
        for name in block.reads:
            if name not in known:
                raise InvalidValue(f"{place} reads '{name}', which is no command, condition or signal",
                                   f"Declare it, or read one of: {', '.join(sorted(known))}")
        for parameter in block.parameters:
            if parameter.first_of is not None and parameter.first_of not in known:
                raise InvalidValue(f"The parameter '{parameter.name}' is the first value of '{parameter.first_of}', "
                                   "which is no command or signal", f"Name one of: {', '.join(sorted(known))}")
        for signal in block.signals:
            if signal not in [sensor.signal for sensor in self.sensors]:
                raise InvalidValue(f"{place} gives '{signal}', which no sensor measures",
                                   "Declare a Sensor of this signal")
        if block.states and block.rate_function is None:
            raise InvalidValue(f"{place} has states and no rates", "Declare them with the decorator @block.rate")
        if not block.states and block.output_function is None:
            raise InvalidValue(f"{place} has neither states nor an output",
                               "Declare it with the decorator @block.output")
        if block.output_function is None and not block.given_states:
            raise InvalidValue(f"{place} gives several signals that are not all states, and has no output",
                               "Declare it with the decorator @block.output, which returns one value for each signal")
        for name in (*block.lowest, *block.switches):
            if name not in block.states:
                raise InvalidValue(f"{place} has no state '{name}'", f"Its states are: {', '.join(block.states)}")
        require_names([*block.states, *(f"{name} side" for name in block.switches)], f"states of '{block.name}'")

    @cached_property
    def driving(self) -> tuple[str, ...]:
        """The signals that blocks read and sensors measure, but no block gives: a simulation does not have them."""
        given = {signal for block in self.blocks for signal in block.signals}
        read = {name for block in self.blocks for name in block.reads} - given
        return tuple(sensor.signal for sensor in self.sensors if sensor.signal in read)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters of all blocks, each once."""
        return tuple(dict.fromkeys(each for block in self.blocks for each in block.parameters))

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities of all blocks, and the errors of the sensors."""
        own = dict.fromkeys(each for block in self.blocks for each in block.quantities)
        return (*own, *(sensor.quantity for sensor in self.sensors))

    def quantity(self, name: str) -> Quantity:
        """Return a quantity by its name."""
        return next(each for each in self.quantities if each.name == name)

    def block(self, name: str) -> Block:
        """Return a block by its name."""
        return next(each for each in self.blocks if each.name == name)


def require_names(names: Sequence[str], what: str) -> None:
    """Raise `InvalidValue` where names are no identifiers, or two become the same one."""
    seen = dict[str, str]()
    for name in names:
        attribute = identifier_of(name)
        if not attribute.isidentifier() or keyword.iskeyword(attribute):
            raise InvalidValue(f"'{name}' cannot be a name among the {what}: '{attribute}' is no identifier",
                               "Begin with a letter, and avoid words of Python")
        if attribute in seen:
            raise InvalidValue(f"Among the {what}, '{seen[attribute]}' and '{name}' both become '{attribute}'",
                               "Rename one of them" + ", or declare a single one for all that have it"
                               * (seen[attribute] == name))
        seen[attribute] = name
