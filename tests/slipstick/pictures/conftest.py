import json
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any
from xml.etree import ElementTree

import pytest

from slipstick.pictures import Spec, rendering


@cache
def parsed(picture: str) -> ElementTree.Element:
    return ElementTree.fromstring(rendering.svg(picture))


@pytest.fixture(scope="session")
def marks() -> Callable[[Spec, str], list[ElementTree.Element]]:
    """The marks of one kind in a rendered picture, in drawing order."""
    def marks_of(spec: Spec, kind: str) -> list[ElementTree.Element]:
        groups = parsed(json.dumps(spec)).iter()
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
