"""Pairs that hardly any bench has: they compete where something is missing, and are named nowhere else."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.fit import fit
from slipstick.naming.forward import _lacking, _may_compete, _rare, forward
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SETTINGS = NamingSettings()
USUAL, RARE, ELSEWHERE = ("load torque", "pressure"), ("load torque", "current"), ("converter torque", "slip")
COUNT, SEED = 24, 5


def test_a_rare_pair_may_compete_where_a_usual_one_does_or_nothing_explains_a_block() -> None:
    def gain(pair: tuple[str, str], block: str) -> Any:
        return SimpleNamespace(pair=pair, blocks=(block,))

    def fits(chi_square: float) -> Any:
        its = np.full(24, chi_square) * np.random.default_rng(1).lognormal(0, 0.02, 24)
        return {"load": SimpleNamespace(chi2=np.ones(24)), "input": SimpleNamespace(chi2=its)}

    promising = [gain(RARE, "load"), gain(USUAL, "load"), gain(ELSEWHERE, "input")]
    assert _lacking(promising, {USUAL}, fits(1.0), SETTINGS) == {"load"}
    assert _lacking(promising, {USUAL}, fits(1.5), SETTINGS) == {"load", "input"}
    assert _lacking(promising[:1], {USUAL}, fits(1.0), SETTINGS) == set()


def test_rare_pairs_are_compared_in_blocks_that_lack_something_alone() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    blocks = {name: block_of(name, scene) for name in ("load", "input")}
    offered = {name: block.pairs() for name, block in blocks.items()}
    assert _rare((), blocks, offered) == {}
    found = _rare({"load"}, blocks, offered)
    assert RARE in found["load"]
    assert {quantity for quantity, _ in found["input"]} == {"output torque sensor"}  # which reads what drives both
    assert set(found["input"]) <= set(found["load"])
    assert _rare({"load"}, blocks, {name: [*offered[name], *its] for name, its in found.items()}) == {}


def test_a_delay_that_changes_is_not_named_beside_another_law_of_the_valve() -> None:
    block: Any = SimpleNamespace(scene=SimpleNamespace(of_runs=("run order",)))

    def may(pair: tuple[str, str], *laws: tuple[str, str]) -> bool:
        fits: Any = {"valve": SimpleNamespace(block=block, laws=laws)}
        gain: Any = SimpleNamespace(pair=pair, blocks=("valve",))
        return _may_compete(gain, (), {"valve"}, fits)

    assert may(("valve delay", "slip"))
    assert not may(("valve delay", "slip"), ("pressure sensor", "lag"))
    assert may(("valve delay", "run order"), ("pressure sensor", "lag"))
    assert may(("line pressure", "slip"), ("pressure sensor", "lag"))


def test_a_load_torque_over_the_current_is_no_other_one() -> None:
    law = MeasuredLaw(*RARE, (0.0, 0.3, 0.45, 0.6), (0.0, 0.0, 60.0, 20.0), relative=False)
    block = block_of("load", scene_of(HEAVY, Model(HEAVY.physics).with_law(law), COUNT, SEED))
    found = forward({"load": fit(block)}, SETTINGS)[1]
    assert [one.pair for one in found] == [RARE]
    assert RARE not in block.pairs()
    assert set(block.pairs()) < set(block.pairs(rare=True))
