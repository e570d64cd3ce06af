"""A block without states and without scatter: what one sensor reads is a function of what another one reads."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.laws import list_candidates
from slipstick.engine.noise import Noise, draw_noise
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.machine import Block, Machine, Parameter, Quantity, Runs, Sensor

RUNS, TIME = 24, np.linspace(0, 10, 101)


def record(bend: float) -> Runs:
    rng = np.random.default_rng(4)
    read = rng.uniform(1, 3, (RUNS, 1)) + np.sin(TIME + rng.uniform(0, 6, (RUNS, 1)))
    given = 2.1 * read + bend * np.maximum(read - 2.5, 0)
    return Runs(TIME, {"read": read + 1e-3 * rng.standard_normal(read.shape),
                       "given": given + 0.01 * rng.standard_normal(read.shape)}, order=np.arange(float(RUNS)))


def declare(without: tuple[str, ...] = ()) -> Machine:
    scale = Block("scale", gives="given", reads=("read",), parameters=(Parameter("factor", value=2.0, scatter=0.0),),
                  quantities=(Quantity("excess", size=0.5, without=("given",) if without else ()),))
    scale.output(lambda x, u, q, p: p.factor * u.read + q.excess)
    return Machine("scale", (scale,), (Sensor("given", without=without), Sensor("read", without=without)))


def test_nothing_is_named_where_nothing_is_missing() -> None:
    answer = identify(prepare(declare(), record(0.0)))
    assert not answer.findings
    assert not answer.unexplained


def test_a_law_over_a_further_channel_has_its_unit() -> None:
    runs = replace(record(0.0), channels={"oil temperature": np.arange(float(RUNS))}, units={"oil temperature": "degC"})
    recorded = prepare(declare(), runs)
    units = {variable.unit for candidate in list_candidates(recorded, {part.name: {} for part in recorded.parts})
             if candidate.pair[1] == "oil temperature" for variable in candidate.variables.values()}
    assert units == {"degC"}


@pytest.mark.slow
def test_an_error_of_the_input_over_its_signal_and_a_law_over_the_output_say_the_same() -> None:
    """The output is a monotonic function of the input."""
    answer = identify(prepare(declare(), record(1.0)))
    finding, = answer.findings
    assert finding.pair == ("read sensor", "gain")
    assert finding.rivals == (("excess", "given"),)
    assert not answer.unexplained


@pytest.mark.slow
def test_a_law_over_the_input_is_named_where_others_are_excluded() -> None:
    recorded = prepare(declare(without=("read", "given")), record(1.0))
    assert identify(recorded).findings[0].pair == ("excess", "read")


def test_a_law_is_named_where_parameters_of_runs_stand_for_it() -> None:
    """In a third of the tests a ratio is a fifth of what is stated, far outside of its scatter between runs.

    A fit without laws has a ratio for each run, from where no step of all runs leads to the law.
    """
    rng, time = np.random.default_rng(1), np.arange(60) * 0.02
    force = 600 * np.sin(2 * np.pi * rng.uniform(0.3, 1, (36, 1)) * time + rng.uniform(0, 6, (36, 1)))
    test = np.arange(36.0) % 3
    ratio = 2 * np.exp(0.02 * rng.standard_normal((36, 1))) * np.where(test < 1, 0.2, 1.0)[:, None]
    held = 10 + 5 * rng.standard_normal((36, 1)) + force / ratio
    arms = Block("arms", gives="held", reads=("force",), parameters=(
        Parameter("ratio", value=2.0, within=0.1, scatter=0.05),
        Parameter("slack", value=10.0, scale=10.0, within=1.0, scatter=1.0)),
        quantities=(Quantity("ratio of the arms", relative=True),))
    arms.output(lambda x, u, q, p: p.slack + u.force / (p.ratio * (1 + q.ratio_of_the_arms)))
    runs = Runs(time, {"force": force + 0.5 * rng.standard_normal(force.shape),
                       "held": held + draw_noise(Noise(0.3, 0.99), force.shape, rng)}, channels={"test": test})
    finding, = identify(prepare(Machine("arms", (arms,), (Sensor("force"), Sensor("held"))), runs)).findings
    assert finding.pair == ("ratio of the arms", "test")
    assert finding.nats > 500
