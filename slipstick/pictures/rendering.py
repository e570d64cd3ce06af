"""Render pictures as SVG or PNG without a browser, a network or system fonts, by vl-convert with its bundled fonts.

Pictures are rendered in a separate process: the library holds the global interpreter lock for about half a second,
during which a service could not respond. All pictures of a page share one process.
"""

import base64
import json
import subprocess
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Literal

from slipstick.pictures import accessible
from slipstick.pictures.theme import Spec

Form = Literal["svg", "png"]

_SCRIPT = Path(__file__).with_name("drawing.py")
_TIMEOUT = 60  # s
_ONE_AT_A_TIME = Lock()  # each process needs a quarter of a gigabyte


def render(spec: Spec, form: Form, caption: str = "") -> bytes:
    """Return the picture as SVG (UTF-8) or PNG. The same picture gives the same bytes.

    An SVG has the title of the picture, and its subtitle and `caption` as description.
    """
    rendered = _render((json.dumps(spec),), form)[0]
    return base64.b64decode(rendered) if form == "png" else accessible.described(rendered, spec, caption).encode()


def inline(specs: Mapping[str, Spec], captions: Mapping[str, str]) -> dict[str, str]:
    """Return name -> SVG element of each picture for one HTML page, without the title, which the page has as text."""
    bare = tuple(json.dumps({**{key: value for key, value in spec.items() if key != "title"}, "background": None})
                 for spec in specs.values())
    return {name: accessible.described(accessible.with_own_ids(svg, name), specs[name], captions[name], name)
            for name, svg in zip(specs, _render(bare, "svg"), strict=True)} if specs else {}


@lru_cache(maxsize=64)
def _render(pictures: tuple[str, ...], form: Form) -> list[str]:
    with _ONE_AT_A_TIME:
        done = subprocess.run([sys.executable, "-I", str(_SCRIPT), form], input=f"[{','.join(pictures)}]".encode(),
                              stdout=subprocess.PIPE, timeout=_TIMEOUT, check=True).stdout
    rendered: list[str] = json.loads(done)
    return rendered
