"""The order of an expansion by its own estimate of the error: raised until that is small enough or runs are used up."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.expansion import Basis, Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.chaos.germs import Germ
from slipstick.uncertainty.chaos.truncation import HIGHEST_ORDER


@dataclass(frozen=True, eq=False)
class Adapted:
    """The best `expansion` of those tried, its `error` in s, and whether that `reached` the tolerance.

    The error is the largest over the conditions that have an expansion, inf where none has; fewer conditions without
    one are better than a smaller error. `runs` counts the germs at which the model ran, for all orders tried.
    """

    expansion: Expansion
    error: float
    reached: bool
    runs: int


def adapt(model: Callable[[np.ndarray], np.ndarray], germs: tuple[Germ, ...], tolerance: float, most_runs: int,
          settings: ExpansionSettings | None = None) -> Adapted:
    """Expand `model`, germs (q, d) -> times (q, n) in s, at the lowest order with an error of at most `tolerance` s.

    Orders rise from 1, by 2 in one and two inputs and by 1 in more; `settings` say the rest. On surfaces with kinks the
    error falls slowly, and `most_runs` of the model end the search. Raises `InvalidValue` where they do not suffice for
    order 1, or the settings leave the error out.
    """
    wanted = settings or ExpansionSettings()
    best = _try(model, make_basis(germs, replace(wanted, order=1)), tolerance, 0, most_runs)
    if best is None:
        raise InvalidValue(f"{most_runs} runs do not suffice for order 1 in {len(germs)} inputs", "Allow more runs")
    runs, step = best.runs, 2 if len(germs) <= 2 else 1
    for order in range(1 + step, HIGHEST_ORDER + 1, step):
        if best.reached:
            break
        try:
            basis = make_basis(germs, replace(wanted, order=order))
        except InvalidValue:  # more terms than there are nodes or samples for
            break
        tried = _try(model, basis, tolerance, runs, most_runs)
        if tried is None:
            break
        runs = tried.runs
        best = min(best, tried, key=_rank)
    return replace(best, runs=runs)


def _try(model: Callable[[np.ndarray], np.ndarray], basis: Basis, tolerance: float, runs: int,
         most_runs: int) -> Adapted | None:
    if not basis.error_weights.any():
        raise InvalidValue("Without checks the error of the tensor rule is not known", "Give the settings checks")
    runs += len(basis.nodes)
    if runs > most_runs:
        return None
    expansion = expand(basis, model(basis.nodes))
    errors = expansion.error[~expansion.missing]
    error = float(errors.max()) if errors.size else np.inf
    return Adapted(expansion, error, error <= tolerance, runs)


def _rank(adapted: Adapted) -> tuple[int, float]:
    return int(adapted.expansion.missing.sum()), adapted.error
