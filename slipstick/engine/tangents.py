"""Derivatives along the trajectory of a smooth system: those of the steps of its linearised equations.

Their coefficients are the derivatives of the rates at the begin, middle and end of each step, and these are exact: the
chain rule along the operations of a tape (tangents, or forward mode: Griewank and Walther, Evaluating Derivatives,
2008, chapter 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Literal

import numpy as np
from numba import njit

from slipstick.engine import equations, stepping
from slipstick.engine.equations import Problem
from slipstick.engine.stepping import evaluate, fill_constants
from slipstick.engine.tape import Layout, Name, Tape, list_values, pack, record_equations
from slipstick.numerics import linking, wide_vectors
from slipstick.numerics.linking import digest_files, linked, with_key

_LANES = 256
"""Instants of a run that are computed together."""
_KEY = digest_files(Path(str(module.__file__)) for module in (stepping, equations, linking, wide_vectors))
"""Of the files from which `_differentiate` links functions and constants."""


@dataclass(frozen=True, eq=False)
class _Derivatives:
    """Derivatives with q values: of the rates at the `ends` (q, n, d, K) of steps and in their `middles` (q, n, d,
    K - 1), and of the `outputs` (q, n, o, K)."""

    ends: np.ndarray
    middles: np.ndarray
    outputs: np.ndarray


class Tangents:
    """Derivatives along the states `x` (n, d, K) of a recorded problem without surfaces, above their lowest values."""

    def __init__(self, problem: Problem, x: np.ndarray) -> None:
        self.problem, self.x = problem, np.ascontiguousarray(x)
        self.h = np.full(x.shape[2] - 1, problem.h, dtype=float)
        values, (n, size) = list_values(problem), problem.shape
        self.parameters, self.quantities, self.inputs = (
            [name for name in values if name[0] == kind] for kind in ("parameter", "quantity", "input"))
        self.layout = Layout.of(problem, is_whole=True)
        self.P = np.empty((len(self.layout.constant), n))
        self.V = np.empty((len(self.layout.driven), n, size))
        for row, name in enumerate(self.layout.constant):
            self.P[row] = np.reshape(values[name], -1)
        for row, name in enumerate(self.layout.driven):
            self.V[row] = values[name]

    def with_states(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, d, d) of the steps and (n, o, K, d) of the outputs with the states."""
        return self._steps[0], np.ascontiguousarray(np.moveaxis(self._usual.outputs[:self.x.shape[1]], 0, -1))

    def with_value(self, name: Name, by: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, 3, d) of the steps and (n, o, K) of the outputs with a value."""
        n, d, size = self.x.shape
        if name[0] == "quantity":
            place, known = self.quantities.index(name), self._of_quantities
        else:
            place, known = d + [*self.parameters, *self.inputs].index(name), self._usual
        B = np.empty((n, size - 1, 3, d))
        _drive(self._steps[1], known.ends[place], known.middles[place], self.h, B)
        return B, known.outputs[place]

    @cached_property
    def constants(self) -> tuple[dict[Name, np.ndarray], np.ndarray]:
        """The responses of the outputs (n, o, K) to a change of each parameter by 1, and (d, n, o, K) to that of each
        state at the begin."""
        d = self.x.shape[1]
        (A, W), C, known = self._steps, self.with_states()[1], self._usual
        last = d + len(self.parameters)
        n, o, size, _ = C.shape
        out = np.empty((last, n, o, size))
        _respond_to_constants(A, W, C, known.ends[d:last], known.middles[d:last], known.outputs[d:last], self.h, out)
        return dict(zip(self.parameters, out[d:], strict=True)), out[:d]

    @cached_property
    def _usual(self) -> _Derivatives:
        """Derivatives with states, parameters and inputs, for which each fit asks: all cost little more than one."""
        return self._differentiate([*range(self.x.shape[1]), *self.parameters, *self.inputs])

    @cached_property
    def _of_quantities(self) -> _Derivatives:
        return self._differentiate(self.quantities)

    def _differentiate(self, names: Sequence[Name | int]) -> _Derivatives:
        return _Derivatives(*self.differentiate("rate", names), self.differentiate("output", names)[0])

    def differentiate(self, what: Literal["rate", "output"],
                      names: Sequence[Name | int]) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (q, n, r, K) of the rates or outputs, and those (q, n, r, K - 1) of the rates in the
        middle of each step, at states on the cubic line with the rates of both ends (Hermite).

        These are with values, by their names, or with states, by their places.
        """
        tape = record_equations(self.problem, self.layout, what)
        assert isinstance(tape, Tape)  # as those that are stepped
        rows = {name: row for row, name in enumerate((*self.layout.constant, *self.layout.driven))}
        first = len(rows) + 1
        seeds = np.array([first + name if isinstance(name, int) else rows[name] for name in names], np.int64)
        paths = [tape.paths[seed] for seed in seeds.tolist()]
        starts = np.cumsum([0, *(len(path) for path in paths)], dtype=np.int64)
        shape, h = (len(seeds), len(self.x), len(tape.results)), self.h if what == "rate" else self.h[:0]
        ends, middles = np.empty((*shape, self.x.shape[2])), np.empty((*shape, len(h)))
        if tape.results.size:
            _differentiate(pack(tape, self.problem), np.concatenate([np.zeros(0, np.int64), *paths]), starts, seeds,
                           self.P, self.V, self.x, h, ends, middles)
        return ends, middles

    @cached_property
    def _steps(self) -> tuple[np.ndarray, np.ndarray]:
        """The derivatives (n, K - 1, d, d) of the steps with the states, and the weights (n, K - 1, 2, d, d) by which
        they have changes of the rates."""
        n, d, size = self.x.shape
        A, W = np.empty((n, size - 1, d, d)), np.empty((n, size - 1, 2, d, d))
        _weigh_steps(self._usual.ends[:d], self._usual.middles[:d], self.h, A, W)
        return A, W


@njit(nogil=True, cache=True, error_model="numpy")
def _weigh_steps(ends, middles, h, A, W):  # type: ignore[no-untyped-def]
    """Fill A (n, K - 1, d, d) with the derivatives of Runge-Kutta steps h (K - 1,) of linear equations with the states,
    and W (n, K - 1, 2, d, d) with the weights by which they have changes of the rates.

    The coefficients of each state are those at the `ends` (d, n, d, K) and in the `middles` (d, n, d, K - 1) of steps.
    The first weights are those of a change at the begin, the second those of half a change in the middle.
    """
    n, d = ends.shape[1:3]
    middle, last, once, twice = np.empty((d, d)), np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    for i in range(n):
        for j in range(len(h)):
            for a in range(d):
                for b in range(d):
                    middle[a, b], last[a, b] = 0.5 * h[j] * middles[b, i, a, j], h[j] * ends[b, i, a, j + 1]
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
            for a in range(d):
                for b in range(d):
                    total = (1.0 if a == b else 0.0) + last[a, b] / 6
                    for c in range(d):
                        total += W[i, j, 0, a, c] * ends[b, i, c, j] + W[i, j, 1, a, c] * middles[b, i, c, j]
                    A[i, j, a, b] = total


@njit(nogil=True, cache=True, error_model="numpy")
def _drive(W, ends, middles, h, B):  # type: ignore[no-untyped-def]
    """Fill B (n, K - 1, 3, d) with what steps make of a change that falls from 1 to 0 over each step, of one that rises
    to 1, and of one that is 1 in the middle alone: it changes the rates at the `ends` (n, d, K) and in the `middles`
    (n, d, K - 1) so much."""
    n, d, _ = ends.shape
    for i in range(n):
        for j in range(len(h)):
            for a in range(d):
                begin, middle = 0.0, 0.0
                for b in range(d):
                    begin += W[i, j, 0, a, b] * ends[i, b, j]
                    middle += W[i, j, 1, a, b] * (0.5 * middles[i, b, j])
                B[i, j, 0, a], B[i, j, 1, a] = begin + middle, middle + h[j] / 6 * ends[i, a, j + 1]
                B[i, j, 2, a] = 2 * middle


@njit(nogil=True, cache=True, error_model="numpy")
def _respond_to_constants(A, W, C, ends, middles, outputs, h, out):  # type: ignore[no-untyped-def]
    """Fill out (d + q, n, o, K) with the changes of the outputs with each state at the begin, and with q values.

    These change the rates at the `ends` (q, n, d, K) and in the `middles` (q, n, d, K - 1) of steps h (K - 1,), and the
    `outputs` (q, n, o, K).
    """
    q, (n, o, size, d) = len(ends), C.shape
    v, w, read = np.zeros((d, d + q)), np.empty((d, d + q)), np.empty(d + q)
    here, half, there = np.zeros((d, d + q)), np.zeros((d, d + q)), np.zeros((d, d + q))
    for i in range(n):
        v[:] = 0.0
        for a in range(d):
            v[a, a] = 1.0
            for g in range(q):
                here[a, d + g] = ends[g, i, a, 0]
        for j in range(size):
            for output in range(o):
                for g in range(d + q):
                    read[g] = outputs[g - d, i, output, j] if g >= d else 0.0
                for b in range(d):
                    for g in range(d + q):
                        read[g] += C[i, output, j, b] * v[b, g]
                for g in range(d + q):
                    out[g, i, output, j] = read[g]
            if j + 1 == size:
                break
            for a in range(d):
                for g in range(q):
                    half[a, d + g], there[a, d + g] = middles[g, i, a, j], ends[g, i, a, j + 1]
            for a in range(d):
                for g in range(d + q):
                    w[a, g] = h[j] / 6 * there[a, g]
                for b in range(d):
                    step, first, second = A[i, j, a, b], W[i, j, 0, a, b], W[i, j, 1, a, b]
                    for g in range(d + q):
                        w[a, g] += step * v[b, g] + first * here[b, g] + second * half[b, g]
            v, w = w, v
            here, there = there, here


@njit(nogil=True, cache=True, error_model="numpy")
@partial(with_key, _KEY)
def _differentiate(tape, paths, starts, seeds, P, V, X, h, ends, middles):  # type: ignore[no-untyped-def]
    """Fill the derivatives at the `ends` of steps h, and in their `middles` unless there are no steps."""
    results, states = tape[6], tape[11]
    R, T, rates = np.empty((tape[13], _LANES)), np.zeros((tape[13], _LANES)), np.empty((len(results), _LANES))
    n, d, size = X.shape
    for i in range(n):
        fill_constants(tape, P, i, min(1, n), R.shape[1], R)
        for begin in range(0, size, _LANES - 1 if len(h) else _LANES):
            count = min(_LANES, size - begin)
            for row in range(len(V)):
                for g in range(count):
                    R[len(P) + row, g] = V[row, i, begin + g]
            for state in range(d):
                for g in range(count):
                    R[states + state, g] = X[i, state, begin + g]
            evaluate(tape, tape[1][0], tape[1][2], R, count)
            _follow_paths(tape, paths, starts, seeds, R, T, i, begin, count, ends)
            if len(h) == 0 or count == 1:
                continue
            for state in range(d):
                for g in range(count):
                    rates[state, g] = R[results[state], g]
            for row in range(len(V)):
                for g in range(count - 1):
                    R[len(P) + row, g] = 0.5 * (V[row, i, begin + g] + V[row, i, begin + g + 1])
            for state in range(d):
                for g in range(count - 1):
                    R[states + state, g] = (0.5 * (X[i, state, begin + g] + X[i, state, begin + g + 1])
                                            - h[begin + g] / 8 * (rates[state, g + 1] - rates[state, g]))
            evaluate(tape, tape[1][0], tape[1][2], R, count - 1)
            _follow_paths(tape, paths, starts, seeds, R, T, i, begin, count - 1, middles)


@linked
def _follow_paths(tape, paths, starts, seeds, R, T, i, begin, count, out):  # type: ignore[no-untyped-def]
    """Fill out (q, n, r, K) at some instants of a run with the derivatives of the results, by those in T (rows,
    lanes)."""
    program, results = tape[0], tape[6]
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


@linked
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
