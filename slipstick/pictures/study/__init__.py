"""The pictures of a study, each a Vega-Lite v5 specification: where, what is missing, how sure, and the gap closing."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.study import gap, law, likelihood, ranking, residual, screening, signals, surfaces, where
from slipstick.pictures.theme import Spec

__all__ = ["CAPTIONS", "Spec", "study_pictures"]

_MAKERS = {"law": law, "where": where, "screening": screening, "ranking": ranking, "residual": residual,
           "signals": signals, "gap": gap, "likelihood": likelihood}
CAPTIONS = {**{name: maker.CAPTION for name, maker in _MAKERS.items()}, "surfaces": surfaces.CAPTION}
"""Name of each picture there can be, in the order of a report -> what it shows."""


def study_pictures(result: Mapping[str, Any], figure_data: Mapping[str, Any],
                   fits: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Spec]:
    """Name -> picture, of those for which the study left something to draw; the same for the same study.

    `result` is that of `slipstick.study.conclusion`, `figure_data` that of `slipstick.study.evidence`. `fits` has under
    `before` and `after` what the job of a fit on the table of that model left; without them `surfaces` is left out.
    """
    drawn = {name: maker.draw(result, figure_data) for name, maker in _MAKERS.items()}
    if fits is not None:
        drawn["surfaces"] = surfaces.draw(result, figure_data, fits)
    return {name: spec for name, spec in drawn.items() if spec is not None}
