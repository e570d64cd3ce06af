"""Priors of laws from products with rounding errors."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from slipstick.engine.bases import flat_forms
from slipstick.engine.linear_model import Gram
from slipstick.engine.priors import choose_prior


def test_directions_in_which_rounding_alone_is_left_give_a_law_no_amplitude() -> None:
    """Information on the line is 0, and less than that by the rounding of a much larger one on the constant."""
    constant, line = (flat_forms(2) / np.sqrt(2)).T
    law: Any = SimpleNamespace(variable=SimpleNamespace(families=(2,)))

    def choose(left: float) -> tuple[float, float]:
        products = np.zeros((1, 3, 3))
        products[0, :2, :2] = 1e9 * np.outer(constant, constant) - left * np.outer(line, line)
        products[0, :2, 2] = products[0, 2, :2] = 1e5 * constant + left * line
        products[0, 2, 2] = 50.0
        gram = Gram(products, 0, np.zeros(2), np.zeros(2), np.zeros(0))
        gain, prior = choose_prior(gram, law, np.arange(2), np.zeros(0))
        return gain, prior.amplitude

    assert choose(1e3) == choose(0.0)
    assert choose(0.0)[0] < 25  # half of the squares, which no law can gain more than
