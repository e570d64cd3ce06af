"""A block without states and without scatter: what one sensor reads is a function of what another one reads."""

import numpy as np

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


def test_an_error_of_the_input_over_its_signal_and_a_law_over_the_output_say_the_same() -> None:
    """The output is a monotonic function of the input."""
    answer = identify(prepare(declare(), record(1.0)))
    finding, = answer.findings
    assert finding.pair == ("read sensor", "gain")
    assert finding.rivals == (("excess", "given"),)
    assert not answer.unexplained


def test_a_law_over_the_input_is_named_where_others_are_excluded() -> None:
    recorded = prepare(declare(without=("read", "given")), record(1.0))
    assert identify(recorded).findings[0].pair == ("excess", "read")
