"""The equations of a machine are tried once on arrays, so that what is wrong with them is told with block and line."""

import traceback
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue, UnknownName
from slipstick.machine.declaration import Block, Machine, Namespace, as_tuple, identifier_of

_SHAPE = 2, 3
"""Runs and instants of a trial: more than one of both, as in a study."""


class _Watched(Namespace):
    """A namespace that knows which attributes were read."""

    def __init__(self, **values: Any) -> None:
        super().__init__(**values)
        self.__dict__["_read"] = set()

    def __getattribute__(self, name: str) -> Any:
        if not name.startswith("_"):
            super().__getattribute__("__dict__")["_read"].add(name)
        return super().__getattribute__(name)


def try_equations(machine: Machine) -> None:
    """Evaluate the equations of each block once, at nominal parameters; raises `InvalidValue` where they fail.

    Equations fail where they read a name that their block does not declare, take other arguments, compute with single
    numbers, or return something else than an array for each state or signal. Those of a state that switches must read
    its side, or the state would never come to rest. A start may not read the signal of a block, which the simulation of
    the whole machine has only after it.
    """
    for block in machine.blocks:
        _Trial(machine, block).run()


class _Trial:
    """One block with namespaces of all that its equations may read."""

    def __init__(self, machine: Machine, block: Block) -> None:
        self.block, self.place = block, f"the block '{block.name}' of the machine '{machine.name}'"
        values: dict[str, float] = {each.name: each.profiles[0][0][1] for each in machine.commands if each.profiles}
        levels = {each.name: each.levels[0] if each.levels else 1.0 for each in machine.conditions}
        self.u = {identifier_of(name): np.full(_SHAPE, values.get(name, 1.0)) for name in block.reads
                  if name not in levels}
        self.p = {identifier_of(each.name): np.full((_SHAPE[0], 1), 1.0 if each.value is None else each.value)
                  for each in block.parameters}
        self.p |= {identifier_of(name): np.full((_SHAPE[0], 1), levels[name]) for name in block.reads if name in levels}
        self.q = {identifier_of(each.name): 0.0 for each in block.quantities}
        self.given = {identifier_of(signal): signal for each in machine.blocks for signal in each.signals}

    def run(self) -> None:
        """Try start, rates, output and derived variables, in the order in which the engine needs them."""
        block, begins = self.block, tuple(np.zeros(_SHAPE) for _ in self.block.states)
        u, q, p = _Watched(**self.u), Namespace(**self.q), Namespace(**self.p)
        if block.start_function is not None:
            begins = self._evaluate("start", block.start_function, {"u": u, "q": q, "p": p}, block.states)
            for name in sorted(u._read & self.given.keys()):
                raise InvalidValue(
                    f"The start of {self.place} reads u.{name}, which has no value before the whole machine has begun",
                    "Read a parameter instead, such as Parameter(..., value=..., scale=..., "
                    f"first_of='{self.given[name]}'); several blocks may have the same one")
        x = _Watched(**dict(zip((identifier_of(name) for name in block.states), begins, strict=True)),
                     **{f"{identifier_of(name)}_side": np.ones(_SHAPE) for name in block.switches})
        every = {"x": x, "u": u, "q": q, "p": p}
        if block.rate_function is not None:
            self._evaluate("rates", block.rate_function, every, block.states)
            for name in block.switches:
                side = f"{identifier_of(name)}_side"
                if side not in x._read:
                    raise InvalidValue(
                        f"The rates of {self.place} do not read x.{side}, although '{name}' is among its switches",
                        f"Write x.{side}, which is -1, 0 or 1, where the rate jumps, in the place of "
                        f"np.sign(x.{identifier_of(name)}) or a steep tanh of it")
        if block.output_function is not None:
            self._evaluate("output", block.output_function, every, block.signals)
        for name, derive in block.derived.items():
            self._evaluate(f"derived variable '{name}'", derive, {"x": x, "u": u, "p": p}, (name,))

    def _evaluate(self, what: str, function: Callable[..., Any], given: Mapping[str, Namespace],
                  names: tuple[str, ...]) -> tuple[np.ndarray, ...]:
        """Return what a function gives for each of the names, as arrays of the shape of a trial."""
        place, code = f"The {what} of {self.place}", getattr(function, "__code__", None)
        begins = "" if code is None else f" (line {code.co_firstlineno})"
        try:
            with np.errstate(all="ignore"):
                returned = as_tuple(function(*given.values()))
        except Exception as error:
            raise self._explain(place, code and code.co_filename, error, given) from error
        if len(returned) != len(names):
            raise InvalidValue(f"{place}{begins}: the function returns {len(returned)} values instead of {len(names)}",
                               f"Return one for each of: {', '.join(names)}, in this order")
        try:
            if any(each is None for each in returned):  # which numpy would take as not a number
                raise TypeError
            return tuple(np.broadcast_to(np.asarray(each, float), _SHAPE) for each in returned)
        except (TypeError, ValueError):
            raise InvalidValue(f"{place}{begins}: the function returns no array for each of: {', '.join(names)}",
                               "End the function with `return`, and compute with the arrays that it is given") from None

    def _explain(self, place: str, file: str | None, error: Exception, given: Mapping[str, Namespace]) -> InvalidValue:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
        place += f", line {lines[-1]}" if lines else ""
        letter = next((letter for letter, each in given.items() if each is getattr(error, "obj", None)), None)
        if isinstance(error, AttributeError) and letter is not None:
            known = [name for name in vars(given[letter]) if not name.startswith("_")]
            for state in self.block.states if letter == "x" else ():
                if error.name == f"{identifier_of(state)}_side":
                    return InvalidValue(f"{place}: x.{error.name} is read, and '{state}' is not among the switches of "
                                        "the block", f"Declare switches=({state!r},) in the block")
            elsewhere = next((f". It is read as {other}.{error.name}" for other, each in given.items()
                              if error.name in vars(each)), "")
            return InvalidValue(f"{place}: the block declares no {letter}.{error.name}{elsewhere}",
                                UnknownName.of("name", str(error.name), known).remedy)
        remedy = "Correct the line; states, inputs and parameters are arrays over runs and instants"
        if isinstance(error, ValueError) and "truth value" in str(error):
            return InvalidValue(f"{place}: `if`, `max`, `min` and `and` take single numbers, and these are arrays over "
                                "runs and instants", "Write numpy.where, numpy.maximum, numpy.minimum and `&`")
        if isinstance(error, TypeError) and "argument" in str(error):
            remedy = f"Declare the function with the arguments ({', '.join(given)}), in this order"
        return InvalidValue(f"{place}: {type(error).__name__}: {error}", remedy)
