"""Script that renders Vega-Lite pictures: a JSON list on standard input, a JSON list on standard output.

The argument is `svg`, for texts, or `png`, for base64. It imports nothing from the package, so that the process starts
quickly, and the start counts once for all pictures of a page.
"""

import base64
import json
import sys

import vl_convert

VEGA_LITE = "5.21"  # the latest 5.x version in vl-convert
PIXEL_RATIO = 2.0  # of a PNG, pixels per px


def main(form: str) -> None:
    """Render standard input to standard output."""
    pictures = json.load(sys.stdin)
    # With no allowed base URL, a picture cannot load external data.
    rendered = [vl_convert.vegalite_to_svg(one, vl_version=VEGA_LITE, allowed_base_urls=[]) if form == "svg" else
                base64.b64encode(vl_convert.vegalite_to_png(one, vl_version=VEGA_LITE, allowed_base_urls=[],
                                                            scale=PIXEL_RATIO)).decode()
                for one in pictures]
    json.dump(rendered, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
