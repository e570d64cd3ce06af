"""Pictures as SVG or PNG, drawn without a browser, a network or fonts of the system (vl-convert brings its own).

Each is drawn in a process of its own: the library holds the interpreter while it draws, half a second in which a
service would answer nobody.
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

_DRAW = Path(__file__).with_name("drawing.py")
_SECONDS = 60
_ONE_AT_A_TIME = Lock()  # a quarter of a gigabyte each


def render(spec: Spec, form: Form) -> bytes:
    """The picture as SVG (UTF-8) or PNG; the same bytes for the same picture."""
    return _render(json.dumps(spec), form)


@lru_cache(maxsize=64)
def _render(picture: str, form: Form) -> bytes:
    with _ONE_AT_A_TIME:
        return subprocess.run([sys.executable, "-I", str(_DRAW), form], input=picture.encode(), stdout=subprocess.PIPE,
                              timeout=_SECONDS, check=True).stdout
