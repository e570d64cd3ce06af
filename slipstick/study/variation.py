"""How much every parameter varies from run to run, also those that a fit holds alike in all runs.

A fit lets the parameters scatter that recordings speak of most. What a right model leaves is more: the others scatter
too, by less. Here all do, in the experiments linearised about the fit, with the sensors' noise.
"""

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.study.marginal import shifted
from slipstick.study.mixed import MixedFit

_UPDATES = 100
_FIRST, _SMALLEST = 0.005**2, 1e-12  # variances of a multiplier: at the start, and the least


def covariance(conditions: Conditions, found: MixedFit) -> np.ndarray:
    """Of the multipliers of all parameters from run to run, (d, d): the fit's own scatter, and variances of the others.

    Expectation-maximization finds these. What follows the conditions is no scatter: a model that is wrong in some
    conditions is not excused by it.
    """
    d, own = len(found.design.parameters), list(found.design.scattering)
    gram = shifted(found.about.gram, found.state.modes, found.design.scattering).sum(axis=0)
    inner, slope = gram[:, :d, :d], gram[:, :d, -1:]
    apart, spread = _apart(conditions), _FIRST * np.eye(d)
    spread[np.ix_(own, own)] = found.scatter
    others = [place for place in range(d) if place not in own]
    for _ in range(_UPDATES):
        open_ = np.linalg.inv(inner + np.linalg.inv(spread))
        modes = apart @ (open_ @ slope)[..., 0]
        new = (modes**2).sum(axis=0) / np.trace(apart) + np.einsum("ndd->d", open_) / len(gram) + _SMALLEST
        spread[others, others] = new[others]
    return spread


def _apart(conditions: Conditions) -> np.ndarray:
    """The projection (n, n) of values of n experiments onto what their conditions, one by one, do not explain."""
    columns = [np.ones((len(conditions), 1))]
    for values in (conditions.current_profile, conditions.motor_speed, conditions.load_inertia,
                   conditions.brake_torque):
        levels = np.unique(values)
        if 2 * len(levels) < len(values):
            columns.append((values[:, None] == levels[1:]).astype(float))
    basis, strength, _ = np.linalg.svd(np.concatenate(columns, axis=1), full_matrices=False)
    known = basis[:, strength > 1e-9 * strength[0]]
    return np.asarray(np.eye(len(known)) - known @ known.T)
