"""Declared equations as lists of operations, which compiled kernels evaluate for many runs at once.

The functions of a machine are called once with symbols in place of arrays, which record what numpy is asked to compute
(operator overloading: Griewank and Walther, Evaluating Derivatives, 2008, chapter 6). Nothing is compiled for a
machine: the kernels interpret the recorded operations, each for all runs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from slipstick.engine.equations import Equations, OwnLaw, Problem
from slipstick.machine.declaration import Namespace
from slipstick.machine.system import System

Kind = Literal["input", "quantity", "parameter"]
Name = tuple[Kind, str]
"""What equations read: its kind, and its identifier."""

EQUATIONS: tuple[Literal["rate"], Literal["output"]] = "rate", "output"
"""The functions of a system that are recorded."""
OPERATIONS: dict[Any, int] = {function: code for code, function in enumerate((
    np.add, np.subtract, np.multiply, np.divide, np.negative, np.maximum, np.minimum, np.sqrt, np.power, np.exp, np.log,
    np.absolute, np.sign, np.sin, np.cos, np.tan, np.tanh, np.arctan, np.arctan2, np.sinh, np.cosh, np.arcsin,
    np.arccos, np.floor, np.remainder, np.less, np.less_equal, np.equal, np.not_equal, np.logical_and, np.logical_or,
    np.logical_not, np.where, np.interp))}
"""The numbers of operations, by the function of numpy that does them."""
_BESIDE = len(OPERATIONS)
"""The number of the operation that reads a table with a jump at 0 on the side of it."""
_STEPS = {np.sign, np.floor, np.less, np.less_equal, np.equal, np.not_equal, np.logical_and, np.logical_or,
          np.logical_not}
_SMOOTH = [slice(0) if function in _STEPS else slice(1, 3) if function is np.where else slice(
    getattr(function, "nin", 1)) for function in OPERATIONS] + [slice(1)]
"""The arguments with which the result of each operation changes smoothly: none of a comparison, such as others do."""
_SAME: dict[Any, Any] = {np.fabs: np.absolute, np.fmax: np.maximum, np.fmin: np.minimum,
                         np.bitwise_and: np.logical_and, np.bitwise_or: np.logical_or, np.invert: np.logical_not}
"""What else numpy calls an operation; logical values are numbers here."""
_ARGUMENTS: dict[Any, int] = {np.where: 3, np.interp: 3, np.clip: 3, np.zeros_like: 1, np.ones_like: 1}
"""Functions of numpy that are no elementary ones, with the arguments that they must have."""
_ROOT = {0.5: 0, 1.5: 1, 2.5: 2}
"""Powers that are a square root times a whole power, with this one."""


class _Untraceable(Exception):
    """A function computes what no tape can: it must be evaluated by numpy."""


@dataclass(frozen=True, eq=False)
class Tape:
    """Operations on rows of numbers, each row for all runs.

    Rows are, in this order: what is `constant` in a run, what is `driven` within it, a change, states, sides of states,
    literals (`literals` are their values), and what each operation gives. `program` (m, 5) has the operation, the row
    of its result, and those of three arguments. Its parts end at `ends` (3,): what depends on constants alone, on
    what is driven as well, and on states. `results` are rows. `tables` are those of functions, before those of laws.
    """

    constant: int
    driven: int
    literals: np.ndarray
    program: np.ndarray
    ends: np.ndarray
    results: np.ndarray
    rows: int
    tables: tuple[tuple[np.ndarray, np.ndarray], ...]

    @cached_property
    def paths(self) -> list[np.ndarray]:
        """The numbers of the operations whose results change with what is read, for each of its rows."""
        listed = list[np.ndarray]()
        for seed in range(self.rows - len(self.literals) - len(self.program)):
            changing, path = {seed}, list[int]()
            for number, (code, to, *of) in enumerate(self.program.tolist()):
                if changing.intersection(of[_SMOOTH[code]]):
                    changing.add(to)
                    path.append(number)
            listed.append(np.array(path, np.int64))
        return listed


class _Symbol(NDArrayOperatorsMixin):
    """A row of a tape that is being recorded."""

    def __init__(self, recorder: "_Recorder", row: int) -> None:
        self.recorder, self.row = recorder, row

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        out = options.pop("out", (inputs[0],))
        # `a -= b` gives a new symbol to the name, and changes no other one.
        if method != "__call__" or options or len(out) > 1 or out[0] is not inputs[0]:
            raise _Untraceable(f"they call {ufunc.__name__} in another way than with numbers alone")
        return self.recorder.compute(ufunc, inputs)

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> Any:
        count = _ARGUMENTS.get(function)
        if options or len(inputs) != count:
            raise _Untraceable(f"they call {function.__name__}")
        return self.recorder.compute(function, inputs)

    def __bool__(self) -> bool:
        raise _Untraceable("they decide by a value, with if, and, or, min or max")

    def __array__(self, *_: Any, **__: Any) -> np.ndarray:
        raise _Untraceable("they make an array of a value")

    def astype(self, _: Any) -> "_Symbol":
        """Return the same number: all are floating-point numbers here."""
        return self


class _Recorder:
    """Records operations; what is computed twice is recorded once, and numbers are folded."""

    def __init__(self, layout: "Layout", states: int) -> None:
        self.layout = layout
        self.first_state = len(layout.constant) + len(layout.driven) + 1
        self.inputs = self.first_state + 2 * states
        self.levels = [0] * len(layout.constant) + [1] * (len(layout.driven) + 1) + [2] * 2 * states
        self.known: dict[tuple[int, ...] | float, int] = {}
        self.operations = list[tuple[int, int, int, int, int]]()
        self.literals = dict[int, float]()
        self.tables = list[tuple[np.ndarray, np.ndarray]]()

    def symbol(self, row: int) -> _Symbol:
        return _Symbol(self, row)

    def row_of(self, value: Any) -> int:
        """Return the row of a symbol, or of a number."""
        if isinstance(value, _Symbol):
            return value.row
        if np.ndim(value):
            raise _Untraceable("they compute with an array")
        number = float(value)
        if number not in self.known:
            self.known[number] = self._add(0)
            self.literals[self.known[number]] = number
        return self.known[number]

    def _add(self, level: int) -> int:
        self.levels.append(level)
        return len(self.levels) - 1

    def record(self, code: int, *rows: int) -> _Symbol:
        """Return the result of an operation, which is recorded unless it was before."""
        a, b, c = (*rows, 0, 0)[:3]
        key = code, a, b, c
        if key not in self.known:
            self.known[key] = self._add(max(self.levels[row] for row in rows))
            self.operations.append((code, self.known[key], a, b, c))
        return self.symbol(self.known[key])

    def compute(self, function: Any, inputs: Sequence[Any]) -> Any:
        """Return what a function of numpy gives for symbols and numbers."""
        function = _SAME.get(function, function)
        match function:
            case np.positive:
                return inputs[0]
            case np.square:
                return inputs[0] * inputs[0]
            case np.reciprocal:
                return 1.0 / inputs[0]
            case np.greater:
                return self.compute(np.less, inputs[::-1])
            case np.greater_equal:
                return self.compute(np.less_equal, inputs[::-1])
            case np.degrees | np.rad2deg:
                return inputs[0] * (180 / np.pi)
            case np.radians | np.deg2rad:
                return inputs[0] * (np.pi / 180)
            case np.log10:
                return np.log(inputs[0]) / np.log(10)
            case np.floor_divide:
                return np.floor(inputs[0] / inputs[1])
            case np.hypot:
                return np.sqrt(inputs[0] * inputs[0] + inputs[1] * inputs[1])
            case np.clip:
                return np.minimum(np.maximum(inputs[0], inputs[1]), inputs[2])
            case np.zeros_like:
                return 0.0
            case np.ones_like:
                return 1.0
            case np.interp:
                return self.read_table(*inputs)
        folded = _fold(function, inputs)
        if folded is not None:
            return folded
        if function not in OPERATIONS:
            raise _Untraceable(f"they call {function.__name__}")
        return self.record(OPERATIONS[function], *(self.row_of(each) for each in inputs))

    def read_table(self, x: Any, knots: Any, values: Any) -> _Symbol:
        knots, values = (np.ascontiguousarray(each, dtype=float) for each in (knots, values))
        place = next((place for place, (known, given) in enumerate(self.tables)
                      if np.array_equal(known, knots) and np.array_equal(given, values)), len(self.tables))
        if place == len(self.tables):
            self.tables.append((knots, values))
        return self.record(OPERATIONS[np.interp], self.row_of(x), self.row_of(place))

    def finish(self, results: Sequence[Any]) -> Tape:
        """Return the tape of the operations that results need, in three parts."""
        rows = [self.row_of(each) for each in results]
        needed, used = set(rows), list[tuple[int, int, int, int, int]]()
        for operation in reversed(self.operations):
            if operation[1] in needed:
                used.append(operation)
                needed |= set(operation[2:])
        parts = [[each for each in reversed(used) if self.levels[each[1]] == level] for level in range(3)]
        order = [*range(self.inputs), *(row for row in self.literals if row in needed),
                 *(each[1] for part in parts for each in part)]
        place = {row: number for number, row in enumerate(order)}
        program = np.array([(code, *(place.get(row, 0) for row in of)) for part in parts for code, *of in part],
                           np.int64)
        values = [self.literals[row] for row in order if row in self.literals]
        return Tape(len(self.layout.constant), len(self.layout.driven), np.array(values, float), program.reshape(-1, 5),
                    np.cumsum([len(part) for part in parts], dtype=np.int64),
                    np.array([place[row] for row in rows], np.int64), len(order),
                    tuple(self.tables))


def _fold(function: Any, inputs: Sequence[Any]) -> Any:
    """Return the result of an operation with a number that makes it trivial, or None."""
    first, second = (*inputs, None)[:2]
    left, right = (None if isinstance(each, _Symbol) or np.ndim(each) or each is None else float(each)
                   for each in (first, second))
    match function:
        case np.add | np.subtract if right == 0:
            return first
        case np.add if left == 0:
            return second
        case np.multiply if 0 in (left, right):
            return 0.0
        case np.multiply | np.divide | np.power if right == 1:
            return first
        case np.multiply if left == 1:
            return second
        case np.power if right == 0:
            return 1.0
        case np.power if right is not None and abs(right) in (2, 3):
            power = first * first if abs(right) == 2 else first * first * first
            return power if right > 0 else 1.0 / power
        case np.power if right == -1:
            return 1.0 / first
        case np.power if right in _ROOT:
            return np.sqrt(first) * first ** _ROOT[right]
    return None


@dataclass(frozen=True)
class Layout:
    """The names of the rows of a tape: what is `constant` in a run, and what is `driven` within it; others are 0."""

    constant: tuple[Name, ...]
    driven: tuple[Name, ...]

    @classmethod
    def of(cls, problem: Problem, is_whole: bool = False) -> "Layout":
        """Return the layout of a problem; a whole one has rows of what is 0 as well."""
        constant, driven = list[Name](), list[Name]()
        for name, value in list_values(problem).items():
            if np.ndim(value) and np.shape(value)[-1] > 1:
                driven.append(name)
            elif is_whole or np.ndim(value) or value != 0:
                constant.append(name)
        return cls(tuple(constant), tuple(driven))


def list_values(problem: Problem) -> dict[Name, Any]:
    """Return all values that the equations of a problem read."""
    return {**{("input", name): value for name, value in problem.inputs.items()},
            **{("quantity", name): value for name, value in problem.quantities.items()},
            **{("parameter", name): value for name, value in problem.parameters.items()}}


@dataclass(frozen=True, eq=False)
class _RecordedLaw:
    """A law inside the equations, which is read `at` a value of a table behind those of the functions."""

    kind: Literal["quantity", "input"]
    name: str
    variable: str
    place: int | None
    at: Callable[[Any, Any], Any]


_TAPES: WeakKeyDictionary[System, dict[Any, Tape | str]] = WeakKeyDictionary()


def record_equations(problem: Problem, layout: Layout, what: Literal["rate", "output"],
                     changed: Name | None = None) -> Tape | str:
    """Return the tape of the rates of a problem, or of its outputs, in which a value may be `changed`.

    Where the functions compute what a tape cannot, the reason is returned in words.
    """
    laws = tuple((law.kind, law.name, law.variable, law.place) for law in problem.laws)
    known = _TAPES.setdefault(problem.system, {})
    key = layout, laws, tuple(problem.inputs), what, changed
    if key not in known:
        try:
            known[key] = _record(problem, layout, what, changed)
        except TimeoutError:  # of who has called the functions, and waits no longer
            raise
        except Exception as error:  # numpy will say what is wrong with the functions, if anything is
            known[key] = str(error).replace("'_Symbol' object", "a value")
    return known[key]


def _record(problem: Problem, layout: Layout, what: str, changed: Name | None) -> Tape:
    system, count = problem.system, len(problem.system.states)
    recorder = _Recorder(layout, count)
    rows = {name: row for row, name in enumerate((*layout.constant, *layout.driven))}
    values: dict[str, dict[str, Any]] = {"input": {}, "quantity": {}, "parameter": {}}
    for name in list_values(problem):
        value = recorder.symbol(rows[name]) if name in rows else 0.0
        values[name[0]][name[1]] = value + recorder.symbol(recorder.first_state - 1) if name == changed else value
    x: Any = tuple(recorder.symbol(recorder.first_state + place) for place in range(count))
    sides: dict[int, Any] = {place: recorder.symbol(recorder.first_state + count + place) for place in system.switches}

    def read(place: int, variable: Any, side: Any) -> Any:
        table = recorder.row_of(-1 - place)  # behind those of the functions
        if side is None:
            return recorder.record(OPERATIONS[np.interp], recorder.row_of(variable), table)
        return recorder.record(_BESIDE, recorder.row_of(variable), table, recorder.row_of(side))

    laws: Sequence[Any] = [_RecordedLaw(law.kind, law.name, law.variable, law.place, partial(read, place))
                           for place, law in enumerate(problem.laws)]
    equations, p = Equations(system, laws), Namespace(**values["parameter"])
    evaluate = equations.rates if what == "rate" else equations.read
    return recorder.finish(evaluate(x, values["input"], values["quantity"], p, sides))


def pack(tape: Tape, problem: Problem) -> tuple[Any, ...]:
    """Return a tape of the equations of a problem for the kernels, with the values of its laws."""
    system, states, d = problem.system, tape.constant + tape.driven + 1, len(problem.system.states)
    return (tape.program, tape.ends, *gather_tables(tape, problem.laws), tape.results, tape.literals,
            np.array(system.lowest or [-np.inf] * d, float), np.array(system.switches, np.int64),
            tape.constant, states, states + 2 * d, tape.rows)


def gather_tables(tape: Tape, laws: Sequence[OwnLaw]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return where tables begin (t + 1,), their knots, their values, and the slopes behind each knot.

    Those of laws come last, from the last law backward.
    """
    tables = [*tape.tables, *((law.knots, law.values) for law in reversed(laws))]
    starts = np.cumsum([0, *(len(knots) for knots, _ in tables)], dtype=np.int64)
    knots, values = (np.concatenate([np.zeros(0), *(np.asarray(table[place], float) for table in tables)])
                     for place in range(2))
    widths = np.append(np.diff(knots), 0.0)[:len(knots)]
    slopes = np.where(widths > 0, np.append(np.diff(values), 0.0)[:len(knots)] / np.where(widths > 0, widths, 1.0), 0.0)
    return starts, knots, values, slopes
