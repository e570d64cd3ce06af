"""The equations of a block, or of a whole machine, as functions of arrays: what the engine integrates."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slipstick.machine.declaration import Block, Namespace, identifier_of

Values = Mapping[str, Any]
"""Arrays that broadcast against each other, by identifier."""
States = tuple[np.ndarray, ...]
AT_INSTANTS = "at instants: "
"""What the name of an input has before that of the command whose values outputs read: no identifier has this."""


@dataclass(frozen=True, eq=False)
class System:
    """x' = rate(x, u, q, p), x(0) = start(u, q, p), and the `signals` y = output(x, u, q, p).

    `states` are identifiers, `lowest` (d,) their least values, `switches` the places of those whose rate may jump at 0.
    `own` are the variables that laws inside the equations may depend on: functions of x, u and p.
    """

    states: tuple[str, ...]
    signals: tuple[str, ...]
    rate: Callable[[Any, Any, Any, Any], Any]
    start: Callable[[Any, Any, Any], Any]
    output: Callable[[Any, Any, Any, Any], Any]
    own: Mapping[str, Callable[[Any, Any, Any], Any]] = field(default_factory=dict)
    lowest: tuple[float, ...] = ()
    switches: tuple[int, ...] = ()

    def name(self, x: States, sides: Mapping[int, np.ndarray]) -> Namespace:
        """Return the namespace of states, with the sides of those that switch."""
        named = dict(zip(self.states, x, strict=True))
        return Namespace(**named, **{f"{self.states[place]}_side": side for place, side in sides.items()})

    def read_at_instants(self, commands: Values) -> tuple["System", Values]:
        """Return the system whose output reads `commands` (n, K) themselves at each instant, and these as its inputs.

        The rates read lines between instants that are closest to them, which are off by up to half of a jump beside it.
        """
        read = {name: AT_INSTANTS + name for name in commands}

        def output(x: Any, u: Any, q: Any, p: Any) -> Any:
            named = {**vars(u), **{name: getattr(u, exact) for name, exact in read.items()}}
            return self.output(x, Namespace(**named), q, p)

        return replace(self, output=output), {read[name]: values for name, values in commands.items()}


def system_of(block: Block) -> System:
    """Return the equations of a block."""
    states = tuple(identifier_of(name) for name in block.states)
    own = {name: _read(name) for name in block.states} | dict(block.derived)
    if block.output_function is None:
        own |= {signal: _read(state) for signal, state in zip(block.signals, block.given_states, strict=True)}
    return System(states, block.signals, block.rate_function or (lambda x, u, q, p: ()),
                  block.start_function or (lambda u, q, p: (0.0,) * len(states)),
                  block.output_function or read_states(block), own,
                  tuple(block.lowest.get(name, -np.inf) for name in block.states),
                  tuple(block.states.index(name) for name in block.switches))


def read_states(block: Block) -> Callable[[Any, Any, Any, Any], Any]:
    """Return the output of a block without one of its own: the states that it gives."""
    names = tuple(identifier_of(state) for state in block.given_states)
    return lambda x, u, q, p: tuple(getattr(x, name) for name in names)


def _read(name: str) -> Callable[[Any, Any, Any], Any]:
    attribute = identifier_of(name)
    return lambda x, u, p: getattr(x, attribute)
