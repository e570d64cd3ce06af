"""What every block offers to the fits: a prediction, its columns, and the laws that it can be asked for.

About parameters b (n, q) of n engagements, shared values s (p,) and laws with coefficients c, a block predicts

    y = base(b, s, laws),   dy = columns . (db, ds) + basis . dc

All parameters are relative changes, 0 at the nominal value: a parameter of the bench is base * (1 + b).
"""

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from slipstick.blocks.whitening import BlockNoise
from slipstick.naming.bases import doubled, gain_points
from slipstick.naming.law_map import LawMap
from slipstick.naming.scene import Pair, Scene

Laws = Sequence[tuple[Pair, np.ndarray]]
"""Pairs with the coefficients (m,) of their laws."""

__all__ = ["CLOSING", "NOT_FINER", "Block", "Laws", "Pair", "SearchedBlock", "changed", "fineness", "finer_at_first",
           "finest", "first_shared", "has_few_numbers", "is_changing_delay", "twice_as_fine"]


class Block(Protocol):
    """A part of the model between measured signals, over the k samples of n engagements.

    - `name` of the block, `signal` that it predicts, and the `scene` of its recordings.
    - `measured` (n, k): the signal in its unit; `counted` (n, k): the samples that enter the likelihood.
    - `random` (q names): parameters that differ between engagements, with a common mean; `fixed` (p names): shared.
    - `random_std` (q,), `fixed_std` (p,): prior standard deviations of the means and of the shared values; infinite
      for parameters that the recordings must determine.
    - `freed`: those that a data sheet gives, but that recordings determine as well.
    - `widest` (q,): largest standard deviation of a parameter over engagements.
    - `fine`: number of knots of a law over a signal.
    - `finer`: how many times the resolution of a law is doubled; 0 for those that it does not have.
    """

    name: str
    signal: str
    scene: Scene
    measured: np.ndarray
    counted: np.ndarray
    random: tuple[str, ...]
    fixed: tuple[str, ...]
    random_std: np.ndarray
    freed: tuple[str, ...]
    fixed_std: np.ndarray
    widest: np.ndarray
    fine: int
    finer: Mapping[Pair, int]

    def at(self, shared: np.ndarray) -> Self:
        """The block at `shared` values (p,): another one."""

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """The signal (n, k) at parameters `points` (n, q) under `laws`, to which columns and noise then refer."""

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (n, q, k) with respect to `points` and (n, p, k) with respect to the shared values."""

    def pairs(self, rare: bool = False) -> list[Pair]:
        """The laws that the block can be asked for, with or without `rare` ones, which hardly any bench has."""

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """Derivatives (n, m, k) with respect to the coefficients of the law of a pair."""

    def law(self, pair: Pair) -> LawMap:
        """How the coefficients of the law of a pair become values."""

    def noise(self, points: np.ndarray) -> BlockNoise:
        """The noise of the residual `measured` - prediction."""


SomeBlock = TypeVar("SomeBlock")


def changed(block: SomeBlock, **attributes: Any) -> SomeBlock:
    """The block with other `attributes`; the given one stays as it is."""
    other = copy(block)
    vars(other).update(attributes)
    return other


def first_shared(block: Block) -> np.ndarray:
    """Shared values (p,) at which a fit begins: all are 0 but the clock, which is late by up to a sample.

    A fit of a fast valve that begins without a delay may stay there: at the command the pressure has a corner.
    """
    return np.array([0.5 * block.scene.step if name == "clock" else 0.0 for name in block.fixed])


def fineness(block: Block, pair: Pair) -> int:
    """Number of knots of the law of a pair over a signal."""
    return doubled(block.fine, block.finer.get(pair, 0))


_FINEST = 2
"""How many times the resolution of a law is doubled at most, where it is not free."""
_FINEST_MEMORY = 4
"""The same for the past of a current, whose law may bend next to where the current turns round."""
_MOST_KNOTS, _MOST_OVER_TIME = 65, 129
"""Most knots of a free law over a signal, or over the time of a recording, of which an engagement is a part. As long as
a strong law is not followed, what is left of it looks like another one."""
_MOST_WHILE_CLOSING = 33
"""Most knots of a law of the closing piston, each of whose columns takes an integration."""
_OF_FEW = ("lag", "past current", "twist", "run order")
"""Dependences of laws that mix a few lags, plays or windows, or over a value of each engagement."""
CLOSING = ("piston gain", "clearance", "film torque", "piston rate", "friction lag")
"""Quantities whose laws show only while the plates close, within little time; each column takes an integration."""
_OF_FEW_VALUES = ("offset", "motor speed")
"""Dependences of laws that are a few numbers, or over few levels, and that have no resolution."""
NOT_FINER = ("contact pressure", "lag"), ("output torque sensor", "lag")
"""Lags without a resolution. Those of the friction and of the torque sensor are the same in full contact, and one with
more columns than the other would win; while the plates close, the torque rises faster than many columns can be known.
"""


def is_changing_delay(pair: Pair, scene: Scene) -> bool:
    """Whether a law changes the delay of the valve within an engagement."""
    return pair[0] == "valve delay" and pair[1] not in scene.of_runs


def has_few_numbers(pair: Pair) -> bool:
    """Whether the law of a pair has few numbers, but can be finer: lags, memories, twists, drifts, sensors."""
    return pair not in NOT_FINER and (pair[1] in _OF_FEW
                                      or (pair[0].endswith("sensor") and pair[1] in ("gain", "time")))


def finer_at_first(pair: Pair, knots: int) -> int:
    """How many times a law of few numbers is doubled beside laws with so many `knots`: a gain error has as many."""
    if not has_few_numbers(pair):
        return 0
    return max(1, (knots - 2).bit_length() - 1) if pair[1] == "gain" else 1  # `gain_points` has 2^(times + 1) + 1


def finest(block: Block, pair: Pair) -> int:
    """How many times the resolution of a law can be doubled."""
    (quantity, on), scene = pair, block.scene
    is_sensor = quantity.endswith("sensor")
    if on in _OF_FEW_VALUES or pair in NOT_FINER or (is_sensor and on in scene.channels):
        return 0
    if on in _OF_FEW or on in scene.channels:
        return _FINEST_MEMORY if on == "past current" else _FINEST
    knots, most = block.fine, _MOST_OVER_TIME if on == "time" else _MOST_KNOTS
    if is_sensor and on in ("gain", "time"):  # these do not begin with the knots of the block
        knots = len(gain_points(0)) if on == "gain" else scene.settings.fine_knots
    elif is_sensor:
        knots = scene.settings.knots
    elif quantity in CLOSING:
        knots, most = scene.settings.knots, _MOST_WHILE_CLOSING
    return max(((most - 1) // (knots - 1)).bit_length() - 1, 0)


def twice_as_fine(block: Block, laws: Iterable[Pair]) -> dict[Pair, int]:
    """How many times those of some laws that can be finer are doubled, with twice their resolution."""
    times = {law: block.finer.get(law, 0) for law in laws}
    return {law: doublings + 1 for law, doublings in times.items() if doublings < finest(block, law)}


class SearchedBlock(Block, Protocol):
    """A block that is far from linear, whose start values are searched.

    `bounds` (2, p) are the least and the largest shared values, beyond which the block does not change. A block whose
    slopes take many predictions `follows_chords` after a step.
    """

    bounds: np.ndarray
    follows_chords: bool

    def size(self, pair: Pair) -> int:
        """Number of coefficients of the law of a pair, without its columns."""

    def part(self, points: np.ndarray, laws: Laws, rows: np.ndarray) -> np.ndarray:
        """The signal (n, k) of the engagements `rows` (n,) alone, at `points` (n, q)."""
