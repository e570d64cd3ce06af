"""Numbers of measured laws, with the standard errors that these have."""

from collections.abc import Iterator, Sequence

import numpy as np

from evidence.real import Row
from slipstick.engine.fit import Fit
from slipstick.engine.measured_law import measure
from slipstick.engine.recordings import Pair
from slipstick.engine.selection import Identification
from slipstick.engine.study import estimate_parameters


def state_parameters(answer: Identification) -> Iterator[Row]:
    """Yield the parameters that are no begins of runs, and the mean chi-square of each block."""
    for fit in answer.fits:
        declared = {each.name: each for each in fit.recorded.machine.parameters}
        for known in estimate_parameters(fit):
            if declared[known.name].first_of is None:
                yield Row(known.name, known.mean, known.error, declared[known.name].unit)
        for block, chi in fit.chi_square.items():
            yield Row(f"chi-square of {block}", float(chi.mean()), float(chi.std() / np.sqrt(len(chi))), "")


def state_changes(fit: Fit, pair: Pair, origin: float, places: Sequence[float]) -> Iterator[Row]:
    """Yield what a law is at some places beyond what it is at the `origin`; nothing where the fit has no such law."""
    if pair not in fit.laws:
        return
    law = measure(fit, pair)
    for place in places:
        hats = np.array([np.interp(place, law.x, row) - np.interp(origin, law.x, row) for row in np.eye(len(law.x))])
        error = float(np.sqrt(hats @ law.covariance @ hats))
        yield Row(f"{pair[0]} at {pair[1]} {place:g}", float(hats @ law.change), error, law.unit)
