"""Selection of the order of an expansion by its error estimate, within a budget of model runs."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.chaos.expansion import Basis, Expansion, ExpansionSettings, expand, make_basis
from slipstick.uncertainty.chaos.germs import Germ
from slipstick.uncertainty.chaos.truncation import HIGHEST_ORDER


@dataclass(frozen=True, eq=False)
class Adapted:
    """The best `expansion` of the orders tried, its `error` in s, and whether the error `reached` the tolerance.

    The error is the largest over the conditions that have an expansion, and inf if none has one. The best expansion is
    the one with the fewest conditions without an expansion; ties are resolved by the error. `runs` is the number of
    model runs for all orders together.
    """

    expansion: Expansion
    error: float
    reached: bool
    runs: int


def adapt(model: Callable[[np.ndarray], np.ndarray], germs: tuple[Germ, ...], tolerance: float, most_runs: int,
          settings: ExpansionSettings | None = None) -> Adapted:
    """Expand `model`, germs (q, d) -> times (q, n) in s, at the lowest order with an error of at most `tolerance` s.

    The order starts at 1 and is raised by 2 for one or two inputs, and by 1 for more; `settings` determine the rest.
    The number of model runs is limited to `most_runs`, because the error decreases slowly on surfaces with kinks.
    Raises `InvalidValue` if `most_runs` does not suffice for order 1, or if the settings disable the error estimate.
    """
    settings = settings or ExpansionSettings()
    best = _try(model, make_basis(germs, replace(settings, order=1)), tolerance, 0, most_runs)
    if best is None:
        raise InvalidValue(f"{most_runs} runs do not suffice for order 1 in {len(germs)} inputs", "Allow more runs")
    runs, step = best.runs, 2 if len(germs) <= 2 else 1
    for order in range(1 + step, HIGHEST_ORDER + 1, step):
        if best.reached:
            break
        try:
            basis = make_basis(germs, replace(settings, order=order))
        except InvalidValue:  # too many terms for the nodes or samples
            break
        adapted = _try(model, basis, tolerance, runs, most_runs)
        if adapted is None:
            break
        runs = adapted.runs
        best = min(best, adapted, key=_rank)
    return replace(best, runs=runs)


def _try(model: Callable[[np.ndarray], np.ndarray], basis: Basis, tolerance: float, runs: int,
         most_runs: int) -> Adapted | None:
    if not basis.error_weights.any():
        raise InvalidValue("The tensor rule has no error estimate without checks", "Set checks to 1 or more")
    runs += len(basis.nodes)
    if runs > most_runs:
        return None
    expansion = expand(basis, model(basis.nodes))
    errors = expansion.error[~expansion.missing]
    error = float(errors.max()) if errors.size else np.inf
    return Adapted(expansion, error, error <= tolerance, runs)


def _rank(adapted: Adapted) -> tuple[int, float]:
    return int(adapted.expansion.missing.sum()), adapted.error
