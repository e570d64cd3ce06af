"""The first law of a study that can be drawn in small."""

from collections.abc import Mapping
from typing import Any

from slipstick.errors import UnknownName
from slipstick.pictures.panels import draw_thumbnail

_CAPTION = "The measured law without its axes; the report has them."


def drawable_law(output: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]] | None:
    """Return title and numbers of the first law with points in the output of a study; None without one."""
    for finding in output["result"]["findings"]:
        law = finding["law"]
        if law is not None and law["x"] is not None and len(law["x"]) > 1:
            return f"Law: {finding['title']}", law
    return None


def thumbnail(output: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a picture of the law is made of; raises `UnknownName` without a law."""
    drawable = drawable_law(output)
    if drawable is None:
        raise UnknownName("The study has no law with points", "See its report")
    title, law = drawable
    return {"spec": draw_thumbnail(law["x"], law["change"], law["lower"], law["upper"], title), "caption": _CAPTION}
