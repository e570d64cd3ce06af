import json
from collections.abc import Callable
from functools import cache
from xml.etree import ElementTree

import pytest
import vl_convert

from slipstick.pictures import Spec
from slipstick.pictures.drawing import VEGA_LITE


@cache
def svg(picture: str) -> ElementTree.Element:
    # In this process, where a second picture costs much less than the first.
    return ElementTree.fromstring(vl_convert.vegalite_to_svg(picture, vl_version=VEGA_LITE, allowed_base_urls=[]))


@pytest.fixture(scope="session")
def marks() -> Callable[[Spec, str], list[ElementTree.Element]]:
    """The marks of one kind in a drawn picture, in the order they are drawn."""
    def found(spec: Spec, kind: str) -> list[ElementTree.Element]:
        groups = svg(json.dumps(spec)).iter()
        return [path for group in groups if f"mark-{kind} role-mark" in group.get("class", "") for path in group]

    return found
