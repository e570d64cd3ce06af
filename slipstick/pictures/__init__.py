"""The pictures of a fit as Vega-Lite v5 specifications, computed from the output of the fit alone."""

from collections.abc import Collection, Mapping
from typing import Any

from slipstick.pictures import (
    calibration,
    comparison,
    convergence,
    densities,
    engagement,
    inputs,
    pairs,
    profiles,
    residuals,
)
from slipstick.pictures.theme import Spec

__all__ = ["CAPTIONS", "Spec", "pictures"]

_PICTURES = {"comparison": comparison, "residuals": residuals, "inputs": inputs, "profiles": profiles, "pairs": pairs,
             "densities": densities, "calibration": calibration, "engagement": engagement, "convergence": convergence}
CAPTIONS = {name: picture.CAPTION for name, picture in _PICTURES.items()}
"""Name of each picture, in the order of the report -> caption."""


def pictures(output: Mapping[str, Any], names: Collection[str] = CAPTIONS) -> dict[str, Spec]:
    """Return name -> specification of each picture for which there are data. The same input gives the same pictures.
    Only those of `names` are computed.

    `output` is the output of a fit: its `result`, `physical` (unit and nominal value of each input), and `figure_data`,
    computed by the worker for its pictures:

        output        `name` and `unit` of what was measured if it is another machine's; null for shifting times
        conditions    columns `current_profile`, `motor_speed`, `load_inertia`, `brake_torque`, or those of
                      another machine, such as `voltage [V]`, one value per experiment
        prediction    columns of the same length: `condition` (its index); `measured`, `before`, `mean`, `std` in s;
                      lists `density_time` in s and `density` per ms. A time is null if the engagement never locks
        search        names of the `unknowns` (k), the `estimate` (k), the best candidate after each generation as
                      `path`, and for each profile likelihood a trace: all unknowns at the points of its curve
        surface       `log10_likelihood` [g1][g2] over the means `first` (g1) and `second` (g2) of two `axes`, or null
        engagement    null, or one `condition`: signals `measured` (or null) and `simulated` as lists over `time`, in SI
                      units and bar, `current` in A, `touch` and `lock` in s (null if never), and `gear_ratio`
    """
    specs = {name: picture.draw(output) for name, picture in _PICTURES.items() if name in names}
    return {name: spec for name, spec in specs.items() if spec is not None}
