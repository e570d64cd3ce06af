"""Trajectories of a system on a grid of instants, and their linear response to changes.

A Runge-Kutta step maps the states at an instant to those at the next one, with inputs and quantities linear in between:

    x_{j+1} = step(x_j, u_j, u_{j+1}, q_j, q_{j+1}, p)

A trajectory solves these equations for all j. They are solved by Newton's method for all instants and runs at once: the
step and its derivatives are evaluated as arrays, and only the linear recurrence of the correction is sequential. Runs
in which it does not converge are integrated step by step.

All parameters, laws and errors are changes of quantities, inputs or parameters, so that every column of a linear model
is one linear response along the trajectory, from numerical derivatives of the step.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit

from slipstick.engine.equations import Equations, Problem, cut, ends
from slipstick.machine.declaration import Namespace
from slipstick.machine.system import States, Values

DIFFERENCE = 1e-6
"""Step of numerical derivatives, over the size of what is changed."""
_NEWTON, _CONVERGED = 10, 1e-6
"""Most Newton steps, and the largest defect over the size of the states before the last one."""
_TOGETHER = 20_000
"""Samples that are evaluated at once: the arrays of a Runge-Kutta step then stay in the cache."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States `x` (n, d, K) of a problem, its `outputs` (n, o, K), and the derivatives `A` (n, K - 1, d, d) of the
    steps.
    """

    problem: Problem
    x: np.ndarray
    outputs: np.ndarray
    A: np.ndarray
    C: np.ndarray
    _known: dict[tuple[str, str], "Direction"] = field(default_factory=dict)

    def direction(self, kind: str, name: str, size: float) -> "Direction":
        """Return the derivatives with a quantity, an input or a parameter (the `kind`) of typical `size`."""
        key = kind, name
        if key not in self._known:
            self._known[key] = _differentiate(self, kind, name, size)
        return self._known[key]

    @cached_property
    def following(self) -> np.ndarray:
        """The states (n, d, K - 1) that the steps lead to: those of the next instants, but for the tolerance."""
        n, d, size = self.x.shape
        out = np.empty((n, d, size - 1))
        for rows in _parts(n, size):
            part = self.problem.take(rows)
            equations, p = part.equations
            states = tuple(self.x[rows, place, :-1] for place in range(d))
            for place, state in enumerate(equations.advance(states, ends(part.inputs), ends(part.quantities), p,
                                                            part.h)):
                out[rows, place] = state
        return out

    def respond(self, direction: "Direction", basis: np.ndarray) -> np.ndarray:
        """Return the changes (n, m, o, K) of the outputs with coefficients of a basis (n, m, K) of a change."""
        n, m, size = basis.shape
        out = np.empty((n, m, self.outputs.shape[1], size))
        respond(self.A, direction.B, self.C, direction.D, direction.S, np.ascontiguousarray(basis, dtype=float), out)
        return out


@dataclass(frozen=True, eq=False)
class Direction:
    """Derivatives with a change that is linear over each step, between its values at both ends.

    `B` (n, K - 1, 2, d) are those of the steps, `D` (n, o, K) of the outputs, `S` (n, d) of the start.
    """

    B: np.ndarray
    D: np.ndarray
    S: np.ndarray


def solve(problem: Problem, guess: np.ndarray | None = None) -> Trajectory:
    """Solve a problem from a `guess` (n, d, K) of its states, or without one from their begin."""
    n, size = problem.shape
    d, o = len(problem.system.states), len(problem.system.signals)
    x, y = np.empty((n, d, size)), np.empty((n, o, size))
    A, C = np.empty((n, size - 1, d, d)), np.empty((n, o, size, d))
    if guess is None:
        guess = _hold_start(problem)
    x[:] = guess
    if d:
        unsolved = np.concatenate([rows.start + _solve_part(problem.take(rows), x[rows], A[rows], size)
                                   for rows in _parts(n, size)])
        if len(unsolved):  # all at once: a step takes as long for many runs as for one
            left = problem.take(unsolved)
            x[unsolved] = integrate(left, (len(unsolved), size))
            A[unsolved] = _differentiate_states(left, x[unsolved])
    scales = _scales(x)
    for rows in _parts(n, size):
        part = problem.take(rows)
        equations, p = part.equations
        states = tuple(x[rows, place] for place in range(d))
        here = equations.outputs(states, part.inputs, part.quantities, p)
        for place, output in enumerate(here):
            y[rows, place] = output
        for state in range(d):
            by = DIFFERENCE * scales[state]
            moved = tuple(values + by if place == state else values for place, values in enumerate(states))
            for place, output in enumerate(equations.outputs(moved, part.inputs, part.quantities, p)):
                C[rows, place, :, state] = (output - here[place]) / by
    return Trajectory(problem, x, y, A, C)


def _hold_start(problem: Problem) -> np.ndarray:
    """Return the states (n, d, K) at the begin of each run, held."""
    n, size = problem.shape
    equations, p = problem.equations
    start = equations.start(cut(problem.inputs, slice(0, 1)), cut(problem.quantities, slice(0, 1)), p, (n, 1))
    held = np.array([np.broadcast_to(state, (n, size)) for state in start])
    return np.ascontiguousarray(held.reshape(len(start), n, size).transpose(1, 0, 2))


def _scales(x: np.ndarray) -> np.ndarray:
    """Return the magnitude (d,) of states (n, d, K), that of most runs; 1 for a state that is 0."""
    if not x.size:
        return np.ones(x.shape[1])
    magnitude = np.median(np.where(np.isfinite(x), np.abs(x), 0.0).max(axis=2), axis=0)
    return np.where(magnitude > 0, magnitude, 1.0)


def _parts(n: int, size: int) -> list[slice]:
    together = max(1, _TOGETHER // size)
    return [slice(first, min(n, first + together)) for first in range(0, n, together)]


def _solve_part(problem: Problem, x: np.ndarray, A: np.ndarray, size: int) -> np.ndarray:
    """Improve the states x (n, d, K) of some runs in place, fill A, and return the places of runs that are unsolved.

    Runs are left alone as soon as their trajectories are solved. A step by Newton's method is exact up to the first
    instant at which a slope jumps between iterate and solution, so that some runs need as many steps as there are such
    instants.
    """
    left = np.arange(len(x))
    for _ in range(_NEWTON):
        x[left], A[left], off = _improve(problem if len(left) == len(x) else problem.take(left), x[left], size)
        left = left[~(off <= _CONVERGED)]
        if not len(left):
            break
    return left


def _improve(problem: Problem, x: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the states after a step of Newton's method, the derivatives, and the largest defects (n,) before it."""
    (equations, p), scales = problem.equations, _scales(x)
    u, q = ends(problem.inputs), ends(problem.quantities)
    start = equations.start(cut(problem.inputs, slice(0, 1)), cut(problem.quantities, slice(0, 1)), p, (len(x), 1))
    defect, correction = (np.empty((len(x), size, x.shape[1])) for _ in range(2))
    states = tuple(x[:, place, :-1] for place in range(x.shape[1]))
    following = equations.advance(states, u, q, p, problem.h)
    for place, state in enumerate(following):
        defect[:, 1:, place] = state - x[:, place, 1:]
        defect[:, :1, place] = start[place] - x[:, place, :1]
    A = _fill_derivatives(equations, states, following, u, q, p, problem.h, scales)
    accumulate(A, defect, correction)
    better = x + correction.transpose(0, 2, 1)
    for place, low in enumerate(problem.system.lowest):
        np.maximum(better[:, place], low, out=better[:, place])
    return better, A, np.abs(defect / scales).max(axis=(1, 2))


def integrate(problem: Problem, shape: tuple[int, int]) -> np.ndarray:
    """Return the states (n, d, K) of a problem, integrated step by step for all runs at once."""
    n, size = shape
    equations = Equations(problem.system, problem.laws)
    p = Namespace(**{name: np.broadcast_to(np.reshape(value, -1), (n,)) for name, value in problem.parameters.items()})

    def columns(values: Values) -> dict[str, Any]:
        return {name: np.ascontiguousarray(np.broadcast_to(value, (n, size)).T) if np.ndim(value) else value
                for name, value in values.items()}

    def at(values: Values, j: int) -> dict[str, Any]:
        return {name: value[j] if np.ndim(value) else value for name, value in values.items()}

    u, q, x = columns(problem.inputs), columns(problem.quantities), np.empty((size, len(problem.system.states), n))
    steps = np.broadcast_to(problem.h, (size - 1,))
    states = equations.start(at(u, 0), at(q, 0), p, (n,))
    u_here, q_here = at(u, 0), at(q, 0)
    for j in range(size):
        for place, state in enumerate(states):
            x[j, place] = state
        if j + 1 < size:
            u_next, q_next = at(u, j + 1), at(q, j + 1)
            states = equations.advance(states, (u_here, u_next), (q_here, q_next), p, steps[j])
            u_here, q_here = u_next, q_next
    return np.ascontiguousarray(x.transpose(2, 1, 0))


def _differentiate_states(problem: Problem, x: np.ndarray) -> np.ndarray:
    """Return A (n, K - 1, d, d) about states (n, d, K)."""
    equations, p = problem.equations
    u, q = ends(problem.inputs), ends(problem.quantities)
    before = tuple(x[:, place, :-1] for place in range(x.shape[1]))
    following = equations.advance(before, u, q, p, problem.h)
    return _fill_derivatives(equations, before, following, u, q, p, problem.h, _scales(x))


def _fill_derivatives(equations: Equations, states: States, following: States, u: tuple[Values, Values],
                      q: tuple[Values, Values], p: Namespace, h: Any, scales: np.ndarray) -> np.ndarray:
    A = np.empty((*np.shape(following[0]), len(scales), len(scales)))
    for place, scale in enumerate(scales):
        by = DIFFERENCE * scale
        moved = tuple(state + by if other == place else state for other, state in enumerate(states))
        for other, state in enumerate(equations.advance(moved, u, q, p, h)):
            A[:, :, other, place] = (state - following[other]) / by
    return A


def _differentiate(trajectory: Trajectory, kind: str, name: str, size: float) -> Direction:
    """Return the derivatives with a change; that of a parameter is the same at both ends of a step."""
    problem, by = trajectory.problem, DIFFERENCE * size
    (n, d, instants), o = trajectory.x.shape, trajectory.outputs.shape[1]
    B, D, S = np.zeros((n, instants - 1, 2, d)), np.empty((n, o, instants)), np.zeros((n, d))
    first = slice(0, 1)

    def changed(values: Values) -> dict[str, Any]:
        return {**values, name: values[name] + by}

    for rows in _parts(n, instants):
        part = problem.take(rows)
        equations, p = part.equations
        u, q = part.inputs, part.quantities
        moved_u = changed(u) if kind == "input" else u
        moved_q = changed(q) if kind == "quantity" else q
        moved_p = Namespace(**changed(part.parameters)) if kind == "parameter" else p
        states = tuple(trajectory.x[rows, place] for place in range(d))
        for place, output in enumerate(equations.outputs(states, moved_u, moved_q, moved_p)):
            D[rows, place] = (output - trajectory.outputs[rows, place]) / by
        if not d:
            continue
        before, count = tuple(state[:, :-1] for state in states), len(D[rows])
        u_ends, q_ends, moved_u_ends, moved_q_ends = ends(u), ends(q), ends(moved_u), ends(moved_q)
        for end in range(1 if kind == "parameter" else 2):
            u_pair = (moved_u_ends[0], u_ends[1]) if end == 0 else (u_ends[0], moved_u_ends[1])
            q_pair = (moved_q_ends[0], q_ends[1]) if end == 0 else (q_ends[0], moved_q_ends[1])
            for place, state in enumerate(equations.advance(before, u_pair, q_pair, moved_p, part.h)):
                B[rows, :, end, place] = (state - trajectory.following[rows, place]) / by
        begin = equations.start(cut(u, first), cut(q, first), p, (count, 1))
        moved_begin = equations.start(cut(moved_u, first), cut(moved_q, first), moved_p, (count, 1))
        for place in range(d):
            S[rows, place] = (moved_begin[place][:, 0] - begin[place][:, 0]) / by
    return Direction(B, D, S)


@njit(nogil=True, cache=True, error_model="numpy")
def accumulate(A, defect, out):  # type: ignore[no-untyped-def]
    """Fill out (n, K, d) with the solution of out_{j+1} = A_j out_j + defect_{j+1}, out_0 = defect_0."""
    n, size, d = defect.shape
    for i in range(n):
        for a in range(d):
            out[i, 0, a] = defect[i, 0, a]
        for j in range(size - 1):
            for a in range(d):
                total = defect[i, j + 1, a]
                for b in range(d):
                    total += A[i, j, a, b] * out[i, j, b]
                out[i, j + 1, a] = total


_LANES = 8
"""Columns that are integrated together: each step waits for the one before, and those of other columns do not."""


@njit(nogil=True, cache=True, error_model="numpy")
def respond(A, B, C, D, S, basis, out):  # type: ignore[no-untyped-def]
    """Fill out (n, m, o, K) with the changes of the outputs along coefficients of a basis (n, m, K)."""
    n, m, size = basis.shape
    d, outputs = A.shape[2], out.shape[2]
    v, w = np.empty((d, _LANES)), np.empty((d, _LANES))
    for i in range(n):
        for first in range(0, m, _LANES):
            count = min(_LANES, m - first)
            for a in range(d):
                for g in range(count):
                    v[a, g] = S[i, a] * basis[i, first + g, 0]
            for j in range(size):
                for o in range(outputs):
                    for g in range(count):
                        total = D[i, o, j] * basis[i, first + g, j]
                        for b in range(d):
                            total += C[i, o, j, b] * v[b, g]
                        out[i, first + g, o, j] = total
                if j + 1 == size:
                    break
                for a in range(d):
                    before, after = B[i, j, 0, a], B[i, j, 1, a]
                    for g in range(count):
                        total = before * basis[i, first + g, j] + after * basis[i, first + g, j + 1]
                        for b in range(d):
                            total += A[i, j, a, b] * v[b, g]
                        w[a, g] = total
                v[:] = w
