"""A second start of the blocks begins where the first one ended as well: a search may end in another minimum."""

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import start
from slipstick.naming.block import Laws
from slipstick.naming.piston import ClutchBlock
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of


def test_what_is_known_of_the_onset_makes_up_for_a_search_that_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), 18, seed=3)
    pressure = scene.smooth["pressure"]

    def chi_square(known: start.Onset | None) -> float:
        return float(start._rough(scene, pressure, None, known).chi2.mean())

    right = start._rough(scene, pressure, None, None)
    assert right.chi2.mean() < 1.2

    def failing(block: ClutchBlock, shared: np.ndarray, laws: Laws = ()) -> np.ndarray:
        points = np.zeros((len(block.measured), len(block.random)))
        points[:, 1:3] = -0.8, 1.9  # pressure bias and initial position: in contact from the beginning
        return points

    monkeypatch.setattr(start, "search", failing)
    monkeypatch.setattr(start, "retimed", lambda block, points, shared, laws: points)
    assert chi_square(None) > 10
    assert chi_square(start.Onset(right.points, right.shared, {})) < 1.2
    assert chi_square(start.Onset(failing(right.block, right.shared), right.shared, {})) == chi_square(None)
