"""The likelihood of measured shifting times (section III.B, eq. 7): exact, by expansion, or by sampling."""

from slipstick.uncertainty.likelihood.likelihood import (
    SAMPLES,
    TOLERANCE,
    by_expansion,
    by_sampling,
    compared,
    converged,
    exact,
    expanded_with_lines,
    with_lines,
)
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem, ShiftingTimeModel
from slipstick.uncertainty.likelihood.replicates import LikelihoodEstimate
from slipstick.uncertainty.likelihood.unknowns import Unknowns

__all__ = ["SAMPLES", "TOLERANCE", "Candidate", "InferenceProblem", "LikelihoodEstimate", "ShiftingTimeModel",
           "Unknowns", "by_expansion", "by_sampling", "compared", "converged", "exact",
           "expanded_with_lines", "with_lines"]
