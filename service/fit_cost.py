"""What a fit costs at most, in shifting times that a table interpolates, so that no job blocks all others for days."""

from slipstick.uncertainty.chaos import make_basis
from slipstick.uncertainty.chaos.families import HERMITE
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.classic import candidate_count
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem

from .problem_details import TooLarge

# Measured on one core: 1.9e8 shifting times a second by interpolation in a table of two axes, 5.1e5 by simulation, and
# 26 µs for one candidate and condition of the likelihood along lines.
_SIMULATION = 370
_LINES = 5000
_SHORT = 110_000_000_000  # about ten minutes


def fit_cost(settings: FitSettings, problem: InferenceProblem, simulate: bool) -> int:
    """Number of interpolations that take as long as the search of the fit, if it does not stop early."""
    each = _SIMULATION if simulate else 1
    if settings.method == "classic":
        candidates = candidate_count(settings, search_space(settings, problem))
        work = settings.samples * each
    else:
        basis = make_basis((HERMITE,) * len(problem.axes), settings.expansion(len(problem.axes)))
        candidates = settings.population * settings.generations
        work = len(basis.nodes) * each + (settings.samples if settings.integration == "sampling" else _LINES)
    return candidates * work * len(problem.measured_time)


def queue_of(cost: int) -> str:
    """The queue of a fit: the long one if it could take more than about ten minutes on one core."""
    return "short" if cost <= _SHORT else "long"


def require_cost(cost: int, most: int) -> None:
    """Raise `TooLarge` if a fit costs more than `most` interpolations."""
    if cost > most:
        raise TooLarge(f"The fit can cost {cost:.2g} interpolations of shifting times; the limit is {most:.2g}",
                       "Request fewer candidates (population, generations, grid) or samples, interpolate a table "
                       "instead of simulating, or let the administrator increase SLIPSTICK_FIT_VALUES")
