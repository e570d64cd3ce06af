"""Size and elements of the sets of multi-indices."""

from itertools import product
from math import comb

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.truncation import degrees


@pytest.mark.parametrize(("dimension", "order"), [(1, 20), (2, 0), (2, 8), (3, 4), (7, 3)])
def test_the_total_degree_is_complete(dimension: int, order: int) -> None:
    terms = degrees(dimension, order)
    assert terms.shape == (comb(order + dimension, dimension), dimension)
    assert len(np.unique(terms, axis=0)) == len(terms)
    assert np.all(np.diff(terms.sum(axis=1)) >= 0)
    assert terms[-1].sum() == order
    assert not terms[0].any()


@pytest.mark.parametrize("norm", [0.4, 0.5, 0.75, 1.0])
@pytest.mark.parametrize(("dimension", "order"), [(2, 8), (3, 9), (4, 4)])
def test_the_hyperbolic_set_agrees_with_its_definition(dimension: int, order: int, norm: float) -> None:
    expected = {index for index in product(range(order + 1), repeat=dimension)
                if sum(i**norm for i in index) <= order**norm * (1 + 1e-12)}
    assert {tuple(row) for row in degrees(dimension, order, norm).tolist()} == expected


@pytest.mark.parametrize(("dimension", "order", "norm", "count"), [(2, 4, 0.5, 10), (2, 8, 0.5, 23), (7, 4, 0.75, 92)])
def test_hyperbolic_counts(dimension: int, order: int, norm: float, count: int) -> None:
    assert len(degrees(dimension, order, norm)) == count


def test_invalid_truncations_raise() -> None:
    for arguments in ((0, 2), (2, -1), (2, 41)):
        with pytest.raises(InvalidValue, match="order from 0 to 40"):
            degrees(*arguments)
    for norm in (0.0, 1.5, np.nan):
        with pytest.raises(InvalidValue, match="norm of the truncation"):
            degrees(2, 3, norm)
    with pytest.raises(InvalidValue, match="vary fewer inputs"):
        degrees(7, 8)
