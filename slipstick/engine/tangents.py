"""Derivatives along the trajectory of a smooth system: those of the steps of its linearised equations.

Their coefficients are the derivatives of the rates at the begin, middle and end of each step, and these are exact: the
chain rule along the operations of a tape (tangents, or forward mode: Griewank and Walther, Evaluating Derivatives,
2008, chapter 3).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np
from numba import njit

from slipstick.engine.equations import Problem, refine
from slipstick.engine.stepping import evaluate
from slipstick.engine.tape import Layout, Name, Tape, list_values, pack, record_equations

_LANES = 256
"""Instants of a run that are computed together."""


class Tangents:
    """Derivatives along the states `x` (n, d, K) of a problem without surfaces and lowest values, recorded on tapes."""

    def __init__(self, problem: Problem, x: np.ndarray) -> None:
        self.problem, self.x = problem, x
        self.h = np.ascontiguousarray(np.broadcast_to(problem.h, (x.shape[2] - 1,)), dtype=float)

    def with_states(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, d, d) of the steps and (n, o, K, d) of the outputs with the states."""
        n, d, _ = self.x.shape
        (rates, outputs), A = self._usual, np.empty((n, len(self.h), d, d))
        for place in range(d):  # a change of the state, and what the rates make of it
            A[..., place] = self._drive(rates[place]).sum(axis=2)
            A[..., place, place] += 1.0
        return A, np.ascontiguousarray(np.moveaxis(outputs[:d], 0, -1))

    def with_value(self, name: Name, by: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, 2, d) of the steps and (n, o, K) of the outputs with a value."""
        (rates, outputs), names = (self._usual, self._names) if name in self._names else (
            self._of_quantities, self._quantities)
        place = names.index(name)
        return self._drive(rates[place]), outputs[place]

    @cached_property
    def _names(self) -> list[Name | int]:
        """The states, inputs and parameters, with which each fit asks for derivatives."""
        return [*range(self.x.shape[1]), *(name for name in list_values(self.problem) if name[0] != "quantity")]

    @cached_property
    def _quantities(self) -> list[Name | int]:
        return [name for name in list_values(self.problem) if name[0] == "quantity"]

    @cached_property
    def _usual(self) -> tuple[np.ndarray, np.ndarray]:
        return self._differentiate(self._names)

    @cached_property
    def _of_quantities(self) -> tuple[np.ndarray, np.ndarray]:
        return self._differentiate(self._quantities)

    def _differentiate(self, names: Sequence[Name | int]) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives (q, n, d, 2 K - 1) of the rates and (q, n, o, K) of the outputs: all cost little more than
        one."""
        problem, x = self._halved
        return differentiate(problem, "rate", x, names)[1], differentiate(self.problem, "output", self.x, names)[1]

    @cached_property
    def _halved(self) -> tuple[Problem, np.ndarray]:
        """The problem with the begin, middle and end of each step as instants, and the states (n, d, 2 K - 1) there.

        Those in the middle are on the cubic line that has the states and the rates of both ends (Hermite).
        """
        problem, x = self.problem, np.repeat(self.x, 2, axis=2)[:, :, :-1]
        rates, _ = differentiate(problem, "rate", self.x, ())
        x[:, :, 1::2] = 0.5 * (self.x[:, :, 1:] + self.x[:, :, :-1]) - self.h / 8 * np.diff(rates, axis=2)
        inputs, quantities = ({name: refine(value, 2) if np.ndim(value) == 2 and np.shape(value)[1] > 1 else value
                               for name, value in values.items()} for values in (problem.inputs, problem.quantities))
        return replace(problem, h=np.repeat(0.5 * self.h, 2), inputs=inputs, quantities=quantities), x

    @cached_property
    def _W(self) -> np.ndarray:
        """Weights (n, K - 1, 2, d, d) of changes of the rates in the steps."""
        n, d, size = self.x.shape
        W = np.empty((n, size - 1, 2, d, d))
        _weigh_steps(self._usual[0][:d], self.h, W)
        return W

    def _drive(self, g: np.ndarray) -> np.ndarray:
        """Return the derivatives (n, K - 1, 2, d) of the steps with what changes the rates by g (n, d, 2 K - 1)."""
        n, d, size = self.x.shape
        B = np.empty((n, size - 1, 2, d))
        _drive(self._W, g, self.h, B)
        return B


@njit(nogil=True, cache=True, error_model="numpy")
def _weigh_steps(F, h, W):  # type: ignore[no-untyped-def]
    """Fill W (n, K - 1, 2, d, d) with the weights by which Runge-Kutta steps h (K - 1,) have changes of the rates.

    F (d, n, d, 2 K - 1) are the coefficients of each state at the begin, middle and end of the steps. The first weights
    are those of a change at the begin, the second those of half a change in the middle.
    """
    n, d = F.shape[1:3]
    middle, last, once, twice = np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    for i in range(n):
        for j in range(len(h)):
            for a in range(d):
                for b in range(d):
                    middle[a, b], last[a, b] = 0.5 * h[j] * F[b, i, a, 2 * j + 1], h[j] * F[b, i, a, 2 * j + 2]
            for a in range(d):
                for b in range(d):
                    once[a, b], twice[a, b] = 0.0, 0.0
                    for c in range(d):
                        once[a, b] += last[a, c] * middle[c, b]
                        twice[a, b] += middle[a, c] * middle[c, b]
            for a in range(d):
                for b in range(d):
                    begin, both = 2 * (middle[a, b] + twice[a, b]), 2 * middle[a, b] + last[a, b] + once[a, b]
                    for c in range(d):
                        begin += last[a, c] * twice[c, b]
                    W[i, j, 0, a, b] = h[j] / 6 * (begin + (1.0 if a == b else 0.0))
                    W[i, j, 1, a, b] = h[j] / 6 * (both + (4.0 if a == b else 0.0))


@njit(nogil=True, cache=True, error_model="numpy")
def _drive(W, g, h, B):  # type: ignore[no-untyped-def]
    """Fill B (n, K - 1, 2, d) with what steps make of a change of the rates by g (n, d, 2 K - 1) that falls from 1 to 0
    over each step, and of one that rises to 1."""
    n, d, _ = g.shape
    for i in range(n):
        for j in range(len(h)):
            for a in range(d):
                begin, middle = 0.0, 0.0
                for b in range(d):
                    begin += W[i, j, 0, a, b] * g[i, b, 2 * j]
                    middle += W[i, j, 1, a, b] * (0.5 * g[i, b, 2 * j + 1])
                B[i, j, 0, a], B[i, j, 1, a] = begin + middle, middle + h[j] / 6 * g[i, a, 2 * j + 2]


def differentiate(problem: Problem, what: Literal["rate", "output"], x: np.ndarray,
                  names: Sequence[Name | int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates or outputs (n, r, K) of a problem at states (n, d, K), and their derivatives (q, n, r, K).

    These are with values, by their names, or with states, by their places. The system has no surfaces.
    """
    known, (n, size) = list_values(problem), problem.shape
    layout = Layout.of(problem, is_whole=True)
    tape = record_equations(problem, layout, what)
    assert isinstance(tape, Tape)  # as those that are stepped
    P, V = np.empty((len(layout.constant), n)), np.empty((len(layout.driven), n, size))
    for row, name in enumerate(layout.constant):
        P[row] = np.reshape(known[name], -1)
    for row, name in enumerate(layout.driven):
        V[row] = known[name]
    rows = {name: row for row, name in enumerate((*layout.constant, *layout.driven))}
    first = len(rows) + 1
    seeds = np.array([first + name if isinstance(name, int) else rows[name] for name in names], np.int64)
    paths = [tape.paths[seed] for seed in seeds.tolist()]
    starts = np.cumsum([0, *(len(path) for path in paths)], dtype=np.int64)
    values, out = np.empty((n, len(tape.results), size)), np.empty((len(seeds), n, len(tape.results), size))
    _differentiate(pack(tape, problem), np.concatenate([np.zeros(0, np.int64), *paths]), starts, seeds, P, V,
                   np.ascontiguousarray(x), values, out)
    return values, out


@njit(nogil=True, cache=True, error_model="numpy")
def _differentiate(tape, paths, starts, seeds, P, V, X, values, out):  # type: ignore[no-untyped-def]
    program, results, literals = tape[0], tape[6], tape[7]
    states, first_literal = tape[11], tape[12]
    R, T = np.empty((tape[13], _LANES)), np.zeros((tape[13], _LANES))
    n, d, size = X.shape
    for i in range(n):
        for row in range(len(P)):
            R[row] = P[row, i]
        for row in range(len(literals)):
            R[first_literal + row] = literals[row]
        for begin in range(0, size, _LANES):
            count = min(_LANES, size - begin)
            for row in range(len(V)):
                for g in range(count):
                    R[len(P) + row, g] = V[row, i, begin + g]
            for state in range(d):
                for g in range(count):
                    R[states + state, g] = X[i, state, begin + g]
            evaluate(tape, 0 * count, tape[1][2], R, count)
            for result in range(len(results)):
                for g in range(count):
                    values[i, result, begin + g] = R[results[result], g]
            for q in range(len(seeds)):
                T[seeds[q]] = 1.0
                for place in range(starts[q], starts[q + 1]):
                    _differentiate_operation(program[paths[place]], tape, R, T, count)
                for result in range(len(results)):
                    for g in range(count):
                        out[q, i, result, begin + g] = T[results[result], g]
                T[seeds[q]] = 0.0
                for place in range(starts[q], starts[q + 1]):
                    T[program[paths[place], 1]] = 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _differentiate_operation(operation, tape, R, T, count):  # type: ignore[no-untyped-def]
    """Fill T (rows, lanes) with the derivative of the result of an operation, from R and those of its arguments."""
    code, to, a, b, c = operation
    if code == 0:  # add
        for g in range(count):
            T[to, g] = T[a, g] + T[b, g]
    elif code == 1:  # subtract
        for g in range(count):
            T[to, g] = T[a, g] - T[b, g]
    elif code == 2:  # multiply
        for g in range(count):
            T[to, g] = T[a, g] * R[b, g] + R[a, g] * T[b, g]
    elif code == 3:  # divide
        for g in range(count):
            T[to, g] = (T[a, g] - R[to, g] * T[b, g]) / R[b, g]
    elif code == 4:  # negative
        for g in range(count):
            T[to, g] = -T[a, g]
    elif code == 5:  # maximum
        for g in range(count):
            T[to, g] = T[a, g] if R[a, g] > R[b, g] or (R[a, g] == R[b, g] and T[a, g] > T[b, g]) else T[b, g]
    elif code == 6:  # minimum
        for g in range(count):
            T[to, g] = T[a, g] if R[a, g] < R[b, g] or (R[a, g] == R[b, g] and T[a, g] < T[b, g]) else T[b, g]
    elif code == 7:  # sqrt
        for g in range(count):
            T[to, g] = 0.5 * T[a, g] / R[to, g] if R[to, g] > 0 else 0.0
    elif code == 8:  # power
        for g in range(count):
            T[to, g] = 0.0
            if T[a, g] != 0.0 and R[a, g] != 0.0:
                T[to, g] += R[b, g] * R[to, g] / R[a, g] * T[a, g]
            if T[b, g] != 0.0 and R[a, g] > 0.0:
                T[to, g] += R[to, g] * np.log(R[a, g]) * T[b, g]
    elif code == 9:  # exp
        for g in range(count):
            T[to, g] = R[to, g] * T[a, g]
    elif code == 10:  # log
        for g in range(count):
            T[to, g] = T[a, g] / R[a, g]
    elif code == 11:  # absolute
        for g in range(count):
            T[to, g] = T[a, g] if R[a, g] > 0 else -T[a, g] if R[a, g] < 0 else abs(T[a, g])
    elif code == 13:  # sin
        for g in range(count):
            T[to, g] = np.cos(R[a, g]) * T[a, g]
    elif code == 14:  # cos
        for g in range(count):
            T[to, g] = -np.sin(R[a, g]) * T[a, g]
    elif code == 15:  # tan
        for g in range(count):
            T[to, g] = (1 + R[to, g] ** 2) * T[a, g]
    elif code == 16:  # tanh
        for g in range(count):
            T[to, g] = (1 - R[to, g] ** 2) * T[a, g]
    elif code == 17:  # arctan
        for g in range(count):
            T[to, g] = T[a, g] / (1 + R[a, g] ** 2)
    elif code == 18:  # arctan2
        for g in range(count):
            T[to, g] = (R[b, g] * T[a, g] - R[a, g] * T[b, g]) / (R[a, g] ** 2 + R[b, g] ** 2)
    elif code == 19:  # sinh
        for g in range(count):
            T[to, g] = np.cosh(R[a, g]) * T[a, g]
    elif code == 20:  # cosh
        for g in range(count):
            T[to, g] = np.sinh(R[a, g]) * T[a, g]
    elif code == 21:  # arcsin
        for g in range(count):
            T[to, g] = T[a, g] / np.sqrt(1 - R[a, g] ** 2)
    elif code == 22:  # arccos
        for g in range(count):
            T[to, g] = -T[a, g] / np.sqrt(1 - R[a, g] ** 2)
    elif code == 24:  # remainder
        for g in range(count):
            T[to, g] = T[a, g] - np.floor(R[a, g] / R[b, g]) * T[b, g]
    elif code == 32:  # where
        for g in range(count):
            T[to, g] = T[b, g] if R[a, g] != 0 else T[c, g]
    else:  # a table, at 33; where it bends, the slope behind
        starts, knots, slopes = tape[2], tape[3], tape[5]
        table = int(R[b, 0])
        if table < 0:
            table += len(starts) - 1
        begin, end = starts[table], starts[table + 1] - 1
        for g in range(count):
            x, low, cells = R[a, g], begin, end - begin
            while cells > 1:
                half = cells // 2
                low += half if knots[low + half] <= x else 0
                cells -= half
            T[to, g] = slopes[low] * T[a, g] if knots[begin] <= x < knots[end] else 0.0
