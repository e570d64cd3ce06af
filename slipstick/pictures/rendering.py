"""Render pictures as SVG or PNG without a browser, a network or system fonts, by vl-convert with its bundled fonts.

The first picture of a process takes most of a second, in which the library starts its JavaScript engine, and each later
one 0.05 to 0.3 s. No other thread of the process runs meanwhile: a service renders in another process.
"""

import importlib.util
import json
import os
import re
from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeVar

from slipstick.errors import InvalidValue
from slipstick.pictures import accessible
from slipstick.pictures.theme import Spec

Form = Literal["svg", "png"]

_VEGA_LITE = "5.21"  # the latest 5.x version in vl-convert
_PIXEL_RATIO = 2.0  # of a PNG, pixels per px
_FONTS = Path(__file__).with_name("fonts.conf")
_MOST_KEPT = 32
_NO_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_Value = TypeVar("_Value")


def render(spec: Spec, form: Form, caption: str = "") -> bytes:
    """Return the picture as SVG (UTF-8) or PNG. The same picture gives the same bytes on any machine.

    An SVG has the title of the picture, and its subtitle and `caption` as description.
    """
    spec = _as_xml(spec)
    if form == "svg":
        return accessible.described(svg(json.dumps(spec)), spec, _as_xml(caption)).encode()
    # With no allowed base URL, a picture cannot load external data.
    png: bytes = _library().vegalite_to_png(json.dumps(spec), vl_version=_VEGA_LITE, allowed_base_urls=[],
                                            scale=_PIXEL_RATIO)
    return png


def inline(specs: Mapping[str, Spec], captions: Mapping[str, str]) -> dict[str, str]:
    """Return name -> SVG element of each picture for one HTML page, without the title, which the page has as text."""
    elements = {}
    for name, given in specs.items():
        spec = _as_xml(given)
        bare = {**{key: value for key, value in spec.items() if key != "title"}, "background": None}
        own = accessible.with_own_ids(svg(json.dumps(bare)), name)
        elements[name] = accessible.described(own, spec, _as_xml(captions[name]), name)
    return elements


@lru_cache(_MOST_KEPT)
def svg(picture: str) -> str:
    """The SVG of a specification as JSON, the same in any process; those rendered lately are not rendered again."""
    return accessible.numbered(_library().vegalite_to_svg(picture, vl_version=_VEGA_LITE, allowed_base_urls=[]))


def _as_xml(value: _Value) -> _Value:
    """Return a specification or text in which characters that no XML has, such as control characters, are replaced.

    Names in files may have them, and the library ends the process where it is to draw one.
    """
    cleaned: Any = value
    if isinstance(value, str):
        cleaned = _NO_XML.sub("\N{REPLACEMENT CHARACTER}", value)
    elif isinstance(value, Mapping):
        cleaned = {_as_xml(key): _as_xml(entry) for key, entry in value.items()}
    elif isinstance(value, list | tuple):
        cleaned = [_as_xml(entry) for entry in value]
    result: _Value = cleaned
    return result


@cache
def _library() -> ModuleType:
    """vl-convert without the fonts of the system: with them, pictures differ from machine to machine.

    Moreover, the library opens the file of such a font again for each text, which doubles the time of a picture. It
    looks for fonts once, in the folders of this file.
    """
    import vl_convert  # the service renders nothing itself

    before = os.environ.get("FONTCONFIG_FILE")
    os.environ["FONTCONFIG_FILE"] = str(_FONTS)
    try:
        vl_convert.register_font_directory(str(_FONTS.parent))  # has no fonts; those of the file are looked for now
    finally:
        if before is None:
            del os.environ["FONTCONFIG_FILE"]
        else:
            os.environ["FONTCONFIG_FILE"] = before
    return vl_convert


def has_renderer() -> bool:
    """Whether pictures can be drawn as SVG and PNG: the extra `reports` is installed."""
    return importlib.util.find_spec("vl_convert") is not None


def require_renderer() -> None:
    """Raise `InvalidValue` where the renderer of pictures is not installed."""
    if not has_renderer():
        raise InvalidValue("Pictures and reports need vl-convert, which is not installed",
                           "Install it with `pip install 'slipstick[reports]'`, or save the specification as .json")
