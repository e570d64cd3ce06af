"""Fits of blocks from nominal values end at a maximum of their likelihood, on drawn machines."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from evidence.generator.case import Case, Hidden, bad_runs_of, simulate
from evidence.generator.files import write_recordings
from evidence.suites import draw_case
from slipstick.bench import Bench
from slipstick.naming.block import Pair
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import fit, fit_together
from slipstick.naming.full_fits import to_the_end, tried
from slipstick.naming.input import InputBlock
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Recordings
from tests.hidden_laws import CONVERTER_LAGS, law

FAST = 629
"""Seed of a machine with a delay of the valve of four samples, and a pressure sensor that is late by a whole one."""
STRONG: Pair = ("line pressure", "time")


@cache
def draw_machine(seed: int) -> Case:
    return draw_case("nothing_missing", seed)


def record_good_runs(seed: int, *hidden: Hidden) -> Scene:
    """The runs of a drawn machine with hidden laws, without errors of the recording."""
    case = replace(draw_machine(seed), hidden=hidden)
    run = simulate(case, relative=1e-6)
    with TemporaryDirectory() as folder:
        bench_file, recordings_file = Path(folder, "bench.toml"), Path(folder, "recordings.h5")
        bench_file.write_text(case.bench.text)
        write_recordings(recordings_file, case, run)
        scene = Scene.of(Bench.open(bench_file), Recordings.open(recordings_file), NamingSettings())
    return scene.take(np.setdiff1d(np.arange(len(scene)), [bad.run for bad in bad_runs_of(case, run.conditions)]))


@pytest.mark.slow
def test_a_fit_of_a_fast_valve_finds_a_late_clock() -> None:
    block = ValveBlock(record_good_runs(FAST))
    step, late = block.scene.step, draw_machine(FAST).deviations.clocks["pressure"]
    assert block.scene.value("current_delay") < 5 * step
    fitted = fit(block)
    assert fitted.shared[0] / step == pytest.approx(late, abs=0.05)
    assert np.mean(fitted.chi2) < 1.1
    begun = fit_together([block], [()], [None], iterations=2)[0]
    assert begun.shared[0] / step != pytest.approx(late, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "hidden"), [
    pytest.param(611, (), id="complete"),
    pytest.param(619, (CONVERTER_LAGS,), id="lags")])
def test_a_fit_that_goes_on_gains_nothing_unless_it_was_ended_early(seed: int, hidden: tuple[Hidden, ...]) -> None:
    block = InputBlock(record_good_runs(seed, *hidden))
    complete, early = fit(block), fit_together([block], [()], [None], iterations=2)[0]
    assert fit(block, start=complete).fitted.posterior == pytest.approx(complete.fitted.posterior, abs=1.0)
    assert fit(block, start=early).fitted.posterior > early.fitted.posterior + 100


@pytest.mark.slow
def test_a_pair_is_compared_roughly_and_then_fitted_to_the_end() -> None:
    pace = draw_machine(FAST).bench.pace
    falls = law("pressure_gain", "time", lambda t: 1 - 0.3 * np.exp(-((t / (0.3 * pace)) ** 1.5)), block="pressure")
    bare = fit(ValveBlock(record_good_runs(FAST, falls)))
    gain = gains([table(bare, [STRONG])], (), [STRONG])[0]
    rough = tried({"valve": bare}, gain, 0)
    complete = to_the_end({"valve": bare}, rough)
    again = to_the_end({"valve": bare}, complete)
    assert again.nats == pytest.approx(complete.nats, abs=1.0)
    assert 1.0 < complete.nats - rough.nats < 1e-3 * complete.nats
    assert complete.fits["valve"].points == pytest.approx(again.fits["valve"].points, abs=1e-3)
