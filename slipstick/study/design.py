"""What a study moves: parameters of the model and coefficients of effects, as one vector near 1 or near 0.

A parameter is a multiple of its nominal value, a coefficient a multiple of its `typical` one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.clutch import effects
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model

VALLEY = "temperature_gain"
"""With pressure bias and initial position it forms a curved valley."""
WIDEST = 0.15
"""Standard deviation of a multiplier from run to run above which it is no scatter: the paper's are 0.05 and 0.08."""
_PRIOR = 0.1
"""Standard deviation of a parameter's multiplier about nominal before any recording: nothing where the data speak."""
_PARAMETER, _AMPLITUDE, _SHAPE = (1e-3, 0.1), (0.05, 1.0), (0.02, 0.3)
"""Step of the differences, and farthest move at once."""
_SCATTER = 0.02
"""Step on either side for a parameter that scatters: about what one experiment leaves it open by."""


@dataclass(frozen=True)
class Unknown:
    """One entry of the vector: where it starts and may go, the `step` of differences, and the `reach` of a move.

    `precision` is that of its prior about the start, 0 for none. `both`: differences are taken to either side.
    """

    name: str
    start: float
    lower: float
    upper: float
    step: float
    reach: float
    precision: float = 0.0
    both: bool = False


@dataclass(frozen=True)
class Design:
    """What moves on a `bench`: the `parameters` first, then the coefficients of the `added` effects in their order.

    Those at the places `scattering` also differ from experiment to experiment, with a standard deviation of at most
    `widest`. Every model has the measured `laws`.
    """

    bench: Bench
    parameters: tuple[str, ...] = parameters.UNCERTAIN
    scattering: tuple[int, ...] = ()
    added: tuple[str, ...] = ()
    widest: float = WIDEST
    laws: tuple[MeasuredLaw, ...] = ()

    @property
    def base(self) -> Model:
        """The nominal model of the bench, with the laws."""
        return Model(self.bench.physics, laws=self.laws)

    @property
    def valley(self) -> int | None:
        """Place of the parameter that fits find by its profile; None where it does not move."""
        return self.parameters.index(VALLEY) if VALLEY in self.parameters else None

    @property
    def coefficients(self) -> list[tuple[str, effects.Coefficient]]:
        """(effect, coefficient on the bench) of each entry after the parameters."""
        return [(name, one) for name in self.added
                for one in effects.find(name).on(self.bench.scales).coefficients]

    @property
    def unknowns(self) -> list[Unknown]:
        """One for each entry of the vector."""
        (step, reach), moving = _PARAMETER, []
        for place, name in enumerate(self.parameters):
            both, one = place in self.scattering, self.bench.prior(name)
            moving.append(Unknown(name, 1.0, one.lower, one.upper, _SCATTER if both else step, reach, _PRIOR**-2,
                                  both))
        return moving + [_unknown(effect, one) for effect, one in self.coefficients]

    def part(self, theta: np.ndarray, added: Sequence[str]) -> np.ndarray:
        """Of theta (p,) the parameters and the coefficients of some of the added effects, in the order given."""
        of = np.array([name for name, _ in self.coefficients])
        d = len(self.parameters)
        return np.concatenate([theta[:d], *(theta[d:][of == name] for name in added)])

    def vectors(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameter vectors (m, 20) and effect coefficients (m, c) at `points` (m, p)."""
        m, d = len(points), len(self.parameters)
        vectors = np.tile(self.base.parameters, (m, 1))
        nominal = self.base.nominal
        for column, name in enumerate(self.parameters):
            place = parameters.index(name)
            vectors[:, place] = nominal[place] * points[:, column]
        coefficients = np.tile(self.base.coefficients(), (m, 1))
        for column, (effect, one) in enumerate(self.coefficients):
            coefficients[:, effects.index(effect, one.name)] = points[:, d + column] * one.typical
        return vectors, coefficients

    def model(self, point: np.ndarray) -> Model:
        """The model at a point (p,)."""
        vectors, coefficients = self.vectors(point[None])
        named: dict[str, Mapping[str, float]] = {}
        for effect in effects.CATALOGUE:
            values = coefficients[0, effects.span(effect)]
            if effect.name in self.added:
                named[effect.name] = {one.name: float(value)
                                      for one, value in zip(effect.coefficients, values, strict=True)}
        return Model(self.bench.physics, tuple(vectors[0].tolist()), named, self.laws)


def _unknown(effect: str, one: effects.Coefficient) -> Unknown:
    lower, upper = sorted((one.lower / one.typical, one.upper / one.typical))
    # The reference value of a shape coefficient, the same for all benches, may be out of bounds on an unusual one.
    neutral = float(np.clip(one.neutral / one.typical, lower, upper))
    step, reach = _SHAPE if one.shape else _AMPLITUDE
    if one.shape and effects.find(effect).forms:
        reach = 0.0  # one form or another: nothing between them
    return Unknown(f"{effect}.{one.name}", neutral, lower, upper, step, reach)
