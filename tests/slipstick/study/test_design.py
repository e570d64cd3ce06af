"""What a study moves is in units of its bench: effects have the bounds and typical values there."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.clutch.laws import MeasuredLaw
from slipstick.study import rounds, score
from slipstick.study.design import Design
from tests.benches import BENCHES, COMPACT, HEAVY

DRAG, LOAD = "quadratic_load_drag", "falling_load_friction"


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_a_coefficient_moves_in_typical_values_on_the_bench(bench: Bench) -> None:
    design, (drag,) = Design(bench, (), (), (DRAG,)), effects.find(DRAG).on(bench.scales).coefficients
    moved, = design.unknowns
    assert (moved.lower * drag.typical, moved.upper * drag.typical) == pytest.approx((drag.lower, drag.upper))
    coefficients = design.vectors(np.array([[2.0]]))[1]
    assert coefficients[0, effects.index(DRAG, "drag")] == pytest.approx(2 * drag.typical)
    assert design.model(np.array([2.0])).effects == {DRAG: {"drag": pytest.approx(2 * drag.typical)}}


def test_every_model_of_a_study_has_the_measured_laws_of_its_design() -> None:
    law = MeasuredLaw("load torque", "output speed", (0.0, 60.0), (0.0, 30.0), relative=False)
    design = Design(HEAVY, ("pressure_bias",), (), (DRAG,), laws=(law,))
    assert design.base.laws == design.model(np.ones(2)).laws == (law,)


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_a_probe_moves_a_share_of_the_typical_value_on_the_bench(bench: Bench) -> None:
    probe, = score.probes([DRAG], bench)
    moved = probe.moved(effects.neutral()[None])[0, effects.index(DRAG, "drag")]
    assert moved == pytest.approx(probe.step * effects.find(DRAG).on(bench.scales).typical[0])
    decays = sorted({dict(one.shape)["decay_speed"] for one in score.probes([LOAD], bench)})
    assert decays[1] == pytest.approx(effects.find(LOAD).on(bench.scales).typical[2])


def test_a_candidate_starts_at_the_shape_of_its_probe_on_the_bench() -> None:
    for bench in BENCHES:
        probes = [{"effect": one.effect, "coefficient": one.coefficient, "shape": dict(one.shape), "gain": 1.0,
                   "estimate": 0.5, "selected": 0.0} for one in score.probes([LOAD], bench)]
        shapes = [start["decay_speed"] for start in rounds.candidate(bench, probes, LOAD)["starts"]]
        np.testing.assert_allclose(shapes, [1 / 3, 1, 3], rtol=1e-9)


def test_the_study_of_an_unusual_bench_starts_within_its_bounds() -> None:
    conditions = replace(HEAVY.conditions, motor_speed=np.full(len(HEAVY.conditions), 10.0))
    decay = Design(replace(HEAVY, conditions=conditions), (), (), (LOAD,)).unknowns[2]
    assert decay.start == decay.upper
    assert Design(COMPACT, (), (), (LOAD,)).unknowns[2].start < Design(HEAVY, (), (), (LOAD,)).unknowns[2].start
