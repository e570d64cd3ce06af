"""Columns of the linear model against differences of its predictions, which are whitened as the columns are.

Parts are driven by their smooth inputs: the columns are then those of the trajectory that predicts.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from slipstick.engine.bases import Variable
from slipstick.engine.equations import refine
from slipstick.engine.laws import GAIN, LAG, PAST, Candidate, list_candidates
from slipstick.engine.model import PartModel, State, build_part, key_of_law, nominal_own_values, touches
from slipstick.engine.preparation import prepare
from slipstick.engine.products import expand
from slipstick.engine.recordings import Pair, Part, Recorded
from slipstick.engine.simulation import simulate
from slipstick.engine.trajectory import Trajectory
from slipstick.machine import Profile, Runs, open_machine
from slipstick.machine.whole import compose

TABLES = Path(__file__).parents[3] / "tables" / "machines"
RUNS = 6
STEP = 1e-5  # over larger ones, a motor comes to rest a step earlier
NOISE = {"level 1": 2e-3, "level 2": 2e-3, "current": 3e-3, "speed": 0.1}


def drive(rng: np.random.Generator, end: float, low: float, high: float) -> dict[str, Profile]:
    return {"voltage": Profile(np.tile(np.linspace(0, end, 7), (RUNS, 1)), rng.uniform(low, high, (RUNS, 7)))}


@cache
def record(name: str) -> Recorded:
    """The shipped machine with runs that it simulates itself, driven by smooth signals; "whole" is one part of all."""
    is_whole, name = name.startswith("whole "), name.removeprefix("whole ")
    machine = open_machine(TABLES / f"{name}.py")
    rng = np.random.default_rng(4)
    if name == "two_tanks":
        time, commands, stated = np.linspace(0, 60, 121), drive(rng, 60, 3, 9), {}
        values = {"start 1": rng.uniform(0.3, 0.7, RUNS), "start 2": rng.uniform(0.2, 0.4, RUNS)}
    else:
        time, commands = np.linspace(0, 0.6, 301), drive(rng, 0.6, -8, 8)
        values = stated = {"load torque": np.repeat([0.005, 0.01], RUNS // 2)}
    signals = simulate(machine, time, commands, values)
    measured = {signal: value + NOISE[signal] * rng.standard_normal(value.shape)
                for signal, value in signals.items() if signal in NOISE}
    order = np.array([3.0, 0, 5, 1, 4, 2])
    recorded = prepare(compose(machine) if is_whole else machine, Runs(time, measured, commands, stated, order=order),
                       is_free=is_whole)
    return replace(recorded, parts=tuple(
        replace(part, beyond={name: 0 * value for name, value in part.beyond.items()}) for part in recorded.parts))


@cache
def candidates_of(name: str) -> dict[Pair, Candidate]:
    recorded = record(name)
    listed = list_candidates(recorded, {part.name: nominal_own_values(part) for part in recorded.parts})
    return {each.pair: widen(each.coarse()) for each in listed}


def is_own(law: Candidate) -> bool:
    return any(variable.kind == "own" for variable in law.variables.values())


def widen(law: Candidate) -> Candidate:
    """A law over own variables without the bend at its outermost knots."""
    def wide(variable: Variable) -> Variable:
        reach = np.zeros(len(variable.knots))
        reach[[0, -1]] = -0.2 * np.ptp(variable.knots), 0.2 * np.ptp(variable.knots)
        return replace(variable, knots=variable.knots + reach)

    if not is_own(law):
        return law
    return replace(law, variables={name: wide(variable) for name, variable in law.variables.items()})


def begin(recorded: Recorded, laws: dict[Pair, Candidate]) -> State:
    """A state beside the nominal one, with a wave of each law, or a line of those that bend where they are read."""
    rng = np.random.default_rng(5)
    points = 0.02 * rng.standard_normal((len(recorded), len(recorded.random)))
    # Of clocks with 0.37 samples, none is at a sample or at a part of one, where the slope bends.
    shared = np.array([0.37 if term.kind == "clock" else 0.02 for term in recorded.shared])
    return State(points, points.mean(axis=0), shared, {pair: 0.02 * draw_form(law) for pair, law in laws.items()})


def draw_form(law: Candidate) -> np.ndarray:
    wave = np.cos(1.3 * np.arange(law.count) + 0.4)
    if is_own(law):
        return line(law)
    if law.variable.kind == "lags":  # without what bends
        return np.where(np.arange(law.count) < sum(law.variable.families[:2]), wave, 0.0)
    return wave


def line(law: Candidate) -> np.ndarray:
    knots = law.variable.knots
    return np.asarray(0.3 + (knots - knots.mean()) / np.ptp(knots))


def moved(state: State, recorded: Recorded, direction: np.ndarray) -> State:
    """The state with all its coefficients moved along a direction (c,)."""
    ends = np.cumsum([len(recorded.random), len(recorded.shared), *(len(c) for c in state.laws.values())])[:-1]
    random, shared, *laws = np.split(direction, ends)
    return replace(state, points=state.points + random, shared=state.shared + shared, laws={
        pair: c + by for (pair, c), by in zip(state.laws.items(), laws, strict=True)})


def columns_of(recorded: Recorded, model: PartModel, laws: dict[Pair, Candidate]) -> np.ndarray:
    """Whitened columns (n, c, o k) of all coefficients."""
    onto = expand(recorded, model, laws, model.state)
    return np.asarray(onto[:, :, :-1].transpose(0, 2, 1) @ model.rows)


def differ(recorded: Recorded, part: Part, model: PartModel, laws: dict[Pair, Candidate],
           direction: np.ndarray) -> np.ndarray:
    """Whitened differences (n, o k) of the predictions at both sides of a state."""
    ahead, behind = (build_part(recorded, part, moved(model.state, recorded, by * direction), laws).predicted
                     for by in (1, -1))
    return model.white((0.5 * (ahead - behind))[:, None])[:, 0]


LAWS: dict[str, list[tuple[Pair, ...]]] = {
    "two_tanks": [
        (), (("leak 1", "level 1"),), (("outflow 1", "level 1"),), (("outflow 2", "level 1"),),
        (("outflow 1", "run order"), ("overflow", "time")), (("pump flow", "voltage"),),
        (("pump flow", PAST + "voltage"),), (("level 1 sensor", GAIN),), (("level 1 sensor", LAG),),
        (("level 2 sensor", GAIN), ("leak 2", "level 2")), (("level 2 sensor", LAG),), (("level 1 sensor", "level 2"),),
        (("level 1 sensor", "voltage"),), (("level 1 sensor", "run order"), ("level 2 sensor", "run order"))],
    "dc_motor": [
        (), (("friction torque", "speed"),), (("torque constant", "current"),), (("viscous friction", "load torque"),),
        (("resistance", PAST + "voltage"),), (("dry friction", "position"),), (("current sensor", GAIN),),
        (("speed sensor", LAG),), (("speed sensor", GAIN), ("voltage", "run order"))],
    "whole two_tanks": [(("level 1 sensor", "level 2"),), (("level 2 sensor", "level 1"), ("level 2 sensor", GAIN))],
    "whole dc_motor": [(("current sensor", "speed"),)]}


@pytest.mark.parametrize(("name", "pairs"), [(name, pairs) for name, listed in LAWS.items() for pairs in listed])
def test_columns_are_differences_of_predictions(name: str, pairs: tuple[Pair, ...]) -> None:
    recorded, laws = record(name), {pair: candidates_of(name)[pair] for pair in pairs}
    state, rng, terms = begin(recorded, laws), np.random.default_rng(6), (*recorded.random, *recorded.shared)
    for part in recorded.parts:
        model = build_part(recorded, part, state, laws)
        columns = columns_of(recorded, model, laws)
        norms = np.sqrt(np.einsum("nck,nck->c", columns, columns))
        acting, count, first = np.flatnonzero(norms), len(norms), len(terms)
        assert {terms[place].name for place in acting if place < first} == {
            term.name for term in terms if touches(term, part)}
        directions = [np.eye(count)[place] for place in acting if place < first]
        for law in laws.values():  # all coefficients of a law at once
            inside = acting[(acting >= first) & (acting < first + law.count)]
            assert bool(len(inside)) == (part.name in law.variables)
            direction = np.zeros(count)
            if is_own(law):  # hats bend within steps
                direction[first:first + law.count] = line(law)
            else:  # of columns of the same size
                direction[inside] = rng.standard_normal(len(inside)) / norms[inside]
            directions += [direction] * bool(len(inside))
            first += law.count
        for direction in directions:
            small = STEP * direction / np.abs(direction).max()
            moving = [term.name for place, term in enumerate(terms) if direction[place]]
            if moving and any(leaps(law, part) for law in laws.values()) and "clock" not in moving[0]:
                continue
            assert compare(recorded, part, model, laws, columns, small) < 1e-3, (part.name, moving or pairs)


def leaps(law: Candidate, part: Part) -> bool:
    """Whether a sensor reads a jump: derivatives of what it reads are differences over a part of the range."""
    return key_of_law(law, part)[0] == "sensor" and law.variable.jumps


def compare(recorded: Recorded, part: Part, model: PartModel, laws: dict[Pair, Candidate], columns: np.ndarray,
            direction: np.ndarray) -> float:
    """The difference of predictions, less the columns, over the difference."""
    exact = differ(recorded, part, model, laws, direction)
    return float(np.linalg.norm(exact - np.einsum("c,nck->nk", direction, columns)) / np.linalg.norm(exact))


def finer(part: Part, by: int) -> Part:
    """The part with more steps in a sample."""
    inputs = {name: refine(value, by) for name, value in part.inputs.items()}
    return replace(part, fine=by * part.fine, step=part.step / by, inputs=inputs)


def compare_bent(name: str, block: str, pair: Pair) -> list[float]:
    """The errors of columns of a law whose hats bend within steps, with as many steps, and two and four times more."""
    recorded, laws = record(name), {pair: candidates_of(name)[pair]}
    state, off = begin(recorded, laws), list[float]()
    coarse = next(part for part in recorded.parts if part.name == block)
    direction = np.zeros(len(recorded.random) + len(recorded.shared) + laws[pair].count)
    direction[-laws[pair].count:] = STEP * np.random.default_rng(6).standard_normal(laws[pair].count)
    for by in (1, 2, 4):
        part = finer(coarse, by)
        taken = replace(recorded, parts=(part,))
        model = build_part(taken, part, state, laws)
        off.append(compare(taken, part, model, laws, columns_of(taken, model, laws), direction))
    return off


@pytest.mark.parametrize(("name", "block", "pair"), [
    ("two_tanks", "tank 1", ("leak 1", "level 1")), ("two_tanks", "tank 2", ("level 1 sensor", "level 2")),
    ("dc_motor", "winding", ("torque constant", "current")), ("dc_motor", "winding", ("resistance", "current"))])
def test_columns_of_laws_over_own_variables_bend_within_steps(
        name: str, block: str, pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    bent = compare_bent(name, block, pair)
    assert bent[0] < 3e-4
    assert bent[2] < 1e-6
    monkeypatch.setattr(Trajectory, "halfway", None)  # as where a step may meet a surface
    assert compare_bent(name, block, pair)[0] > 10 * bent[0]


def test_columns_of_bent_laws_are_linear_within_steps_that_may_meet_a_surface() -> None:
    """A hat that bends within a step is a line there: what is wrong goes away with the length of the steps."""
    off = compare_bent("dc_motor", "shaft", ("friction torque", "speed"))
    assert off[0] < 1e-2
    assert off[2] < 0.4 * off[0]


def test_every_law_of_a_whole_machine_acts_on_what_its_columns_say() -> None:
    """Over what it depends on in the part of all blocks, which have several states and signals."""
    recorded = record("whole two_tanks")
    part, = recorded.parts
    for pair, law in candidates_of("whole two_tanks").items():
        laws = {pair: law}
        model = build_part(recorded, part, begin(recorded, laws), laws)
        direction = np.zeros(len(recorded.random) + len(recorded.shared) + law.count)
        direction[-law.count:] = STEP * draw_form(law)
        assert compare(recorded, part, model, laws, columns_of(recorded, model, laws), direction) < 0.02, pair
