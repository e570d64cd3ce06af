"""The pictures of a fit, each a Vega-Lite v5 specification made of what the fit left behind and nothing else."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import comparison, convergence, densities, engagement, inputs, profiles
from slipstick.pictures.theme import Spec

__all__ = ["CAPTIONS", "Spec", "pictures"]

_MAKERS = {"comparison": comparison, "inputs": inputs, "profiles": profiles, "densities": densities,
           "engagement": engagement, "convergence": convergence}
CAPTIONS = {name: maker.CAPTION for name, maker in _MAKERS.items()}
"""Name of each picture there can be, in the order of a report -> what it shows."""


def pictures(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> dict[str, Spec]:
    """Name -> picture, of those for which the fit left something to draw; the same for the same fit.

    `result` is that of a fit, and `figure_data` what the worker computes to show it:

        conditions    columns `current_profile`, `motor_speed`, `load_inertia`, `brake_torque`, one value an experiment
        prediction    columns of the same length: `condition`, its number; `measured`, `before`, `mean`, `std` in s;
                      `density_time` and `density`, a list each, in s and per ms. Null: it never locks
        surface       `log10_likelihood` [g1][g2] over the means `first` (g1) and `second` (g2) of two `axes`, or null
        engagement    one `condition`: signals `measured` (or null) and `simulated`, lists in SI units and bar over
                      `time`, `current` in A, `touch` and `lock` in s (null: never) and the `gear_ratio`; or null
    """
    drawn = {name: maker.draw(result, figure_data) for name, maker in _MAKERS.items()}
    return {name: spec for name, spec in drawn.items() if spec is not None}
