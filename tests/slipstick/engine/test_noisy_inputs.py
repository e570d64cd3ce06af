"""What a fit learns of a clock from the noise of a measured input: nothing."""

from dataclasses import replace

import numpy as np

from slipstick.engine.fit import begin
from slipstick.engine.model import build_part
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.machine import Block, Machine, Parameter, Runs, Sensor

RUNS, STEP, SAMPLES, LATE, RATE = 30, 0.01, 401, 0.5, 4.0
NOISE = {"drive": 0.3, "level": 0.003}


def record() -> Recorded:
    """A stage that follows a slow signal, which a loud sensor reads half a sample late; so is what it gives read."""
    stage = Block("stage", gives="level", reads=("drive",), states=("level",), parameters=(
        Parameter("pace", "1/s", value=RATE),))
    stage.rate(lambda x, u, q, p: p.pace * (u.drive - x.level))
    stage.start(lambda u, q, p: 0.0)
    rng = np.random.default_rng(9)
    time, frequency = np.arange(SAMPLES) * STEP, rng.uniform(1.0, 3.0, (RUNS, 1))
    at, square = np.maximum(time - LATE * STEP, 0), RATE**2 + frequency**2
    level = RATE * (RATE * np.sin(frequency * at) - frequency * np.cos(frequency * at)
                    + frequency * np.exp(-RATE * at)) / square
    signals = {name: values + NOISE[name] * rng.standard_normal(values.shape)
               for name, values in (("drive", np.sin(frequency * at)), ("level", level))}
    machine = Machine("stage", (stage,), (Sensor("drive"), Sensor("level")))
    return prepare(machine, Runs(time, signals, {}))


def test_a_clock_is_not_what_cancels_the_noise_of_an_input() -> None:
    """Were only what is smooth of the noise late, it would cancel some of the rest: the slope would be 7 deviations."""
    recorded = record()
    state = replace(begin(recorded), shared=np.full(len(recorded.shared), LATE))
    model = build_part(recorded, recorded.parts[0], state, {})
    column, residual = model.rows[:, model.keys.index(("clock", "stage: drive"))], model.rows[:, -1]
    assert abs((column * residual).sum()) < 3 * np.sqrt((column**2).sum())
