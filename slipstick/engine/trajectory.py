"""Trajectories of a system on a grid of instants, and their linear response to changes.

A Runge-Kutta step maps the states at an instant to those at the next one, with inputs and quantities linear in between:

    x_{j+1} = step(x_j, u_j, u_{j+1}, q_j, q_{j+1}, p)

All parameters, laws and errors are changes of quantities, inputs or parameters, so that every column of a linear model
is one linear response along the trajectory. Its derivatives are exact (tangents.py), but where a system has surfaces,
or a state is at its lowest value: it meets these anywhere within a step, so that the step itself is differentiated.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numba import njit

from slipstick.engine.equations import Equations, Problem, cut, ends, halve
from slipstick.engine.stepping import follow, read_all, step_all
from slipstick.engine.tangents import Tangents
from slipstick.engine.tape import EQUATIONS, Kind, Layout, Name, Tape, list_values, pack, record_equations
from slipstick.machine.declaration import Namespace
from slipstick.machine.system import Values

DIFFERENCE = 1e-6
"""Step of numerical derivatives, over the size of what is changed."""


@dataclass(frozen=True)
class _Change:
    """A change of a value `by` (2,), at the begin and at the end of each step."""

    name: Name
    by: tuple[float, float]


class _Stepper(Protocol):
    """What evaluates the equations of a problem, with states shifted by (d,) or with a value changed."""

    def follow(self, start: np.ndarray) -> np.ndarray:
        """Return the states (n, d, K) from those at the start (n, d) on."""

    def step(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        """Return what a step makes (n, d, K - 1) of states (n, d, K)."""

    def read(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        """Return the outputs (n, o, K) at states (n, d, K)."""


class _Slopes(Protocol):
    """Derivatives along a trajectory."""

    def with_states(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, d, d) of the steps and (n, o, K, d) of the outputs with the states."""

    def with_value(self, name: Name, by: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (n, K - 1, 2, d) of the steps and (n, o, K) of the outputs with a value.

        Differences are those of a change `by` so much. Tangents have (n, K - 1, 3, d): a change may also bend.
        """


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States `x` (n, d, K) of a problem, and its `outputs` (n, o, K)."""

    problem: Problem
    x: np.ndarray
    outputs: np.ndarray
    stepper: _Stepper
    _known: dict[Name, "Direction"] = field(default_factory=dict)

    @cached_property
    def _slopes(self) -> _Slopes:
        system = self.problem.system
        lowest = np.array(system.lowest or (-np.inf,) * self.x.shape[1])
        is_smooth = not system.switches and not (self.x <= lowest[:, None]).any()
        return Tangents(self.problem, self.x) if is_smooth and isinstance(self.stepper, _OnTape) else _Differences(self)

    @cached_property
    def _with_states(self) -> tuple[np.ndarray, np.ndarray]:
        return self._slopes.with_states()

    @property
    def A(self) -> np.ndarray:
        """Derivatives (n, K - 1, d, d) of the steps with the states."""
        return self._with_states[0]

    @property
    def C(self) -> np.ndarray:
        """Derivatives (n, o, K, d) of the outputs with the states."""
        return self._with_states[1]

    def direction(self, kind: Kind, name: str, size: float) -> "Direction":
        """Return the derivatives with a quantity, an input or a parameter (the `kind`) of typical `size`."""
        key = kind, name
        if key not in self._known:
            self._known[key] = Direction(*self._slopes.with_value(key, DIFFERENCE * size), self._begin(key, size))
        return self._known[key]

    def _begin(self, name: Name, size: float) -> np.ndarray:
        """Return the derivatives (n, d) of the states at the begin with a value of typical `size`."""
        by = DIFFERENCE * size
        return np.asarray((_start(_changed(self.problem, name, by)) - self.x[:, :, 0]) / by)

    @cached_property
    def halfway(self) -> tuple[Problem, np.ndarray] | None:
        """The problem and its states (n, d, K - 1) in the middle of each step, where changes may bend; None elsewhere.

        States are on the cubic line with the rates at both ends of a step (Hermite).
        """
        problem, x = self.problem, self.x
        if not problem.system.states or not isinstance(self._slopes, Tangents):
            return None
        rates = np.stack([np.broadcast_to(rate, x[:, 0].shape) for rate in Equations(
            problem.system, problem.laws).rates(tuple(x.transpose(1, 0, 2)), problem.inputs, problem.quantities,
                                                Namespace(**problem.parameters), {})], axis=1)
        inputs, quantities = (halve(*ends(values)) for values in (problem.inputs, problem.quantities))
        states = 0.5 * (x[:, :, :-1] + x[:, :, 1:]) - problem.h / 8 * np.diff(rates, axis=2)
        return replace(problem, inputs=inputs, quantities=quantities), states

    def respond(self, direction: "Direction", basis: np.ndarray, halfway: np.ndarray | None = None) -> np.ndarray:
        """Return the changes (n, m, o, K) of the outputs with coefficients of a basis (n, m, K) of a change.

        It is linear over each step, or has the values of a basis `halfway` (n, m, K - 1) in the middle.
        """
        n, m, size = basis.shape
        out = np.empty((n, m, self.outputs.shape[1], size))
        bends = np.empty((n, m, 0)) if halfway is None else halfway - 0.5 * (basis[:, :, :-1] + basis[:, :, 1:])
        respond(self.A, direction.B, self.C, direction.D, direction.S, np.ascontiguousarray(basis, dtype=float), bends,
                out)
        return out

    def respond_to_parameter(self, name: str, size: float) -> np.ndarray:
        """Return the changes (n, 1, o, K) of the outputs with a parameter of typical `size`."""
        if not isinstance(self._slopes, Tangents):
            n, _, instants = self.x.shape
            return self.respond(self.direction("parameter", name, size), np.ones((n, 1, instants)))
        constants, begins = self._slopes.constants
        start = self._begin(("parameter", name), size)
        return np.asarray(constants["parameter", name] + np.einsum("dnok,nd->nok", begins, start))[:, None]


@dataclass(frozen=True, eq=False)
class Direction:
    """Derivatives with a change that is linear over each step, between its values at both ends.

    `B` (n, K - 1, 2, d) are those of the steps, `D` (n, o, K) of the outputs, `S` (n, d) of the start. Where changes
    may bend within a step, B (n, K - 1, 3, d) has that with a change in the middle alone.
    """

    B: np.ndarray
    D: np.ndarray
    S: np.ndarray


class _Differences:
    """Numerical derivatives of the steps themselves, within which states meet surfaces or their lowest values."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.x, self.outputs, self.stepper = trajectory.x, trajectory.outputs, trajectory.stepper

    @cached_property
    def _following(self) -> np.ndarray:
        return self.stepper.step(self.x, np.zeros(self.x.shape[1]))

    def with_states(self) -> tuple[np.ndarray, np.ndarray]:
        (n, d, size), magnitude = self.x.shape, np.median(
            np.where(np.isfinite(self.x), np.abs(self.x), 0.0).max(axis=2), axis=0)
        A, C = np.empty((n, size - 1, d, d)), np.empty((*self.outputs.shape, d))
        for place, shift in enumerate(np.diag(DIFFERENCE * np.where(magnitude > 0, magnitude, 1.0))):
            A[..., place] = self._differ(shift[place], shift)
            C[..., place] = (self.stepper.read(self.x, shift) - self.outputs) / shift[place]
        return A, C

    def with_value(self, name: Name, by: float) -> tuple[np.ndarray, np.ndarray]:
        # Those at both ends have the sum of a change that is the same at both, also where a step meets a surface: a
        # constant of a law and a parameter that say the same would differ there, and their difference be a law.
        (n, d, size), no, both = self.x.shape, np.zeros(self.x.shape[1]), _Change(name, (by, by))
        D = (self.stepper.read(self.x, no, both) - self.outputs) / by
        B = np.zeros((n, size - 1, 2, d))
        if d:
            B[:, :, 0] = self._differ(by, no, both)
            if name[0] != "parameter":  # which is the same at both ends
                B[:, :, 1] = self._differ(by, no, _Change(name, (0.0, by)))
                B[:, :, 0] -= B[:, :, 1]
        return B, D

    def _differ(self, by: float, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        """Return the derivatives (n, K - 1, d) of the steps with states or with a value that changes `by` so much."""
        return np.asarray(((self.stepper.step(self.x, shift, change) - self._following) / by).transpose(0, 2, 1))


def solve(problem: Problem) -> Trajectory:
    """Solve a problem."""
    stepper, start = _choose_stepper(problem), _start(problem)
    x = stepper.follow(start) if start.size else np.empty((*start.shape, problem.shape[1]))
    return Trajectory(problem, x, stepper.read(x, np.zeros(x.shape[1])), stepper)


def _start(problem: Problem) -> np.ndarray:
    """Return the states (n, d) at the begin of each run."""
    first, (n, _) = slice(0, 1), problem.shape
    start = Equations(problem.system, problem.laws).start(
        cut(problem.inputs, first), cut(problem.quantities, first), Namespace(**problem.parameters), (n, 1))
    return np.stack([state[:, 0] for state in start], axis=1) if start else np.empty((n, 0))


def _changed(problem: Problem, name: Name, by: float) -> Problem:
    """Return a problem in which a value is changed everywhere."""
    values = {"input": problem.inputs, "quantity": problem.quantities, "parameter": problem.parameters}
    changed = {**values, name[0]: {**values[name[0]], name[1]: values[name[0]][name[1]] + by}}
    return replace(problem, inputs=changed["input"], quantities=changed["quantity"], parameters=changed["parameter"])


def _choose_stepper(problem: Problem) -> _Stepper:
    layout = Layout.of(problem)
    is_recorded = all(isinstance(record_equations(problem, layout, what), Tape) for what in EQUATIONS)
    return _OnTape(problem, layout) if is_recorded else _InNumpy(problem)


class _OnTape:
    """Evaluates recorded equations by compiled kernels, which have the runs last."""

    def __init__(self, problem: Problem, layout: Layout) -> None:
        (n, size), values = problem.shape, list_values(problem)
        self.problem, self.layout, self.h = problem, layout, np.full(size - 1, problem.h, dtype=float)
        self.P, self.V = np.empty((len(layout.constant), n)), np.empty((len(layout.driven), size, n))
        for row, name in enumerate(layout.constant):
            self.P[row] = np.reshape(values[name], -1)
        for row, name in enumerate(layout.driven):
            self.V[row] = np.transpose(values[name])

    def follow(self, start: np.ndarray) -> np.ndarray:
        X = np.empty((start.shape[1], len(self.h) + 1, len(start)))
        follow(self._pack("rate"), self.P, self.V, np.ascontiguousarray(start.T), self.h, X)
        return _runs_first(X)

    def step(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        out = np.empty((x.shape[1], x.shape[2] - 1, len(x)))
        step_all(self._pack("rate", change), self.P, self.V, _runs_last(x), shift, _by(change), self.h, out)
        return out.transpose(2, 0, 1)

    def read(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        out = np.empty((len(self.problem.system.signals), x.shape[2], len(x)))
        output = self._pack("output", change)
        rates = self._pack("rate", change) if self.problem.system.switches else output  # or it chooses no sides
        read_all(output, rates, self.P, self.V, _runs_last(x), shift, _by(change)[0], out)
        return _runs_first(out)

    def _pack(self, what: Any, change: _Change | None = None) -> tuple[Any, ...]:
        """Return a tape for the kernels, with the values of the laws."""
        tape = record_equations(self.problem, self.layout, what, None if change is None else change.name)
        assert isinstance(tape, Tape)  # as without a change
        return pack(tape, self.problem)


def _by(change: _Change | None) -> np.ndarray:
    return np.zeros(2) if change is None else np.array(change.by)


def _runs_last(x: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(x.transpose(1, 2, 0))


def _runs_first(x: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(x.transpose(2, 0, 1))


class _InNumpy:
    """Evaluates the functions of a machine themselves, of which there is no tape."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.equations = problem, Equations(problem.system, problem.laws)

    def follow(self, start: np.ndarray) -> np.ndarray:
        return integrate(self.problem, start)

    def step(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        states = tuple(x[:, place, :-1] + by for place, by in enumerate(shift))
        begin, end = (self.problem if change is None else _changed(self.problem, change.name, by)
                      for by in _by(change))
        u, q = ((ends(getattr(begin, name))[0], ends(getattr(end, name))[1]) for name in ("inputs", "quantities"))
        after = self.equations.advance(states, u, q, Namespace(**begin.parameters), self.problem.h)
        return np.stack([np.broadcast_to(state, states[0].shape) for state in after], axis=1)

    def read(self, x: np.ndarray, shift: np.ndarray, change: _Change | None = None) -> np.ndarray:
        states = tuple(x[:, place] + by for place, by in enumerate(shift))
        problem = self.problem if change is None else _changed(self.problem, change.name, change.by[0])
        outputs = self.equations.outputs(states, problem.inputs, problem.quantities, Namespace(**problem.parameters))
        return np.stack([np.broadcast_to(output, problem.shape) for output in outputs], axis=1)


def integrate(problem: Problem, start: np.ndarray) -> np.ndarray:
    """Return the states (n, d, K) of a problem from those at its start (n, d) on, step by step for all runs at once."""
    n, size = problem.shape
    equations = Equations(problem.system, problem.laws)
    p = Namespace(**{name: np.broadcast_to(np.reshape(value, -1), (n,)) for name, value in problem.parameters.items()})

    def columns(values: Values) -> dict[str, Any]:
        return {name: np.ascontiguousarray(np.broadcast_to(value, (n, size)).T) if np.ndim(value) else value
                for name, value in values.items()}

    def at(values: Values, j: int) -> dict[str, Any]:
        return {name: value[j] if np.ndim(value) else value for name, value in values.items()}

    u, q, x = columns(problem.inputs), columns(problem.quantities), np.empty((size, start.shape[1], n))
    steps, x[0] = np.broadcast_to(problem.h, (size - 1,)), start.T
    for j, step in enumerate(steps):
        x[j + 1] = equations.advance(tuple(x[j]), (at(u, j), at(u, j + 1)), (at(q, j), at(q, j + 1)), p, step)
    return np.ascontiguousarray(x.transpose(2, 1, 0))


_LANES = 16
"""Columns that are integrated together: each step waits for the one before, and those of other columns do not."""


@njit(nogil=True, cache=True, error_model="numpy")
def respond(A, B, C, D, S, basis, bends, out):  # type: ignore[no-untyped-def]
    """Fill out (n, m, o, K) with the changes of the outputs along coefficients of a basis (n, m, K).

    It may have `bends` (n, m, K - 1), which are what it is in the middle of steps beyond lines, or (n, m, 0).
    """
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
                    if bends.shape[2]:
                        for g in range(count):
                            w[a, g] += B[i, j, 2, a] * bends[i, first + g, j]
                v[:] = w
