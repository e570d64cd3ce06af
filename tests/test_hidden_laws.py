"""Measured laws beside hidden ones: how far off they are, and by how much they say that they may be."""

import numpy as np
import pytest

from benchmarks.hidden_laws import compared, differences, is_over_a_number
from slipstick.naming.law_map import UpTo
from slipstick.naming.measured import LawPoints

PAIR = ("load torque", "output speed")
GRID = np.linspace(0.0, 100.0, 11)
HIDDEN = {"quantity": "load_torque", "abscissa": "output_speed", "kind": "difference", "base": 50.0,
          "grid": GRID.tolist(), "change": (0.2 * GRID).tolist(), "visits": np.ones(11).tolist()}


def law(change: np.ndarray, std: float, up_to: UpTo = "nothing") -> LawPoints:
    return LawPoints(PAIR, GRID, "rad/s", change, "N m", False, std**2 * np.eye(11), up_to)


def test_the_difference_and_the_stated_error_are_shares_of_the_law() -> None:
    size = float(np.sqrt(np.mean((0.2 * GRID) ** 2)))
    found = compared(law(0.2 * GRID + 3.0, 2.0), HIDDEN, {})
    assert found is not None
    assert (found.share, found.stated, found.held) == (pytest.approx(3.0 / size), pytest.approx(2.0 / size), 1.0)
    tighter = compared(law(0.2 * GRID + 3.0, 1.0), HIDDEN, {})
    assert tighter is not None
    assert tighter.held == 0.0


def test_what_a_law_is_known_up_to_is_no_difference() -> None:
    found = compared(law(0.2 * GRID + 3.0, 2.0, "constant"), HIDDEN, {})
    assert found is not None
    assert found.share == pytest.approx(0.0, abs=1e-12)


def test_only_laws_of_hidden_pairs_over_the_same_number_are_compared() -> None:
    known = {"hidden": [{"pair": PAIR}, {"pair": ("friction coefficient", "heat")}],
             "changed": [HIDDEN, {**HIDDEN, "abscissa": "heat"}]}
    laws = {PAIR: law(0.2 * GRID, 1.0), ("friction coefficient", "heat"): law(0.2 * GRID, 1.0)}
    assert not is_over_a_number(("friction coefficient", "heat"), known["changed"][1])
    (found,) = differences(known, laws, {})
    assert found["pair"] == PAIR
    assert found["share"] == pytest.approx(0.0, abs=1e-12)
    assert differences(known, {}, {}) == []
