"""The log10 likelihood as a function of one vector of means, stds and output std, with its derivatives.

The vector (2 d + 1,) holds d means and d stds of independent normal inputs and the output std, all on their natural
scale. Samplers and optimizers of others take such a function.

The gradient is that of gradient.py: in closed form (Fisher's identity) for up to two inputs, and by central differences
of the likelihood for more. A Hessian is applied to a vector by a central difference of the gradient along it, with a
step that moves no unknown by more than `STEP` of its std (means) or of itself (stds).
"""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.families import Family
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.gradient import density_and_gradient
from slipstick.uncertainty.likelihood.likelihood import exact
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

STEP = 1e-3
"""Largest relative step of the difference that applies a Hessian; its error is about 1e-6 of the result."""
_NARROWEST = 1e-3  # smallest step scale of a mean, in multiples of nominal, where its std is smaller still


@dataclass(frozen=True, eq=False)
class NaturalLikelihood:
    """The likelihood of a `problem` of d inputs over vectors (2 d + 1,)."""

    problem: InferenceProblem

    @property
    def size(self) -> int:
        """Number of entries of a vector."""
        return 2 * len(self.problem.axes) + 1

    def value(self, vector: np.ndarray) -> float:
        """log10 likelihood per ms; minus infinity where it is 0, as for a negative std or no output noise."""
        d = len(self.problem.axes)
        try:
            candidate = Candidate(Inputs(vector[:d], vector[d:2 * d]), float(vector[2 * d]))
            self.problem.require_output_std(candidate.output_std)
        except InvalidValue:
            return -np.inf
        return float(exact(self.problem, candidate).sum())

    def gradient(self, vector: np.ndarray) -> np.ndarray:
        """Derivatives (2 d + 1,) of the value; raises `InvalidValue` unless stds and likelihood are positive."""
        d = len(self.problem.axes)
        scales = vector[d:]
        if not np.all(scales > 0):
            raise InvalidValue("The likelihood has no derivatives at a std of 0 or less",
                               "Give a positive std of every input and of the output")
        self.problem.require_output_std(float(vector[2 * d]))
        logarithmic = np.concatenate([vector[:d], np.log(scales)])
        density, gradient = density_and_gradient(self.problem, self._unknowns, logarithmic)
        if not np.isfinite(density).all() or not np.isfinite(gradient).all():
            raise InvalidValue(f"The likelihood of measurement {int(np.argmin(np.isfinite(density)))} is 0 here, and "
                               "has no derivatives", "Give means and stds for which every measurement is possible")
        natural: np.ndarray = gradient.sum(axis=0)
        natural[d:] /= scales
        return natural

    def apply_hessian(self, vector: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """The Hessian times `direction` (2 d + 1,): shape (2 d + 1,); raises `InvalidValue` as `gradient` does."""
        d = len(self.problem.axes)
        scales = np.concatenate([np.maximum(vector[d:2 * d], _NARROWEST), vector[d:]])
        with np.errstate(divide="ignore", invalid="ignore"):
            largest = float(np.max(np.abs(direction) / scales))
        if largest == 0:
            self.gradient(vector)  # also without a direction, a point without derivatives is an error
            return np.zeros(self.size)
        step = STEP / largest if np.isfinite(largest) else 0.0
        ahead, behind = self.gradient(vector + step * direction), self.gradient(vector - step * direction)
        return np.asarray((ahead - behind) / (2 * step))

    @property
    def _unknowns(self) -> Unknowns:
        edges = np.full(self.size, np.inf)
        families: tuple[Family, ...] = tuple("normal" for _ in self.problem.axes)
        return Unknowns(self.problem.axes, families, np.column_stack([self.problem.lower, self.problem.upper]),
                        False, -edges, edges)
