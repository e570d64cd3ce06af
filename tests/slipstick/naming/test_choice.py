"""Which of several pairs that were fitted in full is chosen."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.naming import choice, full_fits
from slipstick.naming.block import Pair
from slipstick.naming.choice import Choice
from slipstick.naming.full_fits import Tried
from slipstick.naming.selection import is_enough
from slipstick.naming.settings import NamingSettings

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
        its: Any = {name: SimpleNamespace(chi2=chi2) for name in one.blocks}
        return Tried(one, rises[one.pair] * gain.get(one.pair, 1.0) ** times, its, times)

    monkeypatch.setattr(choice, "tried", tried)
    monkeypatch.setattr(choice, "to_the_end", lambda fits, one: one)
    monkeypatch.setattr(choice, "is_enough_with", lambda fits, its, one, settings: is_enough(one.gain, settings))
    monkeypatch.setattr(full_fits, "expected_of", lambda *_: None)
    block = SimpleNamespace(finer={}, fine=17, scene=SimpleNamespace(channels=(), settings=SETTINGS))
    fits: Any = {name: SimpleNamespace(block=block, chi2=np.full(COUNT, 5.0)) for name in (BLOCK, OTHER)}
    compared: Any = [SimpleNamespace(pair=pair, blocks=acts.get(pair, (BLOCK,)), nats=rise, agreement=5.0)
                     for pair, rise in rises.items()]
    its = Choice(fits, compared, compared, tuple(rises) if usual is None else usual, SETTINGS, lambda _: None)
    finding, _ = its.settled(compared[0], compared[1:])
    return finding.pair, block.finer[finding.pair]


def test_what_few_engagements_show_gives_way_to_what_most_do(monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen_beside(monkeypatch, {FEW: ROUGH, MOST: np.full(COUNT, 30.0)})[0] == MOST
    assert chosen_beside(monkeypatch, {FEW: np.full(COUNT, 48.0), MOST: np.full(COUNT, 30.0)})[0] == FEW


def test_it_does_not_give_way_to_something_far_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen_beside(monkeypatch, {FEW: ROUGH, MOST: np.full(COUNT, 10.0)})[0] == FEW


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
