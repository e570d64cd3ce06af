"""Trajectories and their linear response, against the integrators of SciPy and differences of nonlinear solutions."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slipstick.engine import trajectory as trajectories
from slipstick.engine.equations import EDGE, OwnLaw, Problem
from slipstick.engine.trajectory import Trajectory, solve
from slipstick.machine.system import System
from slipstick.numerics.piecewise import hats

FREE = (-np.inf, -np.inf)
EXACT = {"rtol": 1e-10, "atol": 1e-12}
Phases = Mapping[int, tuple[Callable[..., Any], Callable[..., Any], Callable[..., int]]]


def spring_rate(x, u, q, p):  # type: ignore[no-untyped-def]
    return x.v, u.force * (1 + q.gain) - p.stiffness * x.s - x.s**3 - p.damping * x.v - q.pull


def spring_start(u, q, p):  # type: ignore[no-untyped-def]
    return p.begin + 0.1 * q.pull, 0.2 * u.force + 0.0 * p.begin


def spring_output(x, u, q, p):  # type: ignore[no-untyped-def]
    return x.s + q.offset, u.force * x.v * p.damping


SPRING = System(("s", "v"), ("place", "power"), spring_rate, spring_start, spring_output,
                {"s": lambda x, u, p: x.s, "stretch": lambda x, u, p: x.s * p.stiffness + 0.1 * u.force}, FREE)


def pose_spring(steps: int = 400, **changed: Any) -> Problem:
    time = np.linspace(0, 4, steps + 1)
    force = np.stack([np.interp(time, (0, 1, 2.5, 4), row) for row in ([1, 3, -1, 0.5], [0, -2, 2, 2], [2, 2, 0, -3])])
    quantities = {"gain": 0.1 * np.interp(time, (0, 2, 4), (0, 1, -1)) * np.ones((3, 1)), "pull": 0.3, "offset": 0.5}
    parameters = {"stiffness": np.array([[1.0], [2.0], [1.5]]), "damping": np.full((3, 1), 0.4),
                  "begin": np.array([[0.5], [-0.2], [0.0]])}
    return replace(Problem(SPRING, 4 / steps, {"force": force}, quantities, parameters), **changed)


def tank_rate(x, u, q, p):  # type: ignore[no-untyped-def]
    drained = p.outlet * np.sqrt(np.maximum(x.upper, 0) + 0.04)
    return u.flow - drained - q.leak, drained - p.outlet * x.lower * np.abs(x.lower) - 0.5 * q.leak


TANKS = System(("upper", "lower"), ("lower",), tank_rate, lambda u, q, p: (p.begin, 0.1 + 0 * p.begin),
               lambda x, u, q, p: x.lower, lowest=(0.0, -np.inf))
FLOW = (0, 1, 3, 4, 6), (1.0, 0.0, 0.0, 1.27, 1.0)


def pose_tanks(steps: int = 600) -> Problem:
    time = np.linspace(0, 6, steps + 1)
    return Problem(TANKS, 6 / steps, {"flow": np.interp(time, *FLOW)[None] * np.ones((2, 1))}, {"leak": 0.05},
                   {"outlet": np.array([[0.8], [0.6]]), "begin": np.array([[0.3], [0.2]])})


DRY, VISCOUS, HEAVY = 1.0, 0.3, 0.7


def slide_rate(x, u, q, p):  # type: ignore[no-untyped-def]
    return (u.force - q.pull - p.dry * x.v_side - p.viscous * x.v) / p.mass, x.v


SLIDE = System(("v", "s"), ("v", "s"), slide_rate, lambda u, q, p: (p.begin, 0.0), lambda x, u, q, p: (x.v, x.s),
               {"v": lambda x, u, p: x.v, "s": lambda x, u, p: x.s}, FREE, (0,))


def push(time: Any, most: float) -> np.ndarray:
    return np.asarray(np.interp(time, (0, 1, 3, 5, 6), most * np.array([0.0, 1.0, -1.0, 1.0, 0.2])))


def pose_slide(most: float, steps: int = 1200, dry: float = DRY, runs: int = 1, **changed: Any) -> Problem:
    force = push(np.linspace(0, 6, steps + 1), most) * np.ones((runs, 1))
    parameters = {"dry": dry, "viscous": VISCOUS, "mass": HEAVY, "begin": 0.0}
    return replace(Problem(SLIDE, 6 / steps, {"force": force}, {"pull": 0.0},
                           {name: np.full((runs, 1), value) for name, value in parameters.items()}), **changed)


def integrate_phases(phases: Phases, phase: int, x: list[float], time: np.ndarray) -> np.ndarray:
    """States (d, K) of a system that switches: a phase ends where its guard falls below 0, and tells what follows."""
    out, now = np.empty((len(x), len(time))), time[0]
    out[:, 0] = x
    for _ in range(50):
        rate, guard, follow = phases[phase]

        def event(t: float, x: np.ndarray, guard: Callable[..., Any] = guard) -> Any:
            return guard(t, x)

        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        solved = solve_ivp(rate, (now, time[-1]), x, events=event, dense_output=True, max_step=0.05, **EXACT)
        inside = (time > now) & (time <= solved.t[-1])
        out[:, inside] = solved.sol(time[inside])
        now, x = solved.t[-1], [*solved.y[:, -1]]
        if solved.status == 0:
            return out
        phase, x[0] = follow(now, x), 0.0  # each phase ends with the first state at 0, or rests there
    raise AssertionError("too many phases")


def slide_by_events(most: float, time: np.ndarray) -> np.ndarray:
    def slide(side: int) -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., int]]:
        return (lambda t, x: ((push(t, most) - side * DRY - VISCOUS * x[0]) / HEAVY, x[0]), lambda t, x: side * x[0],
                lambda t, x: int(np.sign(push(t, most))) if abs(push(t, most)) > DRY else 0)

    rest = (lambda t, x: (0.0, 0.0), lambda t, x: DRY - abs(push(t, most)), lambda t, x: int(np.sign(push(t, most))))
    return integrate_phases({1: slide(1), -1: slide(-1), 0: rest}, 0, [0.0, 0.0], time)


def tank_by_events(outlet: float, begin: float, time: np.ndarray) -> np.ndarray:
    def rate(t: float, x: np.ndarray) -> tuple[float, float]:
        drained = outlet * np.sqrt(max(x[0], 0) + 0.04)
        return np.interp(t, *FLOW) - drained - 0.05, drained - outlet * x[1] * abs(x[1]) - 0.025

    wet = rate, lambda t, x: x[0], lambda t, x: 0
    empty = lambda t, x: (0.0, rate(t, x)[1]), lambda t, x: -rate(t, x)[0], lambda t, x: 1
    return integrate_phases({1: wet, 0: empty}, 1, [begin, 0.1], time)


LORENZ = System(("x", "y", "z"), ("z",), lambda x, u, q, p: (10 * (x.y - x.x), x.x * (28 + u.rise - x.z) - x.y,
                                                             x.x * x.y - 8 / 3 * x.z),
                lambda u, q, p: (p.begin, p.begin + 1, p.begin + 20), lambda x, u, q, p: x.z, lowest=(-np.inf,) * 3)


def pose_lorenz() -> Problem:
    return Problem(LORENZ, 0.01, {"rise": np.zeros((3, 1201))}, {}, {"begin": np.array([[1.0], [2.0], [-3.0]])})


def step(problem: Problem) -> Trajectory:
    """The trajectory of a problem whose functions are evaluated by numpy, and not on a tape."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trajectories, "record_equations", lambda *_: "not here")
        return solve(problem)


def take(problem: Problem, rows: slice | np.ndarray) -> Problem:
    """The problem of some runs."""
    def chosen(values: Mapping[str, Any]) -> dict[str, Any]:
        return {name: value[rows] if np.ndim(value) == 2 and len(value) > 1 else value
                for name, value in values.items()}

    return replace(problem, inputs=chosen(problem.inputs), quantities=chosen(problem.quantities),
                   parameters=chosen(problem.parameters))


FIRST, SECOND, LOAD = 0.5, 2.0, 1.2
HELD = (0.0, 1.0, 3.0, 4.0, 5.0, 6.0), (0.0, 3.0, 3.0, 0.7, 0.7, 3.0)
"""Time in s and largest torque of plates in N m: they slip, stick, slip again under the load, and stick."""


def joint_rate(x, u, q, p):  # type: ignore[no-untyped-def]
    second = (u.held * x.slip_side - LOAD * x.speed) / SECOND
    return (u.drive - u.held * x.slip_side) / FIRST - second, second


JOINT = System(("slip", "speed"), ("speed", "torque"), joint_rate, lambda u, q, p: (p.begin, 0.0),
               lambda x, u, q, p: (x.speed, u.held * x.slip_side), {"slip": lambda x, u, p: x.slip}, FREE, (0,))


def pose_joint(steps: int = 900) -> Problem:
    time = np.linspace(0, 6, steps + 1)
    inputs = {"held": np.interp(time, *HELD)[None] * np.ones((2, 1)), "drive": np.ones((2, 1)) * (1 + 0.5 * time)}
    return Problem(JOINT, 6 / steps, inputs, {}, {"begin": np.array([[3.0], [-2.0]])})


POSES = {"spring": pose_spring, "tanks": pose_tanks, "slide": lambda: pose_slide(1.5, 900), "joint": pose_joint}


def test_a_nonlinear_system_is_that_of_scipy() -> None:
    problem, time = pose_spring(), np.linspace(0, 4, 401)
    solved = solve(problem)
    assert problem.shape == (3, 401)
    assert solved.outputs.shape == (3, 2, 401)
    for run in range(3):
        p = {name: value[run, 0] for name, value in problem.parameters.items()}
        force, gain = problem.inputs["force"][run], problem.quantities["gain"][run]

        def rate(t: float, x: np.ndarray, p: dict[str, float] = p, force: np.ndarray = force,
                 gain: np.ndarray = gain) -> list[float]:
            pushed = np.interp(t, time, force) * (1 + np.interp(t, time, gain)) - 0.3
            return [x[1], pushed - p["stiffness"] * x[0] - x[0]**3 - p["damping"] * x[1]]

        exact = solve_ivp(rate, (0, 4), [p["begin"] + 0.03, 0.2 * force[0]], t_eval=time, max_step=0.05, **EXACT).y
        np.testing.assert_allclose(solved.x[run], exact, atol=2e-8)
        np.testing.assert_allclose(solved.outputs[run, 0], exact[0] + 0.5, atol=2e-8)
        np.testing.assert_allclose(solved.outputs[run, 1], force * exact[1] * 0.4, atol=2e-8)


def test_halving_the_step_divides_the_error_by_sixteen() -> None:
    fine = solve(pose_spring(1600)).x[:, :, ::40]
    errors = [np.abs(solve(pose_spring(steps)).x[:, :, ::steps // 40] - fine).max() for steps in (40, 80, 160)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 16, rtol=0.15)


def test_steps_may_have_different_lengths() -> None:
    time = np.concatenate([np.linspace(0, 1, 51), np.linspace(1, 4, 601)[1:]])
    even = pose_spring(800)
    at = np.round(time * 200).astype(int)
    np.testing.assert_allclose(at, time * 200, atol=1e-9)
    uneven = replace(even, h=np.diff(time), inputs={"force": even.inputs["force"][:, at]},
                     quantities={**even.quantities, "gain": even.quantities["gain"][:, at]})
    exact, stepped = solve(even).x, solve(uneven)
    np.testing.assert_allclose(stepped.x, exact[:, :, at], atol=1e-7)
    np.testing.assert_allclose(stepped.x, step(uneven).x, atol=1e-12)


def test_a_state_stays_at_its_lowest_value_until_it_rises() -> None:
    time, solved = np.linspace(0, 6, 601), solve(pose_tanks())
    for run, (outlet, begin) in enumerate(((0.8, 0.3), (0.6, 0.2))):
        exact = tank_by_events(outlet, begin, time)
        empty = exact[0] == 0
        assert 100 < empty.sum() < 400
        assert np.all(solved.x[run, 0] >= 0)
        assert np.abs(solved.x[run, 0, empty]).max() < 1e-4
        np.testing.assert_allclose(solved.x[run], exact, atol=3e-4)


def joint_by_events(begin: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States (2, K) and the torque (K,) of plates between two shafts, whose torque is known while they stick."""
    def holds(t: float, x: Any) -> Any:  # both shafts turn alike
        drive = 1 + 0.5 * t
        return drive - FIRST * (drive - LOAD * x[1]) / (FIRST + SECOND)

    def slip(side: int) -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., int]]:
        def rate(t: float, x: np.ndarray) -> tuple[float, float]:
            torque = side * np.interp(t, *HELD)
            second = (torque - LOAD * x[1]) / SECOND
            return (1 + 0.5 * t - torque) / FIRST - second, second

        return rate, lambda t, x: side * x[0], lambda t, x: 0 if abs(holds(t, x)) < np.interp(t, *HELD) else -side

    stick = (lambda t, x: (0.0, (holds(t, x) - LOAD * x[1]) / SECOND),
             lambda t, x: np.interp(t, *HELD) - abs(holds(t, x)), lambda t, x: int(np.sign(holds(t, x))))
    x = integrate_phases({1: slip(1), -1: slip(-1), 0: stick}, int(np.sign(begin)), [begin, 0.0], time)
    return x, np.where(x[0] == 0, holds(time, x), np.sign(x[0]) * np.interp(time, *HELD))


@pytest.mark.parametrize("run", [0, 1])
def test_plates_that_stick_carry_the_torque_that_holds_them(run: int) -> None:
    """They slip, stick at about 1 s, break away where they are pressed less, and stick again."""
    errors = []
    for steps in (600, 2400):
        solved, time = solve(pose_joint(steps)), np.linspace(0, 6, steps + 1)
        x, torque = joint_by_events(float(solved.problem.parameters["begin"][run, 0]), time)
        sticks = np.convolve(x[0] == 0, np.ones(5), "same") == 5
        assert 0.2 < sticks.mean() < 0.8
        assert not sticks[time.searchsorted(4.5)]
        np.testing.assert_array_equal(solved.x[run, 0, sticks], 0)
        np.testing.assert_allclose(solved.outputs[run, 1, sticks], torque[sticks], atol=4 / steps)
        errors.append(np.abs(solved.x[run] - x).max())
    assert errors[0] < 0.02
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(("most", "rests"), [(0.99, 1.0), (1.5, 0.4), (4.0, 0.1)])
def test_dry_friction_holds_and_lets_go_as_it_does_by_events(most: float, rests: float) -> None:
    """A mass that never moves, which rests at each turn, and one that turns without a rest."""
    errors = []
    for steps in (800, 3200):
        time, x = np.linspace(0, 6, steps + 1), solve(pose_slide(most, steps)).x[0]
        exact = slide_by_events(most, time)
        resting = exact[0] == 0
        assert resting.mean() == pytest.approx(rests, abs=0.15)
        inside = np.convolve(resting, np.ones(5), "same") == 5
        np.testing.assert_array_equal(x[0, inside], 0)
        np.testing.assert_array_equal(np.diff(x[1])[inside[1:] & inside[:-1]], 0)
        errors.append(np.abs(x - exact).max())
    assert errors[0] < 1e-12 or errors[0] < 0.01 * most
    assert errors[1] < 1e-12 or errors[1] < errors[0] / 2.5


def require_same(solved: Trajectory, stepped: Trajectory) -> None:
    np.testing.assert_allclose(solved.x, stepped.x, atol=1e-10)
    np.testing.assert_allclose(solved.outputs, stepped.outputs, atol=1e-10)
    np.testing.assert_allclose(solved.A, stepped.A, atol=1e-6)
    np.testing.assert_allclose(solved.C, stepped.C, atol=1e-6)


@pytest.mark.parametrize("runs", [1, 3, 300])
@pytest.mark.parametrize("name", POSES)
def test_a_tape_gives_what_numpy_gives(name: str, runs: int) -> None:
    """With some runs, of which several instants are in a row, and with more than fit into a row."""
    problem = take(POSES[name](), np.arange(runs) % POSES[name]().shape[0])
    solved, stepped = solve(problem), step(problem)
    require_same(solved, stepped)
    basis = random_basis(problem, 1)
    for kind, of in (("quantity", problem.quantities), ("input", problem.inputs), ("parameter", problem.parameters)):
        changing = basis if kind != "parameter" else basis[:, :1]  # a parameter changes in a whole run
        for each in of:
            np.testing.assert_allclose(*(each_of.respond(each_of.direction(kind, each, 1.0), changing)
                                         for each_of in (solved, stepped)), atol=2e-5)


def test_chaos_is_the_same_chaos_for_a_while() -> None:
    problem = pose_lorenz()
    np.testing.assert_allclose(solve(problem).x[:, :, :600], step(problem).x[:, :, :600], atol=1e-6)


@pytest.mark.parametrize("rows", [slice(1, 3), np.array([2, 0]), np.array([1])], ids=str)
def test_runs_that_are_taken_are_those_of_all(rows: Any) -> None:
    whole = pose_spring()
    shared = replace(whole, quantities={**whole.quantities, "gain": whole.quantities["gain"][:1]})
    for problem in (whole, shared):
        taken = take(problem, rows)
        assert taken.shape == (len(np.arange(3)[rows]), 401)
        assert taken.quantities["pull"] == 0.3
        np.testing.assert_array_equal(step(taken).x, step(problem).x[rows])
        np.testing.assert_allclose(solve(taken).x, solve(problem).x[rows], atol=1e-12)


def test_a_scalar_is_the_same_as_its_array() -> None:
    scalar = pose_spring()
    arrays = replace(scalar, quantities={name: np.broadcast_to(value, (3, 401)) for name, value in
                                         scalar.quantities.items()})
    basis = np.random.default_rng(3).standard_normal((3, 2, 401))
    for name in ("gain", "pull", "offset"):
        responses = [solved.respond(solved.direction("quantity", name, 1.0), basis) for solved in
                     (solve(scalar), solve(arrays))]
        np.testing.assert_allclose(*responses, atol=1e-9)
    np.testing.assert_array_equal(solve(scalar).outputs, solve(arrays).outputs)


KNOTS = np.array([-1.0, -0.2, 0.4, 1.5])


@pytest.mark.parametrize("variable", ["s", "stretch"])
@pytest.mark.parametrize("quantity", ["gain", "pull", "offset"])
def test_a_law_over_an_own_variable_is_that_written_in_the_equations(variable: str, quantity: str) -> None:
    values, more = np.array([0.3, -0.4, 0.5, 0.1]), np.array([-0.1, 0.2])

    def add(x: Any, u: Any, q: Any, p: Any) -> Any:
        law = np.interp(SPRING.own[variable](x, u, p), KNOTS, values) + np.interp(x.s, (0, 1), more)
        return type(q)(**{**vars(q), quantity: getattr(q, quantity) + law})

    written = replace(SPRING, rate=lambda x, u, q, p: spring_rate(x, u, add(x, u, q, p), p),
                      output=lambda x, u, q, p: spring_output(x, u, add(x, u, q, p), p))
    laws = (OwnLaw("quantity", quantity, variable, KNOTS, values),
            OwnLaw("quantity", quantity, "s", np.array([0.0, 1.0]), more))
    solved, exact, without = solve(pose_spring(laws=laws)), solve(pose_spring(system=written)), solve(pose_spring())
    assert np.abs(exact.outputs - without.outputs).max() > 0.05
    np.testing.assert_allclose(solved.x, exact.x, atol=1e-12)
    np.testing.assert_allclose(solved.outputs, exact.outputs, atol=1e-12)
    np.testing.assert_allclose(solved.A, exact.A, atol=1e-6)
    require_same(solved, step(pose_spring(laws=laws)))


def test_a_law_that_jumps_at_a_surface_is_dry_friction() -> None:
    """Where the law is all friction that there is, it holds and lets go as the parameter does."""
    edge = EDGE * 8
    knots, values = np.array([-4.0, -edge, edge, 4.0]), np.array([-1.4, -DRY, DRY, 1.4])
    law = OwnLaw("quantity", "pull", "v", knots, values, 0)
    viscous = VISCOUS + 0.1
    usual = pose_slide(1.7)
    exact = solve(replace(usual, parameters={**usual.parameters, "viscous": np.full((1, 1), viscous)}))
    solved = solve(pose_slide(1.7, dry=0.0, laws=(law,)))
    assert (exact.x[0, 0] == 0).sum() > 200
    assert np.abs(exact.x[0, 0]).max() < 4
    np.testing.assert_allclose(solved.x, exact.x, atol=1e-7)
    np.testing.assert_array_equal(solved.x[0, 0] == 0, exact.x[0, 0] == 0)
    np.testing.assert_allclose(solved.x, step(solved.problem).x, atol=1e-10)


@pytest.mark.parametrize(("side", "law"), [(1, 2.0), (-1, -3.0), (0, -0.5)])
def test_a_law_with_a_jump_is_read_on_a_side(side: int, law: float) -> None:
    edge = EDGE * 2
    jumping = OwnLaw("quantity", "pull", "v", np.array([-1.0, -edge, edge, 1.0]), np.array([-3.0, -3.0, 2.0, 2.0]), 0)
    assert jumping.at(np.zeros(1), np.array([side])) == pytest.approx([law])
    smooth = replace(jumping, place=None)
    assert smooth.at(np.array([-0.5, 0.5]), None) == pytest.approx([-3, 2])


def random_basis(problem: Problem, count: int, seed: int = 4) -> np.ndarray:
    """Smooth random functions (n, m, K) of time, one more of which is 1."""
    n, size = problem.shape
    values = np.random.default_rng(seed).standard_normal((n, count, 12))
    time = np.broadcast_to(np.linspace(0, 11, size), (n, size))
    smooth = np.einsum("nmk,nkt->nmt", values, hats(time, np.arange(12.0)))
    return np.concatenate([np.ones((n, 1, size)), smooth], axis=1)


def differences(problem: Problem, kind: str, name: str, basis: np.ndarray, by: float) -> np.ndarray:
    """Changes (n, m, o, K) of the outputs by central differences of nonlinear solutions."""
    group = {"quantity": "quantities", "input": "inputs", "parameter": "parameters"}[kind]

    def outputs(change: np.ndarray) -> np.ndarray:
        values = getattr(problem, group)
        return step(replace(problem, **{group: {**values, name: values[name] + change}})).outputs

    return np.stack([(outputs(by * change) - outputs(-by * change)) / (2 * by) for change in basis.swapaxes(0, 1)],
                    axis=1)


SPRING_LAWS = (OwnLaw("quantity", "pull", "s", KNOTS, np.array([0.3, -0.4, 0.5, 0.1])),)
DIRECTIONS: list[tuple[str, Callable[[], Problem], str, str]] = [
    *((f"spring {name}", pose_spring, kind, name) for kind, name in (
        ("quantity", "gain"), ("quantity", "pull"), ("quantity", "offset"), ("input", "force"),
        ("parameter", "stiffness"), ("parameter", "damping"), ("parameter", "begin"))),  # type: ignore[misc]
    *((f"spring with a law {name}", lambda: pose_spring(laws=SPRING_LAWS), kind, name) for kind, name in (
        ("quantity", "pull"), ("parameter", "begin"))),  # type: ignore[misc]
    *((f"tanks {name}", pose_tanks, kind, name) for kind, name in (
        ("quantity", "leak"), ("input", "flow"), ("parameter", "outlet"), ("parameter", "begin"))),  # type: ignore[misc]
    *((f"slide {name}", lambda: pose_slide(1.5, 600), kind, name) for kind, name in (
        ("quantity", "pull"), ("input", "force"), ("parameter", "dry"), ("parameter", "mass"))),  # type: ignore[misc]
]


@pytest.mark.parametrize(("pose", "kind", "name"), [row[1:] for row in DIRECTIONS], ids=[row[0] for row in DIRECTIONS])
def test_responses_are_differences_of_nonlinear_solutions(pose: Callable[[], Problem], kind: str, name: str) -> None:
    problem = pose()
    basis = random_basis(problem, 9 if name == "gain" else 2)  # with 10, more columns than are integrated together
    exact_basis = basis if kind != "parameter" else basis[:, :1, :1]
    exact = differences(problem, kind, name, exact_basis, 1e-6)
    solved = step(problem)
    responses = solved.respond(solved.direction(kind, name, 1.0), basis if kind != "parameter" else basis[:, :1])
    scale = np.abs(exact).max(axis=(0, 1, 3), keepdims=True)
    assert scale.max() > 0.1
    assert np.abs((responses - exact) / np.where(scale > 0, scale, 1)).max() < 1e-5


@pytest.mark.parametrize("solving", [solve, step], ids=["exact", "by differences"])
def test_responses_hardly_depend_on_the_size_of_a_change_and_are_kept(solving: Callable[[Problem], Trajectory]) -> None:
    solved = solving(pose_spring())
    basis = random_basis(solved.problem, 1)
    small, large = (solved.respond(solving(solved.problem).direction("quantity", "gain", size), basis)
                    for size in (0.1, 10.0))
    np.testing.assert_allclose(small, large, atol=1e-4)
    assert (np.abs(small - large).max() > 0) == (solving is step)
    assert solved.direction("quantity", "gain", 0.1) is solved.direction("quantity", "gain", 0.1)


def test_a_part_without_states_has_outputs_and_direct_responses() -> None:
    system = System((), ("y", "z"), lambda x, u, q, p: (), lambda u, q, p: (),
                    lambda x, u, q, p: (p.gain * u.a**2 + q.shift * u.a, q.shift**2 + p.gain),
                    {"square": lambda x, u, p: p.gain * u.a**2})
    a = np.random.default_rng(5).uniform(0.5, 2, (2, 30))
    gain, knots, values = np.array([[2.0], [3.0]]), np.array([0.0, 4.0, 20.0]), np.array([1.0, 2.0, -1.0])
    law = OwnLaw("quantity", "shift", "square", knots, values)
    problem = Problem(system, 0.1, {"a": a}, {"shift": 0.7}, {"gain": gain}, (law,))
    shift = 0.7 + np.interp(gain * a**2, knots, values)
    for solved in (solve(problem), step(problem)):
        assert solved.x.shape == (2, 0, 30)
        np.testing.assert_allclose(solved.outputs[:, 0], gain * a**2 + shift * a)
        np.testing.assert_allclose(solved.outputs[:, 1], shift**2 + gain)
        basis = np.random.default_rng(6).standard_normal((2, 3, 30))
        response = solved.respond(solved.direction("quantity", "shift", 1.0), basis)
        np.testing.assert_allclose(response[:, :, 0], basis * a[:, None], atol=1e-5)
        np.testing.assert_allclose(response[:, :, 1], 2 * basis * shift[:, None], atol=2e-5)
    plain = solve(replace(problem, laws=()))
    response = plain.respond(plain.direction("input", "a", 1.0), basis)
    np.testing.assert_allclose(response[:, :, 0], basis * (2 * gain * a + 0.7)[:, None], atol=2e-5)


def test_what_friction_holds_does_not_respond() -> None:
    """A change of a quantity within what it holds changes nothing, and beyond it lets go."""
    held = pose_slide(0.9, 300)
    basis = np.ones((1, 1, 301))
    solved = solve(held)
    np.testing.assert_array_equal(solved.respond(solved.direction("quantity", "pull", 1.0), basis), 0)
    for pull, moves in ((0.05, False), (0.3, True)):
        changed = solve(replace(held, quantities={"pull": pull}))
        assert bool(np.abs(changed.x).max() > 0) is moves


MASS = System(("s", "v"), ("s",), lambda x, u, q, p: (x.v, q.force + u.force), lambda u, q, p: (1.0, 0.0),
              lambda x, u, q, p: x.s, lowest=FREE)


def test_what_is_at_rest_in_all_runs_responds() -> None:
    solved = solve(Problem(MASS, 0.1, {"force": np.zeros((1, 50))}, {"force": 0.0}, {}))
    response = solved.respond(solved.direction("quantity", "force", 1.0), np.ones((1, 1, 50)))
    np.testing.assert_allclose(response[0, 0, 0], 0.5 * (0.1 * np.arange(50)) ** 2, atol=1e-5)


def test_a_run_without_a_trajectory_leaves_the_others_alone() -> None:
    problem = pose_spring()
    stepped, force = step(problem), problem.inputs["force"].copy()
    force[1, 7:] = np.nan
    solved = solve(replace(problem, inputs={"force": force}))
    assert np.isnan(solved.x[1, :, 8:]).all()
    for run in (0, 2):
        np.testing.assert_allclose(solved.x[run], stepped.x[run], atol=1e-9)
        np.testing.assert_allclose(solved.A[run], stepped.A[run], atol=1e-4)
        np.testing.assert_allclose(solved.C[run], stepped.C[run], atol=1e-4)


def test_responses_go_on_after_a_turn_without_a_rest() -> None:
    """Against what a large change of the force does to nonlinear solutions, which steps hardly influence."""
    problem = pose_slide(4.1)
    solved, basis = step(problem), np.ones((1, 1, 1201))
    response = solved.respond(solved.direction("input", "force", 1.0), basis)
    exact = differences(problem, "input", "force", basis, 0.05)
    np.testing.assert_allclose(response[0, 0, :, -1], exact[0, 0, :, -1], rtol=0.05)


def test_a_start_at_rest_may_be_changed() -> None:
    problem = pose_slide(1.5, 900)
    solved, basis = step(problem), np.ones((1, 1, 901))
    response = solved.respond(solved.direction("parameter", "begin", 1.0), basis)
    assert np.abs(response[0, 0, 1]).max() < 0.05


def test_states_need_no_lowest_values() -> None:
    system = System(SPRING.states, SPRING.signals, SPRING.rate, SPRING.start, SPRING.output)
    np.testing.assert_array_equal(solve(pose_spring(system=system)).x, solve(pose_spring()).x)


def test_equations_need_no_care_below_the_lowest_value() -> None:
    """As in the text of declarations, where a level is drained by its square root."""
    system = System(("level",), ("level",), lambda x, u, q, p: u.flow - 0.5 * np.sqrt(x.level) - 0.1,
                    lambda u, q, p: 0.3, lambda x, u, q, p: x.level, lowest=(0.0,))
    with np.errstate(invalid="ignore"):
        assert np.all(solve(Problem(system, 0.05, {"flow": np.zeros((1, 101))}, {}, {})).x >= 0)
