"""Pairs that hardly any bench has: they compete where something is missing, and are named nowhere else."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.fit import fit
from slipstick.naming.forward import _worth_trying, forward
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SETTINGS = NamingSettings()
USUAL, RARE, ELSEWHERE = ("load torque", "pressure"), ("load torque", "current"), ("converter torque", "slip")
COUNT, SEED = 24, 5


def test_a_rare_pair_is_tried_beside_a_usual_one_or_in_a_block_that_is_not_explained() -> None:
    def gain(pair: tuple[str, str], block: str) -> Any:
        return SimpleNamespace(pair=pair, blocks=(block,))

    def fits(chi_square: float) -> Any:
        its = np.full(24, chi_square) * np.random.default_rng(1).lognormal(0, 0.02, 24)
        return {"load": SimpleNamespace(chi2=np.ones(24)), "input": SimpleNamespace(chi2=its)}

    promising = [gain(RARE, "load"), gain(USUAL, "load"), gain(ELSEWHERE, "input")]
    assert _worth_trying(promising, {USUAL}, fits(1.0), SETTINGS) == promising[:2]
    assert _worth_trying(promising, {USUAL}, fits(1.5), SETTINGS) == promising
    assert _worth_trying(promising[:1], {USUAL}, fits(1.0), SETTINGS) == []


def test_a_load_torque_over_the_current_is_no_other_one() -> None:
    law = MeasuredLaw(*RARE, (0.0, 0.3, 0.45, 0.6), (0.0, 0.0, 60.0, 20.0), relative=False)
    block = block_of("load", scene_of(HEAVY, Model(HEAVY.physics).with_law(law), COUNT, SEED))
    found = forward({"load": fit(block)}, SETTINGS)[1]
    assert [one.pair for one in found] == [RARE]
    usual = block_of("load", replace(block.scene))
    before = usual.pairs()
    assert RARE not in before
    assert set(before) < set(block.pairs())
