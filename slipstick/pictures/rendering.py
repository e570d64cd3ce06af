"""Render pictures as SVG or PNG without a browser, a network or system fonts, by vl-convert with its bundled fonts.

Pictures are rendered in a separate process: the library holds the global interpreter lock for about half a second,
during which a service could not respond. All pictures of a page share one process.
"""

import base64
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock
from typing import Literal

from slipstick.pictures import accessible
from slipstick.pictures.theme import Spec

Form = Literal["svg", "png"]

_SCRIPT = Path(__file__).with_name("drawing.py")
_TIMEOUT = 60  # s
_ONE_AT_A_TIME = Lock()  # each process needs a quarter of a gigabyte
_MOST_KEPT = 64
_LATELY: dict[tuple[Form, str], str] = {}
"""Form and specification -> rendered picture, the oldest first."""


def render(spec: Spec, form: Form, caption: str = "") -> bytes:
    """Return the picture as SVG (UTF-8) or PNG. The same picture gives the same bytes.

    An SVG has the title of the picture, and its subtitle and `caption` as description.
    """
    rendered = _render([json.dumps(spec)], form)[0]
    return base64.b64decode(rendered) if form == "png" else accessible.described(rendered, spec, caption).encode()


def inline(specs: Mapping[str, Spec], captions: Mapping[str, str]) -> dict[str, str]:
    """Return name -> SVG element of each picture for one HTML page, without the title, which the page has as text."""
    bare = [json.dumps({**{key: value for key, value in spec.items() if key != "title"}, "background": None})
            for spec in specs.values()]
    return {name: accessible.described(accessible.with_own_ids(svg, name), specs[name], captions[name], name)
            for name, svg in zip(specs, _render(bare, "svg"), strict=True)}


def _render(pictures: Sequence[str], form: Form) -> list[str]:
    """The pictures as text of SVG or base64 of PNG; those that were rendered lately are not rendered again."""
    with _ONE_AT_A_TIME:
        wanted = [one for one in dict.fromkeys(pictures) if (form, one) not in _LATELY]
        if wanted:
            done = subprocess.run([sys.executable, "-I", str(_SCRIPT), form], input=f"[{','.join(wanted)}]".encode(),
                                  stdout=subprocess.PIPE, timeout=_TIMEOUT, check=True).stdout
            _LATELY.update({(form, one): text for one, text in zip(wanted, json.loads(done), strict=True)})
        rendered = [_LATELY[form, one] for one in pictures]
        for oldest in list(_LATELY)[:-_MOST_KEPT]:
            del _LATELY[oldest]
    return rendered
