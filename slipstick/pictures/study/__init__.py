"""The pictures of a study as Vega-Lite v5 specifications."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.study import gap, law, likelihood, ranking, residual, screening, signals, surfaces, where
from slipstick.pictures.theme import Spec

__all__ = ["CAPTIONS", "Spec", "study_pictures"]

_PICTURES = {"law": law, "where": where, "screening": screening, "ranking": ranking, "residual": residual,
             "signals": signals, "gap": gap, "likelihood": likelihood}
CAPTIONS = {**{name: picture.CAPTION for name, picture in _PICTURES.items()}, "surfaces": surfaces.CAPTION}
"""Name of each picture, in the order of the report -> caption."""


def study_pictures(result: Mapping[str, Any], figure_data: Mapping[str, Any],
                   fits: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Spec]:
    """Return name -> specification of each picture for which there are data. The same input gives the same pictures.

    `result` is the result of `slipstick.study.conclusion`, and `figure_data` that of `slipstick.study.evidence`. `fits`
    are the outputs of the fits on the tables of the models `before` and `after`; without them `surfaces` is omitted.
    """
    specs = {name: picture.draw(result, figure_data) for name, picture in _PICTURES.items()}
    if fits is not None:
        specs["surfaces"] = surfaces.draw(result, figure_data, fits)
    return {name: spec for name, spec in specs.items() if spec is not None}
