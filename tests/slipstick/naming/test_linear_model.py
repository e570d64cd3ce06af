"""The joint linear model of blocks: with a further pair it is the one in which the pair is a law from the start."""

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.evidence import Table, table
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.linear_model import Joint, columns_of, joined, part_of
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED = 12, 3
SHARED, ALONE = ("output torque sensor", "gain"), ("load torque", "time")


@pytest.fixture(scope="module")
def fits() -> list[BlockFit]:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    return [fit(block_of("load", scene), (ALONE,)), fit(block_of("input", scene))]


def whole(fits: list[BlockFit], laws: list[tuple[str, str]]) -> Joint:
    parts = [part_of(its.block, columns_of(its.block, its.points, its.shared, its.held, its.predicted,
                                           [law for law in laws if law in its.block.pairs()]), its.noise)
             for its in fits]
    return joined(parts, laws)


def beside(tables: list[Table], pair: tuple[str, str]) -> Joint:
    return joined([one.part for one in tables], [ALONE]).beside(pair, [one.further[pair] for one in tables])


def same(one: Joint, other: Joint) -> None:
    np.testing.assert_allclose(one.gram.products, other.gram.products, rtol=1e-9, atol=1e-6)
    np.testing.assert_array_equal(one.gram.precision, other.gram.precision)
    assert {pair: its.tolist() for pair, its in one.places.items()} \
        == {pair: its.tolist() for pair, its in other.places.items()}


def test_a_further_pair_of_two_blocks_has_the_products_of_a_law(fits: list[BlockFit]) -> None:
    tables = [table(its, [SHARED]) for its in fits]
    assert set(tables[0].further) == {SHARED}
    same(beside(tables, SHARED), whole(fits, [ALONE, SHARED]))


def test_a_table_takes_more_pairs_and_keeps_those_that_it_has(fits: list[BlockFit]) -> None:
    its = fits[0]
    pairs = [pair for pair in its.block.pairs() if pair != ALONE]
    at_once, before = table(its, pairs), table(its, pairs[:3])
    later = table(its, pairs, before)
    assert set(later.further) == set(at_once.further)
    for pair, known in before.further.items():
        assert later.further[pair] is known
    for pair, products in at_once.further.items():
        np.testing.assert_allclose(later.further[pair].onto, products.onto, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(later.further[pair].among, products.among, rtol=1e-9, atol=1e-6)


def test_the_joint_model_of_one_part_is_that_part_in_any_order_of_its_laws(fits: list[BlockFit]) -> None:
    its, laws = fits[0], [ALONE, SHARED]
    part = part_of(its.block, its.columns(laws), its.noise)
    one, swapped = joined([part], laws), joined([part], laws[::-1])
    assert one.gram is part.gram
    assert one.places.keys() == swapped.places.keys()
    first = np.arange(len(one.gram.precision) - sum(len(at) for at in one.places.values()))
    order = np.concatenate([first, *(swapped.places[law] for law in laws), [len(one.gram.precision)]])
    np.testing.assert_array_equal(swapped.gram.products[:, order[:, None], order], one.gram.products)
    np.testing.assert_array_equal(swapped.gram.precision[order[:-1]], one.gram.precision)
    for law in laws:
        np.testing.assert_array_equal(one.rows[0][one.places[law]], one.places[law])
