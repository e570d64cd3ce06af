"""Pictures in the pages: panels, each with its title, drawn once and kept."""

from collections.abc import Mapping, Sequence
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

    @property
    def title(self) -> str:
        """The quantity with its unit."""
        return str(self.spec["title"]["text"])


def draw_panels(drawings: Drawings, panels: list[Panel], *key: str) -> str:
    """Return panels as HTML that stand beside each other where there is room; `key` identifies all that they show."""
    if not panels:
        return ""
    figures = "\n".join(
        f'<figure class="panel"><h3>{escape(panel.title)}</h3>\n<div class="picture">{drawn}</div>'
        + (f"<figcaption>{escape(panel.note)}</figcaption>" if panel.note else "") + "</figure>"
        for panel, drawn in zip(panels, draw_elements(drawings, panels, key[0], *key), strict=True))
    return f'<div class="panels">\n{figures}\n</div>'


def draw_elements(drawings: Drawings, panels: Sequence[Panel], prefix: str, *key: str) -> list[str]:
    """Return the SVG element of each panel, in which identifiers begin with `prefix`; without a `key` none is kept."""
    names = {f"{prefix}-{place}": panel for place, panel in enumerate(panels)}
    drawn: Mapping[str, str] = orjson.loads(drawings.made("elements", lambda: {
        "specs": {name: panel.spec for name, panel in names.items()},
        "captions": {name: panel.caption for name, panel in names.items()}}, *key))
    return [drawn[name] for name in names]
