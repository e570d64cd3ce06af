"""Pictures in the pages: panels, each with its title, drawn once and kept."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

import orjson

from slipstick.pictures import Spec

from ..drawings import Drawings


@dataclass(frozen=True)
class Panel:
    """A picture with its title, and a caption that says what is drawn; `note` is further text below it."""

    spec: Spec
    caption: str
    note: str = ""


def draw_panels(drawings: Drawings, panels: list[Panel], *key: str) -> str:
    """Return panels as HTML that stand beside each other where there is room; `key` identifies all that they show."""
    if not panels:
        return ""
    names = {f"{key[0]}-{place}": panel for place, panel in enumerate(panels)}
    drawn: Mapping[str, str] = orjson.loads(drawings.made("elements", lambda: {
        "specs": {name: panel.spec for name, panel in names.items()},
        "captions": {name: panel.caption for name, panel in names.items()}}, *key))
    figures = "\n".join(
        f'<figure class="panel"><h3>{escape(panel.spec["title"]["text"])}</h3>\n'
        f'<div class="picture">{drawn[name]}</div>'
        + (f"<figcaption>{escape(panel.note)}</figcaption>" if panel.note else "") + "</figure>"
        for name, panel in names.items())
    return f'<div class="panels">\n{figures}\n</div>'
