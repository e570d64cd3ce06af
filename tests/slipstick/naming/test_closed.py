"""The closing piston is also asked without what full contact alone suggested, where that leaves it unexplained."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.naming import closed as closed_module
from slipstick.naming.block import Pair
from slipstick.naming.closed import closed
from slipstick.naming.selection import Finding
from slipstick.naming.settings import NamingSettings

FRICTION, LAG = ("friction coefficient", "pressure"), ("friction lag", "slip")
COUNT = 24
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

    def closing(block: Any, begun: Any, settings: Any, ask: Any, named: list[Finding], _: Any) -> Any:
        return (beside, named) if FRICTION in begun.laws else (instead, [*named, finding(LAG, "clutch")])

    monkeypatch.setattr(closed_module, "closing", closing)
    monkeypatch.setattr(closed_module, "_searched", lambda *_: [])
    monkeypatch.setattr(closed_module, "followed", lambda block, now, *_: now)
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
