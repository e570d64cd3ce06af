import json
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any
from xml.etree import ElementTree

import pytest
import vl_convert

from slipstick.pictures import Spec
from slipstick.pictures.drawing import VEGA_LITE


@cache
def svg(picture: str) -> ElementTree.Element:
    # Rendered in this process, in which all pictures after the first are cheap.
    return ElementTree.fromstring(vl_convert.vegalite_to_svg(picture, vl_version=VEGA_LITE, allowed_base_urls=[]))


@pytest.fixture(scope="session")
def marks() -> Callable[[Spec, str], list[ElementTree.Element]]:
    """The marks of one kind in a rendered picture, in drawing order."""
    def marks_of(spec: Spec, kind: str) -> list[ElementTree.Element]:
        groups = svg(json.dumps(spec)).iter()
        return [path for group in groups if f"mark-{kind} role-mark" in group.get("class", "") for path in group]

    return marks_of


def encoded(view: Any) -> Iterator[Spec]:
    if isinstance(view, dict):
        yield from (view["encoding"][channel] for channel in "xy" if channel in view.get("encoding", ()))
        for part in view.values():
            yield from encoded(part)
    elif isinstance(view, list):
        for part in view:
            yield from encoded(part)


@pytest.fixture(scope="session")
def scales() -> Callable[[Spec], Iterator[Spec]]:
    """All x and y encodings of a picture."""
    return encoded
