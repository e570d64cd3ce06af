"""Rendered SVG for people who cannot see it, for pages with several, and for the dark: titles, identifiers, colours."""

import re
from html import escape, unescape

from slipstick.pictures import theme
from slipstick.pictures.theme import Spec

_POINT = re.compile(r'<path aria-label="([^"]*)" role="graphics-symbol" aria-roledescription="point"([^>]*?)/>')
_ARIA = re.compile(r' (?:aria-[a-z]+|role)="[^"]*"')
_LONG = re.compile(r'(?<=[" ])(?:d|transform|x2?|y2?|width|height)="[^"]*"')
_DECIMALS = re.compile(r"(\.\d\d)\d+")
_ID = re.compile(r'(\bid="|url\(#)([^")]+)')
_ROOT = re.compile(r"<svg( [^>]*)>")


def described(svg: str, spec: Spec, caption: str, prefix: str = "picture") -> str:
    """Return the SVG of `spec` as one image with a title and a description.

    The values of a point are its title, which browsers show beside the pointer without a script. Other labels that
    Vega writes repeat coordinates of curves. Coordinates are cut to hundredths of a pixel.
    """
    svg = _POINT.sub(lambda match: f"<path{match[2]}><title>{escape(unescape(match[1]), quote=False)}</title></path>",
                     svg)
    svg = _LONG.sub(lambda match: _DECIMALS.sub(r"\1", match[0]), _ARIA.sub("", svg))
    text = " ".join([*spec["title"]["subtitle"], caption]).strip()
    title, about = (f"{escape(prefix)}-{part}" for part in ("title", "description"))
    return _ROOT.sub(lambda match: f'<svg role="img" aria-labelledby="{title}" aria-describedby="{about}"{match[1]}>'
                                   f'<title id="{title}">{escape(spec["title"]["text"], quote=False)}</title>'
                                   f'<desc id="{about}">{escape(text, quote=False)}</desc>', svg, count=1)


def numbered(svg: str) -> str:
    """Return the SVG with identifiers numbered from 1; Vega counts through all pictures of a process."""
    known: dict[str, str] = {}

    def rename(match: re.Match[str]) -> str:
        return match[1] + known.setdefault(match[2], f"id{len(known) + 1}")

    return _ID.sub(rename, svg)


def with_own_ids(svg: str, prefix: str) -> str:
    """Return the SVG with identifiers that no other picture of the page has, so that it is not cut by another's."""
    return _ID.sub(rf"\1{prefix}-\2", svg)


def dark_style() -> str:
    """Return CSS rules that replace the colours of the theme within `.picture` by those for a dark background."""
    rules = (f'.picture [{part}="{light}"] {{ {part}: {dark}; }}'
             for light, dark in theme.DARK.items() for part in ("fill", "stroke"))
    return "\n".join(rules)
