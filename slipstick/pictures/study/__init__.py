"""The pictures of a study as Vega-Lite v5 specifications."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.study import blocks, evidence, gap, law, overlay, signals, surfaces, times
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings

__all__ = ["NAMES", "Spec", "study_pictures"]

_PICTURES = {"overlay": overlay, "law": law, "evidence": evidence, "times": times, "blocks": blocks, "gap": gap,
             "signals": signals}
NAMES = (*_PICTURES, "surfaces")
"""Names of all pictures, in the order of the report."""


def study_pictures(result: StudyResult, figures: Figures,
                   fits: Mapping[str, Mapping[str, Any]] | None = None,
                   settings: StudySettings | None = None) -> dict[str, Spec]:
    """Return name -> specification of each picture for which there are data. The same input gives the same pictures.

    The description of a specification is its caption.

    `fits` are the outputs of the fits on the tables of the models `before` and `after`; without them `surfaces` is
    omitted. `settings` are those of the study, by default the default ones: what it asked for is drawn.
    """
    specs = {name: picture.draw(result, figures, settings or StudySettings()) for name, picture in _PICTURES.items()}
    if fits is not None:
        specs["surfaces"] = surfaces.draw(result, fits)
    return {name: spec for name, spec in specs.items() if spec is not None}
