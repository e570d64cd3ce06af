"""Several blocks with common laws: their joint fit, and which pairs they ask for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.blocks.whitening import BlockNoise
from slipstick.naming.fit import fit, fit_together
from slipstick.naming.forward import _backward, forward
from slipstick.naming.selection import Finding
from slipstick.naming.settings import NamingSettings

Pair = tuple[str, str]
Laws = Sequence[tuple[Pair, np.ndarray]]
TIME = np.linspace(0, 1, 40)
SENSOR, FIRST, SECOND = ("sensor", "gain"), ("first", "time"), ("second", "time")
WAVES = {SENSOR: 3.0, FIRST: 3.3, SECOND: 8.0}
STD = 0.05


@dataclass(eq=False)
class Line:
    """(1 + b_i) of a ramp and some waves, each a pair; the prediction is linear in all of them."""

    name: str
    measured: np.ndarray
    offered: tuple[Pair, ...]
    shown: np.ndarray = field(default_factory=lambda: np.ones(1))
    signal: str = "any"
    scene: Any = field(default_factory=lambda: SimpleNamespace(of_runs=(), channels=()))
    fine: int = 9
    finer: Mapping[Pair, int] = field(default_factory=dict)
    random: tuple[str, ...] = ("slope",)
    fixed: tuple[str, ...] = ()
    random_std: np.ndarray = field(default_factory=lambda: np.array([np.inf]))
    freed: tuple[str, ...] = ()
    fixed_std: np.ndarray = field(default_factory=lambda: np.zeros(0))
    widest: np.ndarray = field(default_factory=lambda: np.array([0.5]))

    @property
    def counted(self) -> np.ndarray:
        return np.ones(self.measured.shape, bool)

    def at(self, shared: np.ndarray) -> "Line":
        return self

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        return (1 + points) * TIME + sum(c[0] * np.sin(WAVES[pair] * TIME) for pair, c in laws)

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(TIME, (len(points), 1, 1)), np.zeros((len(points), 0, len(TIME)))

    def shared_columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        return np.zeros((len(points), 0, len(TIME)))

    def pairs(self, rare: bool = False) -> list[Pair]:
        return list(self.offered)

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        return np.tile(np.sin(WAVES[pair] * TIME), (len(points), 1, 1)) * self.shown[:, None, None]

    def noise(self, points: np.ndarray) -> BlockNoise:
        return BlockNoise(STD, 0.0)


def two(first: dict[Pair, float], second: dict[Pair, float], n: int = 36) -> dict[str, Line]:
    """Blocks a and b with these amplitudes of waves."""
    rng = np.random.default_rng(1)
    blocks = {}
    for name, amplitudes, offered in (("a", first, (FIRST, SENSOR)), ("b", second, (SECOND, SENSOR))):
        clean = (1 + 0.1 * rng.standard_normal((n, 1))) * TIME
        clean = clean + sum(size * np.sin(WAVES[pair] * TIME) for pair, size in amplitudes.items())
        blocks[name] = Line(name, clean + STD * rng.standard_normal(clean.shape), offered)
    return blocks


def test_a_common_law_is_the_weighted_mean_of_those_of_the_blocks() -> None:
    blocks = two({SENSOR: 0.10}, {SENSOR: 0.14})
    apart = [fit(block, (SENSOR,)) for block in blocks.values()]
    together = fit_together(list(blocks.values()), [(SENSOR,)] * 2, [None] * 2)
    common = together[0].coefficients[SENSOR]
    assert common == together[1].coefficients[SENSOR]
    assert apart[0].coefficients[SENSOR][0] == pytest.approx(0.10, abs=0.02)
    weights = [1 / one.fitted.covariance[-1, -1] for one in apart]
    values = [one.coefficients[SENSOR][0] for one in apart]
    assert common[0] == pytest.approx(np.average(values, weights=weights), rel=2e-3)
    # Each of the fits is that of its block at the common law.
    for one, its in zip(together, apart, strict=True):
        assert one.fitted.covariance[-1, -1] == pytest.approx(1 / sum(weights), rel=0.01)
        assert one.fitted.likelihood.sum() < its.fitted.likelihood.sum()
        assert one.chi2.mean() == pytest.approx(1, abs=0.1)


def test_coefficients_of_a_law_are_found_whatever_order_its_blocks_have_their_laws_in() -> None:
    blocks = list(two({SENSOR: 0.1, FIRST: 0.3}, {SENSOR: 0.1}).values())
    for first in ((FIRST, SENSOR), (SENSOR, FIRST)):
        found = fit_together(blocks, [first, (SENSOR,)], [None] * 2)
        places = [one.places(SENSOR) for one in found]
        values = [one.fitted.coefficients[its] for one, its in zip(found, places, strict=True)]
        assert values[0] == values[1] == found[0].coefficients[SENSOR] == pytest.approx(0.1, abs=0.02)
        assert sum(one.leverage(SENSOR).sum() for one in found) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(("first", "second", "expected"), [
    ({}, {}, []),
    ({FIRST: 0.3}, {}, [(FIRST, ("a",))]),  # explained nearly as well by the sensor, which would show in b
    ({SENSOR: 0.1}, {SENSOR: 0.1}, [(SENSOR, ("a", "b"))]),
    ({FIRST: 0.3}, {SECOND: 0.2}, [(FIRST, ("a",)), (SECOND, ("b",))]),
])
def test_blocks_ask_for_what_acts_on_them(first: dict[Pair, float], second: dict[Pair, float],
                                          expected: list[tuple[Pair, tuple[str, ...]]]) -> None:
    fits = {name: fit(block) for name, block in two(first, second).items()}
    after, found = forward(fits, NamingSettings())
    assert sorted((one.pair, one.blocks) for one in found) == sorted(expected)
    assert not any(one.rivals for one in found)
    assert all(after[name].chi2.mean() == pytest.approx(1, abs=0.1) for name in after)


def test_the_leverage_on_a_law_is_the_share_of_each_engagement_in_what_is_known_of_it() -> None:
    block = two({}, {})["a"]
    block.shown = np.repeat([0.0, 1.0, 2.0], 12)
    found = fit(block, (FIRST,))
    leverage = found.leverage(FIRST)
    np.testing.assert_allclose(leverage[:12], 0, atol=1e-3)  # these say nothing but what the mean slope is
    np.testing.assert_allclose(leverage[24:], 4 * leverage[12], rtol=0.05)
    assert leverage.sum() == pytest.approx(1, abs=1e-3)
    both = fit(block, (FIRST, SENSOR))
    assert both.leverage(FIRST).sum() == pytest.approx(1, abs=0.1)  # the prior tells the rest
    together = fit_together(list(two({SENSOR: 0.1}, {SENSOR: 0.1}).values()), [(SENSOR,)] * 2, [None] * 2)
    assert sum(one.leverage(SENSOR).sum() for one in together) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(("true", "left"), [({FIRST: 0.3}, [FIRST]), ({FIRST: 0.3, SENSOR: 0.3}, [SENSOR, FIRST])])
def test_a_finding_that_a_later_one_replaces_is_dropped(true: dict[Pair, float], left: list[Pair]) -> None:
    blocks = two(true, {SENSOR: true.get(SENSOR, 0.0)})
    its = {"a": (SENSOR, FIRST), "b": (SENSOR,)}
    found = fit_together(list(blocks.values()), list(its.values()), [None] * 2)
    fits = dict(zip(blocks, found, strict=True))
    findings = [Finding(("a", "b"), SENSOR, np.ones(36)), Finding(("a",), FIRST, np.ones(36))]
    after, kept = _backward(fits, findings, NamingSettings())
    assert [one.pair for one in kept] == left
    assert list(after["b"].laws) == [law for law in left if law == SENSOR]
    alone = _backward(fits, findings[:1], NamingSettings())[1]
    assert [one.pair for one in alone] == [SENSOR]  # what no later one follows was tested when it was chosen
