"""How likely measured shifting times are (eq. 7), condition by condition, in logarithms throughout.

    log10 p_i = log10 E_theta[ N(t_i; y_i(mean + L theta), output_std^2) ]    per millisecond

The germ is drawn afresh for every run, so the conditions multiply. The expectation is the mean over fixed
scrambled Sobol samples of theta: no kernel estimate and no moment-matched normal.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.expansion import Basis, expand
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.product import product

SAMPLES = 4096
"""Samples of the germ, a power of two.

Their error in the log10 likelihood of 216 conditions, against 2^18 samples, RMS over seeds: 0.004 decades where the
output noise is as wide as the scatter from the inputs, 0.05 at two thirds of it, 0.2 at a third, 0.3 at a seventh.
It grows where a candidate lies far from the data, mostly to the low side: 4 decades at 110 below the best.
"""
_VANISHING = -700.0  # a sample this far below the nearest adds nothing, and subnormal numbers are slow
_BLOCK = 64  # candidates whose nodes go to the model in one call


class Model(Protocol):
    """All this package knows of a model: points (m, d), multiples of nominal -> shifting times (m, n), s.

    A time is NaN where the engagement does not lock.
    """

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Shifting times of all conditions at all points."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A model, conditions, their measured times (n,) in s, and the box `lower`, `upper` (d,) the model covers.

    `axes` names the d inputs in what is said of them. Raises `InvalidValue`.
    """

    model: Model
    conditions: Any
    measured_time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    axes: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse what would make every likelihood NaN."""
        if not self.lower.shape == self.upper.shape == (len(self.axes),):
            raise InvalidValue(f"There are {len(self.axes)} axes for a box of {len(self.lower)} and {len(self.upper)}",
                               "Give lower, upper and a name for each input")
        if self.measured_time.ndim != 1 or not np.all(np.isfinite(self.measured_time)):
            raise InvalidValue("The measured times are not one finite number a condition",
                               "Leave out the conditions without a measured shifting time")


@dataclass(frozen=True, eq=False)
class Candidate:
    """Inputs and the std of the additive output noise in s; raises `InvalidValue` unless that is positive."""

    inputs: Inputs
    output_std: float

    def __post_init__(self) -> None:
        """Without noise the samples have no density at a given time."""
        if not (np.isfinite(self.output_std) and self.output_std > 0):
            raise InvalidValue(f"The output std is {self.output_std} s", "Give a positive number of seconds")


def by_expansion(problem: Problem, candidates: Sequence[Candidate], basis: Basis,
                 germs: np.ndarray) -> np.ndarray:
    """log10 p, per ms, of c candidates by their expansions, sampled at the germs (m, d): shape (c, n).

    -inf where a condition has no expansion. The whole log10 likelihood is the sum over the conditions.
    """
    polynomials, likelihood = basis.at(germs), np.empty((len(candidates), len(problem.measured_time)))
    for first in range(0, len(candidates), _BLOCK):
        block = candidates[first:first + _BLOCK]
        nodes = np.concatenate([candidate.inputs.points(basis.nodes) for candidate in block])
        times = problem.model(nodes, problem.conditions).reshape(len(block), len(basis.nodes), -1)
        for row, (candidate, at_nodes) in enumerate(zip(block, times, strict=True), start=first):
            outputs = product(polynomials, expand(basis, at_nodes).coefficients)
            likelihood[row] = log10_density(outputs, problem.measured_time, candidate.output_std)
    return likelihood


def exact(problem: Problem, candidate: Candidate, germs: np.ndarray) -> np.ndarray:
    """log10 p, per ms, with the model itself run at the samples of the germs (m, d): shape (n,).

    No expansion: what it differs by is what the expansion costs. A sample that never locks, or that a table
    answers with NaN, has no density at the measured time.
    """
    outputs = problem.model(candidate.inputs.points(germs), problem.conditions)
    return log10_density(outputs, problem.measured_time, candidate.output_std)


def log10_density(outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 of the mean over m samples of N(times; outputs, output_std^2), per ms: shape (n,).

    Shapes: `outputs` (m, n) s, `times` (n,) s. NaN samples count as 0; -inf where all are NaN.
    """
    exponents = (outputs - times) / output_std
    exponents *= exponents
    exponents *= -0.5
    exponents[np.isnan(exponents)] = -np.inf
    top = exponents.max(axis=0)
    exponents -= np.where(np.isfinite(top), top, 0.0)
    np.maximum(exponents, _VANISHING, out=exponents)
    log_mean = top + np.log(np.exp(exponents, out=exponents).mean(axis=0))
    density: np.ndarray = (log_mean - np.log(output_std * np.sqrt(2 * np.pi))) / np.log(10.0) - 3.0
    return density
