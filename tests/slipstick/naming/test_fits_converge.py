"""Fits of blocks from nominal values end at a maximum of their likelihood, also where they used to end before it."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.benches import BENCHES
from slipstick.naming.block import Pair
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import fit
from slipstick.naming.full_fits import to_the_end, tried
from slipstick.naming.input import InputBlock
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Recordings
from tests.validation.hidden import cases, files
from tests.validation.hidden.truths import truth

STRONG: Pair = ("line pressure", "time")


def good_runs(folder: Path, which: str, identity: str) -> Scene:
    """The engagements of a hidden case without errors of the recording."""
    case = cases.LISTS[which][identity]
    files.write(folder / "case.h5", case, relative=1e-6)
    scene = Scene.of(BENCHES[case.bench], Recordings.open(folder / "case.h5"), NamingSettings())
    bad = [one["run"] for one in truth(case, relative=1e-6)["bad_runs"]]
    return scene.take(np.setdiff1d(np.arange(len(scene)), bad))


def test_a_fit_of_a_fast_valve_finds_a_late_clock(tmp_path: Path) -> None:
    found = fit(ValveBlock(good_runs(tmp_path, "distant", "t133")))
    late = cases.LISTS["distant"]["t133"].world.clocks["pressure"]
    assert found.shared[0] / found.block.scene.step == pytest.approx(late, abs=0.05)
    assert np.mean(found.chi2) < 1.1


@pytest.mark.parametrize("identity", [pytest.param("s044", marks=pytest.mark.slow), "s074"])
def test_a_fit_that_goes_on_gains_nothing(tmp_path: Path, identity: str) -> None:
    found = fit(InputBlock(good_runs(tmp_path, "outlying", identity)))
    again = fit(found.block, start=found)
    assert again.fitted.posterior == pytest.approx(found.fitted.posterior, abs=1.0)


def test_a_pair_is_compared_roughly_and_then_fitted_to_the_end(tmp_path: Path) -> None:
    bare = fit(ValveBlock(good_runs(tmp_path, "alpine", "z033")))
    one = gains([table(bare, [STRONG])], (), [STRONG])[0]
    rough = tried({"valve": bare}, one, 0)
    done = to_the_end({"valve": bare}, rough)
    again = to_the_end({"valve": bare}, done)
    assert again.nats == pytest.approx(done.nats, abs=1.0)
    assert 1.0 < done.nats - rough.nats < 1e-3 * done.nats
    assert done.its["valve"].points == pytest.approx(again.its["valve"].points, abs=1e-3)
