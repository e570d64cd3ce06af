"""The axes of unknowns: round values whose labels have room and differ."""

import numpy as np
import pytest

from slipstick.pictures.multiples import ticks, unknown

PHYSICAL = [{"name": "pressure_bias", "unit": "bar", "nominal": 1.6, "std": 0.1}]
WIDEST = 56  # px of a label such as "0.0475 mm", by its drawing


@pytest.mark.parametrize("size", [105, 140, 204])
def test_labels_do_not_collide_with_each_other_or_those_of_the_next_panel(size: int) -> None:
    gap, rng = 40, np.random.default_rng(1)
    for width in 10 ** rng.uniform(-3, 3, 300):
        low = rng.uniform(-1, 3) * width
        values = ticks((low, low + width), size)
        places = [(value - low) / width * size for value in values]
        assert 2 <= len(values) <= 3
        assert min(np.diff(places)) > WIDEST
        assert places[0] - places[-1] + size + gap > WIDEST


def test_labels_have_the_digits_that_tell_them_apart() -> None:
    shown = unknown("mean of pressure_bias", PHYSICAL)
    values = ticks((0.9951, 1.0052), 105)
    assert values == [0.998, 1.004]
    assert shown.axis(values=values)["format"] == ".4~r"
    assert "'.4~r'" in shown.axis(values=values)["labelExpr"]
    assert shown.axis(values=[1.0, 1.1])["format"] == ".3~r"
