"""Likelihoods of measurements under candidate distributions of the inputs, by one of four methods (eq. 7)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from slipstick.black_box import Quantity
from slipstick.errors import InvalidValue, UnknownName
from slipstick.inference.inputs import require_seed
from slipstick.inference.problems import require_reach
from slipstick.uncertainty import mass_outside, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings
from slipstick.uncertainty.likelihood import (
    SAMPLES,
    Candidate,
    InferenceProblem,
    LikelihoodEstimate,
    by_sampling,
    compared,
    converged,
    expanded_with_lines,
    with_lines,
)
from slipstick.uncertainty.likelihood.likelihood import MOST_LINES
from slipstick.uncertainty.likelihood.line_rules import ACROSS

Method = Literal["auto", "exact", "expansion", "sampling"]
"""How the density is integrated over the inputs, see `LikelihoodSettings`."""
FEWEST_LINES = 16
"""Least number of integration lines."""


@dataclass(frozen=True)
class LikelihoodSettings:
    """How likelihoods are computed. Raises `InvalidValue`, `UnknownName`.

    The method "auto" integrates the model itself, refined until the error is below 0.05 decades; "exact" does so with
    the given number of `lines`; "expansion" integrates the `expansion` along `lines`; "sampling" averages over
    `samples` of the expansion, as in the paper. Lines and samples are powers of two.
    """

    method: Method = "auto"
    expansion: ExpansionSettings = field(default_factory=lambda: ExpansionSettings(checks=0))
    lines: int = ACROSS
    samples: int = SAMPLES
    seed: int = 1

    def __post_init__(self) -> None:
        """Check the settings for every method: a number that the method ignores is a mistake as well."""
        if self.method not in get_args(Method):
            raise UnknownName.of("method", str(self.method), get_args(Method))
        require_seed(self.seed)
        for name in ("lines", "samples"):
            count = getattr(self, name)
            if count < 1 or count & (count - 1):
                raise InvalidValue(f"The number of {name}, {count}, is not a power of two",
                                   "Give one, such as 1024")
        if not FEWEST_LINES <= self.lines <= MOST_LINES:
            raise InvalidValue(f"The number of lines is {self.lines}", f"Give {FEWEST_LINES} to {MOST_LINES}")


@dataclass(frozen=True, eq=False)
class Likelihoods:
    """Likelihoods of c candidates: `log10_density` (c, n) per ms, or per thousandth of the unit of another output.

    The log10 likelihood of a candidate is the sum of its densities; `error` (c,) is that of the sum in decades, to hold
    in 95 % of the cases, inf where it is not known, or the likelihood is 0. `mass_outside` (c,) is the probability that
    the inputs lie outside the domain of the model.
    """

    log10_density: np.ndarray
    error: np.ndarray
    mass_outside: np.ndarray

    @property
    def log10_likelihood(self) -> np.ndarray:
        """log10 of the likelihood of each candidate, (c,); -inf for a likelihood of 0."""
        return np.array([row.sum() for row in self.log10_density])


def compute_likelihoods(problem: InferenceProblem, output: Quantity, candidates: Sequence[Candidate],
                        settings: LikelihoodSettings) -> Likelihoods:
    """The likelihoods of the measurements of a problem under one or more candidates; `output` is that of its model.

    Raises `InvalidValue`, also for measurements that no inputs reach, which a fit refuses as well.
    """
    require_reach(problem, output)
    for candidate in candidates:
        problem.require_output_std(candidate.output_std)
    estimates = _estimates(problem, candidates, settings)
    densities = np.array([estimate.density for estimate in estimates])
    errors = [estimate.error if np.isfinite(estimate.density).all() else math.inf for estimate in estimates]
    normals = standard_normals(len(problem.axes), SAMPLES, settings.seed)
    mass = [mass_outside(candidate.inputs, problem.lower, problem.upper, normals) for candidate in candidates]
    return Likelihoods(densities, np.array(errors), np.array(mass))


def _estimates(problem: InferenceProblem, candidates: Sequence[Candidate],
               settings: LikelihoodSettings) -> list[LikelihoodEstimate]:
    if settings.method == "auto":
        return [converged(problem, candidate, settings.seed) for candidate in candidates]
    if settings.method == "exact":
        return [with_lines(problem, candidate, settings.lines, settings.seed) for candidate in candidates]
    if settings.method == "expansion":
        densities = expanded_with_lines(problem, candidates, settings.expansion, settings.lines, settings.seed)
    else:
        normals = standard_normals(len(problem.axes), settings.samples, settings.seed)
        densities = by_sampling(problem, candidates, settings.expansion, normals)
    return compared(problem, candidates, densities, settings.seed)
