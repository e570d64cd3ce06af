"""Rendered SVG: one image with a title and a description, values of points as titles, and colours for the dark."""

import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

import pytest

from slipstick.pictures import CAPTIONS, pictures, rendering, theme
from slipstick.pictures.accessible import dark_style
from slipstick.pictures.rendering import inline, render

Made = Callable[..., dict[str, Any]]
SVG = "{http://www.w3.org/2000/svg}"
LIGHT_PAGE, DARK_PAGE = "white", "#14191e"


@pytest.fixture(scope="module")
def drawn(made: Made) -> dict[str, str]:
    output = made(n=20)
    output["figure_data"]["engagement"]["measured"]["pressure"][3] = -1.2
    return inline(pictures(output), CAPTIONS)


def test_every_picture_has_a_title_and_a_description(drawn: dict[str, str]) -> None:
    for name, svg in drawn.items():
        root = ElementTree.fromstring(svg)
        assert root.get("role") == "img"
        title, about = root[0], root[1]
        assert (title.tag, about.tag) == (f"{SVG}title", f"{SVG}desc")
        assert (root.get("aria-labelledby"), root.get("aria-describedby")) == (title.get("id"), about.get("id"))
        assert CAPTIONS[name] in (about.text or "")
        assert "aria-label=" not in svg


def test_no_two_pictures_of_a_page_share_an_identifier(drawn: dict[str, str]) -> None:
    found = [identifier for svg in drawn.values() for identifier in re.findall(r'\bid="([^"]+)"', svg)]
    assert len(found) == len(set(found)) > len(drawn)
    used = {identifier for svg in drawn.values() for identifier in re.findall(r"url\(#([^)]+)\)", svg)}
    assert used
    assert used <= set(found)


def test_a_picture_does_not_depend_on_those_drawn_before(made: Made) -> None:
    spec = pictures(made(n=20))["profiles"]
    first = render(spec, "svg")
    render({**spec, "background": "white"}, "svg")
    rendering.svg.cache_clear()
    assert render(spec, "svg") == first


def test_points_have_their_values_and_conditions_as_titles(drawn: dict[str, str]) -> None:
    titles = [title.text or "" for title in ElementTree.fromstring(drawn["comparison"]).iter(f"{SVG}title")]
    assert len(titles) == 1 + 4 * 20
    assert "conditions: profile 0, motor 105 rad/s" in titles[1]


def test_characters_that_no_xml_has_are_replaced(made: Made) -> None:
    spec = pictures(made(n=20))["profiles"]
    odd = "a\x00\x08\x1b\ufffe\ud800 <b>& \U0001f600"
    spec = {**spec, "title": {**spec["title"], "text": odd}, "datasets": {odd: [{odd: 1.0}]}}
    root = ElementTree.fromstring(render(spec, "svg", odd))
    said = "a\ufffd\ufffd\ufffd\ufffd\ufffd <b>& \U0001f600"
    assert root[0].text == said
    assert said in (root[1].text or "")
    assert ElementTree.fromstring(inline({"odd": spec}, {"odd": odd})["odd"])[0].text == said
    assert render(spec, "png").startswith(b"\x89PNG")


def test_a_picture_alone_has_its_title_as_well(made: Made) -> None:
    spec = pictures(made(n=20))["convergence"]
    svg = render(spec, "svg", "A & B <c>").decode()
    root = ElementTree.fromstring(svg)
    assert root[0].text == spec["title"]["text"]
    assert (root[1].text or "").endswith("A & B <c>")


def test_every_colour_has_one_for_the_dark(drawn: dict[str, str]) -> None:
    used = {colour for svg in drawn.values() for colour in re.findall(r'(?:fill|stroke)="(#\w{6}|white|black)"', svg)}
    assert len(used) > 10
    assert used <= theme.DARK.keys()
    assert f'.picture [stroke="{theme.INK}"] {{ stroke: {theme.DARK[theme.INK]}; }}' in dark_style()


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.2."""
    text = "#ffffff" if colour == "white" else colour
    parts = [int(text[place:place + 2], 16) / 255 for place in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    high, low = sorted((luminance(first), luminance(second)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("colour", [theme.INK, theme.MEASURED, theme.FAINT])
def test_text_has_contrast_in_light_and_dark(colour: str) -> None:
    assert contrast(colour, LIGHT_PAGE) >= 4.5
    assert contrast(theme.DARK[colour], DARK_PAGE) >= 4.5
    assert contrast(theme.DARK[colour], LIGHT_PAGE) < 4.5  # the colours of one page do not suit the other


@pytest.mark.parametrize("colour", [theme.AFTER, theme.ALARM])
def test_marks_have_contrast_in_light_and_dark(colour: str) -> None:
    assert contrast(colour, LIGHT_PAGE) >= 3
    assert contrast(theme.DARK[colour], DARK_PAGE) >= 3


def test_shades_keep_their_order() -> None:
    light, dark = ([luminance(shade) for shade in shades] for shades in (
        theme.SHADES, [theme.DARK[shade] for shade in theme.SHADES]))
    assert all(first < second for first, second in pairwise(light))
    assert all(first > second for first, second in pairwise(dark))
