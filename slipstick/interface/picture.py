"""A picture of a result: a Vega-Lite specification that shows itself in a notebook and is saved as SVG, PNG or HTML."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slipstick.errors import InvalidValue
from slipstick.interface.files import write
from slipstick.pictures.rendering import has_renderer, render, require_renderer
from slipstick.pictures.theme import Spec
from slipstick.report.shell import document, figures

_MEDIA_TYPE = "application/vnd.vegalite.v5+json"
FORMS = (".svg", ".png", ".html", ".json")
"""Suffixes of the files of a picture; JSON is the specification."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture as a Vega-Lite 5 specification `spec`, with its `name` and a `caption` that explains it."""

    name: str
    spec: Spec
    caption: str

    @property
    def title(self) -> str:
        """Title of the picture."""
        return str(self.spec["title"]["text"])

    def save(self, path: Path | str) -> Path:
        """Write the picture as `.svg`, `.png`, `.html` or `.json`, by the suffix of `path`, and return the path.

        Raises `InvalidValue` for another suffix, and where the renderer (extra `reports`) is not installed.
        """
        path = Path(path)
        if path.suffix not in FORMS:
            raise InvalidValue(f"'{path}' is not the name of a picture", f"End it in {', '.join(FORMS)}")
        return write(path, self._content(path.suffix))

    def _content(self, suffix: str) -> bytes:
        if suffix == ".json":
            return (json.dumps(self.spec, ensure_ascii=False, indent=1) + "\n").encode()
        require_renderer()
        match suffix:
            case ".svg":
                return render(self.spec, "svg", self.caption)
            case ".png":
                return render(self.spec, "png")
        drawn = figures({self.name: self.spec}, {self.name: self.caption})
        return document("picture", self.name, self.title, [], list(drawn.values())).encode()

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        """What a notebook shows: the specification, and as a fallback SVG where the renderer is installed."""
        bundle: dict[str, Any] = {_MEDIA_TYPE: self.spec, "text/plain": repr(self)}
        if has_renderer():
            bundle["image/svg+xml"] = render(self.spec, "svg", self.caption).decode()
        return bundle

    def __repr__(self) -> str:
        return f"<Picture '{self.title}': shown in a notebook; save it by .save('{self.name}.svg')>"
