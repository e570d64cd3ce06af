"""Render pictures as SVG or PNG without a browser, a network or system fonts, by vl-convert with its bundled fonts.

Each picture is rendered in a separate process: the library holds the global interpreter lock for about half a second,
during which a service could not respond.
"""

import json
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Literal

from slipstick.pictures.theme import Spec

Form = Literal["svg", "png"]

_SCRIPT = Path(__file__).with_name("drawing.py")
_TIMEOUT = 60  # s
_ONE_AT_A_TIME = Lock()  # each process needs a quarter of a gigabyte


def render(spec: Spec, form: Form) -> bytes:
    """Return the picture as SVG (UTF-8) or PNG. The same picture gives the same bytes."""
    return _render(json.dumps(spec), form)


@lru_cache(maxsize=64)
def _render(picture: str, form: Form) -> bytes:
    with _ONE_AT_A_TIME:
        return subprocess.run([sys.executable, "-I", str(_SCRIPT), form], input=picture.encode(),
                              stdout=subprocess.PIPE, timeout=_TIMEOUT, check=True).stdout
