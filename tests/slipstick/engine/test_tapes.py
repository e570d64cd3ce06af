"""Recorded equations against the functions that were recorded."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.engine import trajectory
from slipstick.engine.equations import Problem
from slipstick.engine.tangents import Tangents
from slipstick.engine.tape import Layout, Tape, record_equations
from slipstick.engine.trajectory import _choose_stepper, _InNumpy, _OnTape
from slipstick.machine.system import System

Read = Callable[[Any, Any], Any]
RATIO, FACTOR = [0.0, 0.3, 0.7, 1.0], (2.0, 1.5, 1.5, 0.4)
FUNCTIONS: dict[str, Read] = {
    "sums": lambda a, b: a + b - 3 - (2 - a) + (-b) - +a, "products": lambda a, b: a * b / 3 * (2 / (a + 9)) * 0.5,
    "powers": lambda a, b: (np.abs(a)**1.5 + np.abs(b)**0.5 + a**2 + b**3 + (a + 9)**-1 + (b + 3)**-2
                            + (np.abs(a) + 0.1)**b + 2.0**a),
    "roots": lambda a, b: np.sqrt(np.abs(a)) + np.square(b) + np.reciprocal(a + 9) + np.hypot(a, b),
    "exponentials": lambda a, b: np.exp(a) + np.log(np.abs(b)) + np.tanh(a * b) + np.sinh(a) - np.cosh(b),
    "angles": lambda a, b: np.sin(a) + np.cos(b) + np.tan(a) + np.arctan(b) + np.arctan2(a, b),
    "inverse angles": lambda a, b: np.arcsin(np.tanh(a)) + np.arccos(np.tanh(b)),
    "other units": lambda a, b: np.degrees(a) + np.rad2deg(b) + np.radians(a) * np.deg2rad(b) + np.log10(np.abs(a)),
    "limits": lambda a, b: np.maximum(a, b) + np.minimum(a, 0.3) + np.clip(b, -0.5, 0.5) + np.fmax(a, 0.1),
    "signs": lambda a, b: np.sign(a) * np.abs(b) + np.fabs(a) + np.sign(a - a),
    "parts": lambda a, b: np.floor(3 * a) + np.mod(a, 0.7) + np.mod(b, -0.3) + a % 0.2 + a // 0.4,
    "choices": lambda a, b: np.where(a > b, a, -b) + np.where((a < 0) | ~(b >= 0.2), 1.0, a) * (a <= 0.5),
    "more choices": lambda a, b: np.where((a != b) & (a == a), 2.0, 0.0) + np.logical_and(a > 0, b > 0) * 3,
    "logic": lambda a, b: np.where(np.logical_not(a > 0), 1, 2) + np.where(np.logical_or(a > 1, b > 1), b, 0),
    "tables": lambda a, b: np.interp(a, RATIO, FACTOR) * np.interp(b, [-1.0, 1.0], [3.0, 2.0]) + np.interp(a, [0], [5]),
    "like": lambda a, b: np.zeros_like(a) + np.ones_like(b) * a, "numbers": lambda a, b: 0 * a + 1 * b + (b + 0)**1,
    "a kind": lambda a, b: (a > 0).astype(float) * b,
}
"""Equations in words, of which each operation that a tape knows is in one."""


def subtract(a: Any, b: Any) -> Any:
    left = 2 * a
    left -= b
    left *= 3
    return left + a


FUNCTIONS["in place"] = subtract


def pose(read: Read, **changed: Any) -> Problem:
    system = System(("s",), ("y",), lambda x, u, q, p: read(x.s, u.a) - x.s, lambda u, q, p: p.begin,
                    lambda x, u, q, p: read(u.a, p.begin + q.shift))
    random = np.random.default_rng(1)
    values = {"a": random.uniform(-1.5, 1.5, (5, 40))}
    return Problem(system, 0.05, values | changed, {"shift": 0.2}, {"begin": random.uniform(0.1, 0.9, (5, 1))})


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_recorded_functions_are_those_of_numpy(name: str) -> None:
    problem = pose(FUNCTIONS[name])
    taped, plain = _choose_stepper(problem), _InNumpy(problem)
    assert isinstance(taped, _OnTape)
    x = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 1, 40))
    no = np.zeros(1)
    assert np.isfinite(plain.step(x, no)).all()
    np.testing.assert_allclose(taped.step(x, no), plain.step(x, no), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(taped.read(x, no), plain.read(x, no), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_derivatives_are_differences_of_recorded_functions(name: str) -> None:
    """But where a function jumps or bends between both values of a difference."""
    problem = pose(FUNCTIONS[name])
    x = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 1, 40))
    for what, names in (("rate", [("input", "a"), 0]), ("output", [("input", "a"), ("quantity", "shift"),
                                                                   ("parameter", "begin"), 0])):
        derivatives, _ = Tangents(problem, x).differentiate(what, names)
        for each, exact in zip(names, derivatives, strict=True):
            ahead, behind = (read_moved(problem, what, x, each, by) for by in (1e-6, -1e-6))
            differences = (ahead - behind) / 2e-6
            is_near = np.abs(exact - differences) < 1e-5 * (1 + np.abs(differences))
            assert is_near.mean() > 0.99


def read_moved(problem: Problem, what: str, x: np.ndarray, name: Any, by: float) -> np.ndarray:
    """The rates or outputs (n, 1, K) by numpy, with a value or a state changed."""
    moved = problem if name == 0 else trajectory._changed(problem, name, by)
    system, p = problem.system, SimpleNamespace(**moved.parameters)
    named, u, q = SimpleNamespace(s=x[:, 0] + by * (name == 0)), SimpleNamespace(**moved.inputs), SimpleNamespace(
        **moved.quantities)
    return np.broadcast_to(system.rate(named, u, q, p) if what == "rate" else system.output(named, u, q, p),
                           (5, 40))[:, None]


def branch(a: Any, b: Any) -> Any:
    return a if np.all(a > 0) else 2 * b


def search(a: Any, b: Any) -> Any:
    return np.searchsorted(np.array(RATIO), a) + b


@pytest.mark.parametrize(("read", "reason"), [
    (branch, "they call all"), (lambda a, b: a if a > 0 else b, "they decide by a value"), (search, "they call"),
    (lambda a, b: np.asarray(a) + b, "they make an array of a value"),
    (lambda a, b: np.cumsum(a) * b, "they call cumsum"),
    (lambda a, b: np.frompyfunc(abs, 1, 1)(a).astype(float) + b, "they call abs"),
    (lambda a, b: np.add(a, b, where=True), "they call add in another way"),
    (lambda a, b: np.array([1.0, 2.0]) * a + b, "they compute with an array"),
    (lambda a, b: np.where(a > 0)[0] * b, "they call where"), (lambda a, b: a.copy() + b, "a value has no attribute")])
def test_what_no_tape_can_do_is_left_to_numpy_with_a_reason(read: Read, reason: str) -> None:
    problem = pose(read)
    assert isinstance(_choose_stepper(problem), _InNumpy)
    said = record_equations(problem, Layout.of(problem), "rate")
    assert isinstance(said, str)
    assert said.startswith(reason)


def test_an_error_of_a_function_is_raised_by_numpy() -> None:
    with pytest.raises(AttributeError, match="misspelt"):
        _choose_stepper(pose(lambda a, b: SimpleNamespace().misspelt)).follow(np.zeros((5, 1)))


def test_what_is_zero_or_computed_twice_is_not_on_the_tape() -> None:
    problem = pose(lambda a, b: (a * b + 1) * (a * b + 1) * (1 + 0 * a))
    layout = Layout.of(problem)
    tape = record_equations(problem, layout, "rate")
    assert isinstance(tape, Tape)
    assert len(tape.program) == 4  # a b, + 1, its square, - x
    assert layout.driven == (("input", "a"),)
    assert record_equations(problem, layout, "rate") is tape
    assert record_equations(problem, layout, "output", ("quantity", "shift")) is not tape


def test_what_is_constant_in_a_run_is_computed_once() -> None:
    problem = pose(lambda a, b: b)
    system = System(("s",), ("y",), lambda x, u, q, p: np.exp(p.begin) * 2 * u.a - x.s, lambda u, q, p: p.begin,
                    lambda x, u, q, p: x.s)
    tape = record_equations(Problem(system, 0.1, problem.inputs, {}, problem.parameters),
                            Layout.of(Problem(system, 0.1, problem.inputs, {}, problem.parameters)), "rate")
    assert isinstance(tape, Tape)
    np.testing.assert_array_equal(tape.ends, [2, 3, 4])  # exp, times 2; times a; minus x
