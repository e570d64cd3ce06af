"""What one part explains, others read as it bends between samples; and of noise alone nothing is known there."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.equations import refine
from slipstick.engine.fit import begin
from slipstick.engine.laws import GAIN, list_candidates
from slipstick.engine.model import build_part
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded, explain
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Runs, Sensor

RUNS, STEP, TIME, RISE, NOISE = 6, 0.01, np.arange(0, 1.005, 0.01), 0.015, 1e-4
FINE = 8


def declare() -> Machine:
    """A stage that follows its command within 1.5 samples, and one that integrates what it gives."""
    stage = Block("stage", gives="flow", reads=("command",), states=("flow",),
                  parameters=(Parameter("rise", "s", value=RISE, scatter=0.05),))
    stage.rate(lambda x, u, q, p: (u.command - x.flow) / p.rise)
    vessel = Block("vessel", gives="volume", reads=("flow",), states=("volume",),
                   parameters=(Parameter("share", value=1.0, scatter=0.05),))
    vessel.rate(lambda x, u, q, p: p.share * u.flow)
    return Machine("filling", (stage, vessel), (Sensor("flow"), Sensor("volume")), commands=(Command("command"),))


def fill(levels: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The flow and the volume (n, K) in closed form: the command jumps to each level (n, m) in turn."""
    length = TIME[-1] / levels.shape[1]
    flow, volume = (np.empty((len(levels), len(time))) for _ in range(2))
    start, held = np.zeros(len(levels)), np.zeros(len(levels))
    for place in range(levels.shape[1]):
        last = place + 1 == levels.shape[1]
        within = (time >= place * length - 1e-12) & ((time < (place + 1) * length - 1e-12) | last)
        for instants, behind in ((within, time[within] - place * length), (None, np.array([length]))):
            left = np.exp(-behind / RISE)
            here = levels[:, place, None] + (start - levels[:, place])[:, None] * left
            filled = held[:, None] + levels[:, place, None] * behind + RISE * (start - levels[:, place])[:, None] * (
                1 - left)
            if instants is not None:
                flow[:, instants], volume[:, instants] = here, filled
        start, held = here[:, -1], filled[:, -1]
    return flow, volume


@pytest.fixture(scope="module")
def filling() -> tuple[Recorded, np.ndarray, np.ndarray]:
    """The recordings, the flow at several instants a sample, and the volume at the samples."""
    rng = np.random.default_rng(8)
    levels = rng.uniform(-1, 1, (RUNS, 5))
    flow, _ = fill(levels, np.arange(FINE * (len(TIME) - 1) + 1) * STEP / FINE)
    volume = fill(levels, TIME)[1]
    jumps = np.linspace(0, TIME[-1], 6)[1:-1]
    corners = np.concatenate([[0], np.repeat(jumps, 2), TIME[-1:]])
    corners[2:-1:2] += 1e-9
    signals = {name: value + NOISE * rng.standard_normal(value.shape)
               for name, value in (("flow", flow[:, ::FINE]), ("volume", volume))}
    profile = Profile(np.tile(corners, (RUNS, 1)), np.repeat(levels, 2, axis=1))
    return prepare(declare(), Runs(TIME, signals, {"command": profile})), flow, volume


def is_off(recorded: Recorded, volume: np.ndarray) -> float:
    """How far the smooth volume is off, over the noise."""
    part = next(part for part in recorded.parts if part.name == "vessel")
    state = begin(recorded)
    model = build_part(recorded, part, replace(state, shared=0 * state.shared), {})  # no sensor is late
    return float(np.abs(model.trajectory.outputs[:, 0, ::part.fine] - volume).max() / NOISE)


def test_a_part_that_reads_what_another_gives_takes_as_many_steps(
        filling: tuple[Recorded, np.ndarray, np.ndarray]) -> None:
    stage, vessel = filling[0].parts
    assert vessel.fine == stage.fine > 1


def test_what_is_known_between_samples_drives_a_part_as_it_is(
        filling: tuple[Recorded, np.ndarray, np.ndarray]) -> None:
    recorded, flow, volume = filling
    known, sampled = explain(recorded, {"flow": flow}), explain(recorded, {"flow": flow[:, ::FINE]})
    assert is_off(known, volume) < 0.2
    assert is_off(sampled, volume) > 2


@pytest.mark.parametrize("by", [1, 2, FINE])
def test_explained_signals_and_what_is_beyond_are_what_was_measured(
        filling: tuple[Recorded, np.ndarray, np.ndarray], by: int) -> None:
    recorded, flow, _ = filling
    part = explain(recorded, {"flow": flow[:, ::by]}).parts[1]
    read = part.inputs["flow"][:, ::part.fine] + part.beyond["flow"]
    np.testing.assert_allclose(read, recorded.runs.signals["flow"], atol=1e-12)
    np.testing.assert_allclose(part.inputs["flow"][:, ::part.fine], flow[:, ::FINE], atol=1e-12)


def test_the_noise_of_an_input_acts_as_it_does_behind_its_sensor(
        filling: tuple[Recorded, np.ndarray, np.ndarray]) -> None:
    """Of a signal of which its sensor reads 20 % too much, noise is too large as well."""
    recorded = filling[0]
    vessel = recorded.parts[1]
    law = next(each for each in list_candidates(recorded, {part.name: {} for part in recorded.parts})
               if each.pair == ("flow sensor", GAIN))
    state = replace(begin(recorded), shared=np.zeros(len(recorded.shared)),
                    laws={law.pair: 0.2 * law.variable.knots / law.size})
    noise = NOISE * np.random.default_rng(3).standard_normal(vessel.beyond["flow"].shape)
    louder = replace(vessel, inputs={"flow": vessel.inputs["flow"] + refine(noise, vessel.fine)})
    quiet, loud = (build_part(recorded, part, state, {law.pair: replace(law, variables={"vessel": replace(
        law.variables["vessel"], values=part.inputs["flow"])})}) for part in (vessel, louder))
    change = (loud.trajectory.outputs - quiet.trajectory.outputs)[:, :, ::vessel.fine]
    # Beyond its outermost knots, the law is constant.
    np.testing.assert_allclose(quiet.carry({"flow": noise}), change, atol=0.03 * np.abs(change).max())
