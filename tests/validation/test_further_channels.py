"""Laws over a further recorded channel: what depends on it is named by it, and by nothing else if it does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.naming import NamingSettings, answer, name
from slipstick.naming.scene import Scene
from slipstick.naming.study import Naming
from slipstick.recordings import FurtherChannel, Recordings
from tests.benches import HEAVY
from tests.validation.hidden import Case, write

COUNT = 36
STRENGTH = 0.2


def recorded(folder: Path, seed: int, of: str) -> tuple[Recordings, np.ndarray]:
    """Recordings whose piston gain warms with the run order, and a temperature `of` that order or of chance."""
    write(folder / "case.h5", Case({"oil_temperature_piston": STRENGTH}, seed=seed, count=COUNT))
    found = Recordings.open(folder / "case.h5")
    assert found.signals is not None
    assert found.run_order is not None
    random = np.random.default_rng(seed)
    share = found.run_order / (COUNT - 1)
    warm = {"order": 40 + 50 * share, "chance": 40 + 50 * random.random(COUNT)}[of]
    noise = random.normal(0, 0.5, (COUNT, len(found.signals.time)))
    channel = FurtherChannel("degC", warm[:, None] + noise)
    conditions = replace(found.conditions, run_order=None)  # the test has no record of the order
    return replace(found, conditions=conditions, run_order=None, further={"oil_temperature": channel}), share


def pairs_of(found: Naming) -> list[tuple[str, str]]:
    return [one.pair for one in found.findings]


@pytest.mark.slow
def test_a_gain_that_warms_is_a_law_over_the_oil_temperature(tmp_path: Path) -> None:
    recordings, share = recorded(tmp_path, 714, "order")
    found = name(HEAVY, recordings)
    assert pairs_of(found) == [("piston gain", "oil temperature")]
    said = answer(found.findings[0], found.measured["piston gain", "oil temperature"])
    assert (said.kind, said.effect) == ("unlisted", "")
    law = found.measured["piston gain", "oil temperature"]
    assert (law.x_unit, law.relative) == ("degC", True)
    true = STRENGTH * (1.25 * share - 0.25 * share**2)
    measured = np.interp(40 + 50 * share, law.x, law.change)
    assert np.std(measured - true) < 0.2 * np.std(true)


@pytest.mark.slow
def test_a_temperature_that_nothing_depends_on_is_not_named(tmp_path: Path) -> None:
    recordings, _ = recorded(tmp_path, 714, "chance")
    assert not [pair for pair in pairs_of(name(HEAVY, recordings)) if pair[1] == "oil temperature"]


def test_gaps_do_not_count_and_a_channel_without_values_is_not_used(tmp_path: Path) -> None:
    recordings, _ = recorded(tmp_path, 714, "order")
    channel = recordings.further["oil_temperature"]
    gap, lost = channel.values.copy(), channel.values.copy()
    gap[3, 7:20], lost[3] = np.nan, np.nan
    whole = Scene.of(HEAVY, recordings, NamingSettings())
    assert whole.unused == []
    changed = ({"oil_temperature": replace(channel, values=one)} for one in (gap, lost))
    with_gap, without = (replace(whole, recordings=replace(recordings, further=its)) for its in changed)
    np.testing.assert_allclose(with_gap.channels["oil temperature"][0], whole.channels["oil temperature"][0], atol=0.2)
    assert (without.channels, without.unused) == ({}, ["oil_temperature"])
