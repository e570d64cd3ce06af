"""The first law of a study that can be drawn in small."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slipstick.errors import UnknownName
from slipstick.pictures.panels import draw_thumbnail

_CAPTION = "The measured law without its axes; the report has them."


@dataclass(frozen=True)
class DrawableLaw:
    """The `change` at the places `x` of what it depends on, between `lower` and `upper`; `title` says what it is."""

    title: str
    x: Sequence[float]
    change: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]


def drawable_law(output: Mapping[str, Any]) -> DrawableLaw | None:
    """Return the first law with points in the output of a study, of a bench or of a machine; None without one."""
    for finding in output["result"]["findings"]:
        law = finding["law"]
        if law is not None and law["x"] is not None and len(law["x"]) > 1:
            return DrawableLaw(f"Law: {finding['title']}", law["x"], law["change"], law["lower"], law["upper"])
    return None


def thumbnail(output: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a picture of the law is made of; raises `UnknownName` without a law."""
    law = drawable_law(output)
    if law is None:
        raise UnknownName("The study has no law with points", "See its report")
    return {"spec": draw_thumbnail(law.x, law.change, law.lower, law.upper, law.title), "caption": _CAPTION}
