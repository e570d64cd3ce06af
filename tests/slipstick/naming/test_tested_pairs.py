"""Which pairs of a quantity and what it depends on the blocks test, and what docs/add_an_effect.md says of it."""

import re
from functools import cache
from pathlib import Path

import pytest

from slipstick.clutch.effects import CATALOGUE
from slipstick.clutch.effects.effect import DEPENDENCES, QUANTITIES, SENSORS, Effect
from slipstick.clutch.model import Model
from slipstick.naming.block import Pair
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of, with_plates

BLOCKS = ("valve", "load", "input", "lock", "contact", "clutch")
PAGE = Path(__file__).parents[3] / "docs" / "add_an_effect.md"


@cache
def pairs_of_blocks() -> tuple[set[Pair], set[Pair]]:
    """The usual pairs of all blocks, and those that are tried only where something is missing."""
    scene = with_plates(scene_of(HEAVY, Model(HEAVY.physics), 24, 1))
    blocks = [block_of(name, scene) for name in BLOCKS]
    usual = {pair for block in blocks for pair in block.pairs()}
    return usual, {pair for block in blocks for pair in block.pairs(rare=True)} - usual


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_a_study_tests_a_pair_of_every_effect(effect: Effect) -> None:
    usual, rare = pairs_of_blocks()
    assert set(effect.pairs) & (usual | rare), (
        f"No block tests {effect.pairs}: add the pair under which it shows to `also` ({PAGE.name})")


def test_the_page_lists_the_pairs_that_are_tested() -> None:
    section = PAGE.read_text().split("### Pairs that a study tests")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")]
            for line in section.splitlines() if line.startswith("| `")]
    listed = [{(quantity, on) for names, *cells in rows for quantity in re.findall("`([^`]+)`", names)
               for on in cells[column].split(", ") if on != "-"} for column in (0, 1)]
    for said, pairs in zip(listed, pairs_of_blocks(), strict=True):
        known = {(quantity, on) for quantity, on in pairs
                 if quantity in {**QUANTITIES, **SENSORS} and on in DEPENDENCES}
        assert said == known
