"""Blocks of a machine, or all of them, as one: every signal that a block gives is simulated, and read by the others."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.machine.declaration import Block, Machine, Namespace, as_tuple, identifier_of
from slipstick.machine.system import read_states

_TRIED = np.ones((1, 1))
"""A value of one run at one instant, by which outputs are tried."""


def compose(machine: Machine) -> Machine:
    """Return the machine with one block that has the equations of all, driven by what none of them gives.

    These are commands, conditions, and signals that are measured only. Where several blocks give a signal, the first
    one with states does. Raises `InvalidValue` for an algebraic loop, and for states of the same name in two blocks.
    """
    whole = _merge(machine, machine.blocks, "whole")
    known = (*whole.signals, *whole.reads)
    return Machine(machine.name, (whole,), tuple(each for each in machine.sensors if each.signal in known),
                   machine.commands, machine.conditions, machine.signals, machine.inputs)


def join_blocks(machine: Machine, names: Collection[str]) -> Machine:
    """Return the machine with one block in the place of those of the `names`, as `compose` does with all."""
    joined = [block for block in machine.blocks if block.name in names]
    whole = _merge(machine, joined, " and ".join(block.name for block in joined))
    blocks = tuple(whole if block is joined[0] else block for block in machine.blocks if block not in joined[1:])
    return replace(machine, blocks=blocks)


def _merge(machine: Machine, merged: Sequence[Block], name: str) -> Block:
    """Return one block with the equations of those that are `merged`."""
    givers = dict[str, Block]()
    for block in sorted(merged, key=lambda block: not block.states):
        for signal in block.signals:
            givers.setdefault(signal, block)
    blocks = sort_blocks(tuple(dict.fromkeys(givers.values())))
    states = tuple(state for block in blocks for state in block.states)
    for state in states:
        if states.count(state) > 1:
            raise InvalidValue(f"Two blocks of the machine '{machine.name}' have a state '{state}'",
                               "Rename one of them")
    given = tuple(dict.fromkeys(signal for block in blocks for signal in block.signals))
    reads = tuple(dict.fromkeys(name for block in blocks for name in block.reads if name not in given))
    whole = Block(
        name, gives=given, reads=reads, states=states,
        parameters=tuple(dict.fromkeys(each for block in blocks for each in block.parameters)),
        quantities=tuple(dict.fromkeys(each for block in blocks for each in block.quantities)),
        curves=tuple(each for block in blocks for each in block.curves),
        lowest={state: low for block in blocks for state, low in block.lowest.items()},
        switches=tuple(state for block in blocks for state in block.switches),
        derived=_join_derived(blocks),
        window=_join_windows(merged, given))
    whole.rate(_join_rates(blocks))
    whole.start(_join_starts(blocks))
    whole.output(_join_outputs(blocks, given))
    return whole


def sort_blocks(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    """Return blocks in the order in which their outputs can be computed: those that pass an input on come behind it.

    A block with an output of its own passes on the signals that this reads; one that gives states passes nothing on,
    nor do rates. Raises `InvalidValue` for an algebraic loop, with the names of its signals.
    """
    left, ordered = list(blocks), list[Block]()
    while left:
        waiting = {signal for block in left for signal in block.signals}
        ready = [block for block in left if not _output_reads(block, waiting & set(block.reads))]
        if not ready:
            loop = ", ".join(f"'{signal}'" for block in left for signal in block.signals)
            raise InvalidValue(f"The signals {loop} form an algebraic loop: each is computed from another one of them",
                               "Give one of the blocks a state, such as a short lag")
        ordered += ready
        left = [block for block in left if block not in ready]
    return tuple(ordered)


def _output_reads(block: Block, signals: Collection[str]) -> bool:
    """Return whether the output of a block reads one of the signals: whether it cannot be computed without them."""
    if block.output_function is None or not signals:
        return False
    states = {identifier_of(name) for name in block.states} | {f"{identifier_of(name)}_side" for name in block.switches}
    x, u, q, p = (Namespace(**dict.fromkeys(map(identifier_of, names), _TRIED)) for names in (
        states, set(block.reads) - set(signals), [each.name for each in block.quantities],
        [*(each.name for each in block.parameters), *block.reads]))  # conditions are read like parameters
    try:
        with np.errstate(all="ignore"):
            block.output_function(x, u, q, p)
    except Exception:  # for the want of a signal, or for another reason that tells nothing of them
        return True
    return False


def _name_signals(blocks: tuple[Block, ...]) -> Callable[[Any, Any, Any, Any], Namespace]:
    """Return a function that returns all inputs and the signals that blocks give, by identifier."""
    givers = [(block.output_function or read_states(block), [identifier_of(signal) for signal in block.signals])
              for block in blocks]

    def name(x: Any, u: Any, q: Any, p: Any) -> Namespace:
        known = Namespace(**vars(u))
        for give, signals in givers:
            for signal, value in zip(signals, as_tuple(give(x, known, q, p)), strict=True):
                if not hasattr(known, signal):  # which a block before it gives
                    setattr(known, signal, value)
        return known

    return name


def _join_outputs(blocks: tuple[Block, ...], given: tuple[str, ...]) -> Callable[[Any, Any, Any, Any], Any]:
    name, signals = _name_signals(blocks), [identifier_of(signal) for signal in given]

    def output(x: Any, u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        known = name(x, u, q, p)
        return tuple(getattr(known, signal) for signal in signals)

    return output


def _join_rates(blocks: tuple[Block, ...]) -> Callable[[Any, Any, Any, Any], Any]:
    name = _name_signals(blocks)

    def rate(x: Any, u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        known, rates = name(x, u, q, p), list[Any]()
        for block in blocks:
            if block.rate_function is not None:
                rates += as_tuple(block.rate_function(x, known, q, p))
        return tuple(rates)

    return rate


def _join_starts(blocks: tuple[Block, ...]) -> Callable[[Any, Any, Any], Any]:
    def start(u: Any, q: Any, p: Any) -> tuple[Any, ...]:
        begins = list[Any]()
        for block in blocks:
            begins += as_tuple(block.start_function(u, q, p) if block.start_function else (0.0,) * len(block.states))
        return tuple(begins)

    return start


def _join_derived(blocks: tuple[Block, ...]) -> dict[str, Callable[[Any, Any, Any], Any]]:
    """Return the further own variables of all blocks, which may read what another one gives; quantities are 0."""
    name = _name_signals(blocks)
    q = Namespace(**{identifier_of(each.name): 0.0 for block in blocks for each in block.quantities})

    def join(derive: Callable[[Any, Any, Any], Any]) -> Callable[[Any, Any, Any], Any]:
        return lambda x, u, p: derive(x, name(x, u, q, p), p)

    return {each: join(derive) for block in blocks for each, derive in block.derived.items()}


def _join_windows(blocks: Sequence[Block], given: tuple[str, ...]) -> Callable[[Any], Any] | None:
    """Return the samples of each signal that count in a block that gives it; None where all do."""
    windows: Mapping[str, list[Callable[[Any], np.ndarray] | None]] = {
        signal: [block.window for block in blocks if signal in block.signals] for signal in given}
    if all(None in own for own in windows.values()):
        return None

    def window(u: Any) -> tuple[Any, ...]:
        return tuple(True if None in own else np.any([each(u) for each in own if each is not None], axis=0)
                     for own in windows.values())

    return window
