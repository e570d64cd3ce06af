"""Which of several pairs that were fitted is chosen, and which pairs are asked for at all."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming import choice, full_fits
from slipstick.naming import closed as closed_module
from slipstick.naming.block import Pair
from slipstick.naming.choice import Choice
from slipstick.naming.closed import closed
from slipstick.naming.fit import fit
from slipstick.naming.forward import _lacking, _may_compete, _rare, forward
from slipstick.naming.full_fits import Tried
from slipstick.naming.selection import Finding, is_enough
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SETTINGS, COUNT, BLOCK, OTHER = NamingSettings(), 24, "load", "contact"
FEW, MOST = ("load torque", "output speed"), ("load torque", "time")
ROUGH = np.where(np.arange(COUNT) < 3, 400.0, -2.0)  # 1,158 nats by three engagements


def chosen_beside(monkeypatch: pytest.MonkeyPatch, rises: dict[Pair, np.ndarray], chi_square: float = 1.0,
                  finer: dict[Pair, float] | None = None,
                  blocks: dict[Pair, tuple[str, ...]] | None = None,
                  usual: tuple[Pair, ...] | None = None) -> tuple[Pair, int]:
    """The pair that is chosen where the pairs rise like this, `finer` times as much by each doubling, and its fineness.

    Pairs act on `blocks`, by default on one, and are `usual` unless some are given.
    """
    chi2, gain, acts = np.full(COUNT, chi_square), finer or {}, blocks or {}

    def tried(fits: Any, one: Any, times: int) -> Tried:
        block = SimpleNamespace(finer={one.pair: times})
        its: Any = {name: SimpleNamespace(chi2=chi2, block=block) for name in one.blocks}
        return Tried(one, rises[one.pair] * gain.get(one.pair, 1.0) ** times, its)

    monkeypatch.setattr(choice, "tried", tried)
    monkeypatch.setattr(choice, "to_the_end", lambda fits, one: one)
    monkeypatch.setattr(choice, "is_enough_with", lambda fits, its, one, settings: is_enough(one.gain, settings))
    monkeypatch.setattr(full_fits, "expected_of", lambda *_: None)
    block = SimpleNamespace(finer={}, fine=17, scene=SimpleNamespace(channels=(), settings=SETTINGS))
    fits: Any = {name: SimpleNamespace(block=block, chi2=np.full(COUNT, 5.0)) for name in (BLOCK, OTHER)}
    compared: Any = [SimpleNamespace(pair=pair, blocks=acts.get(pair, (BLOCK,)), nats=rise, agreement=5.0)
                     for pair, rise in rises.items()]
    its = Choice(fits, compared, compared, tuple(rises) if usual is None else usual, SETTINGS, lambda _: None)
    finding, changed = its.settled(compared[0], compared[1:])
    return finding.pair, changed[finding.blocks[0]].block.finer[finding.pair]


def test_what_few_engagements_show_gives_way_to_what_most_do(monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen_beside(monkeypatch, {FEW: ROUGH, MOST: np.full(COUNT, 30.0)})[0] == MOST
    assert chosen_beside(monkeypatch, {FEW: np.full(COUNT, 48.0), MOST: np.full(COUNT, 30.0)})[0] == FEW
    assert chosen_beside(monkeypatch, {FEW: ROUGH, MOST: np.full(COUNT, 10.0)})[0] == FEW  # far smaller


def test_a_rare_pair_is_chosen_only_if_it_leads_a_usual_one(monkeypatch: pytest.MonkeyPatch) -> None:
    least = np.full(COUNT, 30.0)
    for more, expected in ((0.4, MOST), (2.0, FEW)):  # 10 and 48 nats
        rises = {FEW: least + more, MOST: least}
        assert chosen_beside(monkeypatch, rises, usual=(MOST,))[0] == expected
        assert chosen_beside(monkeypatch, rises)[0] == FEW


def test_a_pair_that_separate_ones_outdo_does_not_decide_in_their_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    joint, contact = ("output torque sensor", "time"), ("friction coefficient", "heat")
    blocks = {joint: (BLOCK, OTHER), contact: (OTHER,)}
    few = np.arange(COUNT) < 3
    rises = {joint: np.where(few, 1000.0, -2.0), contact: np.where(few, 800.0, -1.0), MOST: np.full(COUNT, 40.0)}
    assert chosen_beside(monkeypatch, rises, blocks=blocks)[0] == MOST
    better = {**rises, FEW: np.full(COUNT, 60.0)}  # than MOST, in the same block
    assert chosen_beside(monkeypatch, better, blocks=blocks)[0] == FEW
    assert chosen_beside(monkeypatch, {**rises, MOST: ROUGH / 10}, blocks=blocks)[0] == joint


def test_pairs_get_more_knots_where_their_block_is_not_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    rises, finer = {FEW: np.full(COUNT, 48.0), MOST: np.full(COUNT, 30.0)}, {MOST: 2.0}
    assert chosen_beside(monkeypatch, rises, 1.0, finer) == (FEW, 0)
    assert chosen_beside(monkeypatch, rises, 3.0, finer) == (MOST, 3)  # from 17 to 129 knots over the time
    assert chosen_beside(monkeypatch, rises, 3.0, {MOST: 1.02}) == (FEW, 0)  # a doubling that gains less than 3 %
    assert chosen_beside(monkeypatch, {**rises, MOST: np.full(COUNT, 20.0)}, 3.0, {MOST: 4.0}) == (FEW, 0)  # far behind


# The closing piston is also asked without what full contact alone suggested, where that leaves it unexplained.


FRICTION, LAG = ("friction coefficient", "pressure"), ("friction lag", "slip")
EXPLAINED, MISFIT = np.full(COUNT, 1.0), np.full(COUNT, 3.0)


def finding(pair: Pair, *blocks: str) -> Finding:
    return Finding(blocks, pair, np.full(COUNT, 10.0))


@dataclass(frozen=True, eq=False)
class Fitted:
    """What is asked of a fit: its evidence (n,) in nats, chi-square (n,), and laws, of one nat of leverage each."""

    evidence: np.ndarray
    chi2: np.ndarray
    laws: tuple[Pair, ...]
    block: Any = None

    def leverage(self, _: Pair) -> np.ndarray:
        return np.full(COUNT, 1.0)


def fitted(evidence: float, chi2: np.ndarray, *laws: Pair) -> Any:
    return Fitted(np.full(COUNT, evidence), chi2, laws)


def asked(monkeypatch: pytest.MonkeyPatch, suggested: Finding, beside: Any, instead: Any) -> tuple[Any, list[Pair]]:
    """The clutch and the names where full contact has `suggested` one, `beside` which the piston has this fit.

    `instead` is that without it.
    """
    contact: Any = SimpleNamespace(laws=(suggested.pair,), chi2=EXPLAINED, block=SimpleNamespace(fine=9, finer={}))
    piston = SimpleNamespace(with_explained_speeds=lambda _: SimpleNamespace(), onset=SimpleNamespace(points=None))
    start: Any = SimpleNamespace(closing=piston, valve=None)

    def closing(begun: Any, settings: Any, ask: Any, named: list[Finding], _: Any) -> Any:
        return (beside, named) if FRICTION in begun.laws else (instead, [*named, finding(LAG, "clutch")])

    monkeypatch.setattr(closed_module, "closing", closing)
    monkeypatch.setattr(closed_module, "_searched", lambda *_: [])
    monkeypatch.setattr(closed_module, "followed", lambda now, *_: now)
    monkeypatch.setattr(closed_module, "_settled", lambda block, _, places, laws: fitted(
        -100.0 if FRICTION in laws else -200.0, MISFIT, *laws))
    clutch, findings = closed(start, {"contact": contact}, [suggested], NamingSettings(), lambda _: None)
    return clutch, [one.pair for one in findings]


def test_a_piston_that_explains_more_without_a_law_of_full_contact_takes_its_place(
        monkeypatch: pytest.MonkeyPatch) -> None:
    beside, instead = fitted(-100.0, MISFIT, FRICTION), fitted(-50.0, EXPLAINED, LAG)
    assert asked(monkeypatch, finding(FRICTION, "contact"), beside, instead) == (instead, [LAG])


def test_a_law_of_full_contact_stays_where_the_clutch_is_explained_with_it_or_not_without_it(
        monkeypatch: pytest.MonkeyPatch) -> None:
    beside, worse, more = (fitted(-100.0, MISFIT, FRICTION), fitted(-101.0, EXPLAINED, LAG),
                           fitted(-99.0, EXPLAINED, LAG, ("clearance", "pressure")))
    alone = finding(FRICTION, "contact")
    assert asked(monkeypatch, alone, beside, worse) == (beside, [FRICTION])
    assert asked(monkeypatch, alone, beside, more) == (beside, [FRICTION])  # a further law has its price
    assert asked(monkeypatch, alone, beside, fitted(-50.0, MISFIT, LAG)) == (beside, [FRICTION])
    explained = fitted(-100.0, EXPLAINED, FRICTION)
    assert asked(monkeypatch, alone, explained, fitted(-50.0, EXPLAINED, LAG)) == (explained, [FRICTION])
    shared = finding(FRICTION, "contact", "load")
    assert asked(monkeypatch, shared, beside, fitted(-50.0, EXPLAINED, LAG)) == (beside, [FRICTION])


# Pairs that hardly any bench has: they compete where something is missing, and are named nowhere else.


USUAL, RARE, ELSEWHERE = ("load torque", "pressure"), ("load torque", "current"), ("converter torque", "slip")
SEED = 5


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


@pytest.mark.slow
def test_a_load_torque_over_the_current_is_no_other_one() -> None:
    law = MeasuredLaw(*RARE, (0.0, 0.3, 0.45, 0.6), (0.0, 0.0, 60.0, 20.0), relative=False)
    block = block_of("load", scene_of(HEAVY, Model(HEAVY.physics).with_law(law), COUNT, SEED))
    found = forward({"load": fit(block)}, SETTINGS)[1]
    assert [one.pair for one in found] == [RARE]
    assert RARE not in block.pairs()
    assert set(block.pairs()) < set(block.pairs(rare=True))
