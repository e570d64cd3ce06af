"""Which directions among the parameters recordings do not determine, and the information of bounds in their place.

The bounds of a parameter are knowledge of it: a uniform distribution between them, of standard deviation
(upper - lower) / sqrt(12). A direction is not determined if the recordings inform less about the common values than the
bounds do, with the information of the linearised mixed model. All engagements are linearised about the same point for
this. About points of their own their slopes differ a little, and together they seem to determine what none of them
does: where no pressure was measured, for example, any change of the current's gain is undone exactly by pressure bias,
initial position, temperature gain and friction coefficient.
"""

import numpy as np


def known_from(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Standard deviations (d,) of parameters of which only the bounds are known."""
    return np.asarray((upper - lower) / np.sqrt(12))


def find_undetermined(information: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Directions (d, q) that an information (d, d) does not determine beside standard deviations `known` (d,).

    Each column is as long as one standard deviation in its direction, so that their product with their transpose is the
    covariance that the bounds leave there.
    """
    values, vectors = np.linalg.eigh(known[:, None] * information * known)
    return np.asarray(known[:, None] * vectors[:, values < 1])


def projector(held: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Projector (d, d) of steps onto those that do not move in the `held` directions (d, q) of `find_undetermined`."""
    return np.asarray(np.eye(len(known)) - held @ (held.T / known**2))


def complete(information: np.ndarray, held: np.ndarray, known: np.ndarray) -> np.ndarray:
    """The information (d, d), with that of the bounds in the `held` directions."""
    free, along = projector(held, known), held.T / known**2
    return np.asarray(free.T @ information @ free + along.T @ along)
