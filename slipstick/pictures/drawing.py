"""Script that renders a Vega-Lite picture from standard input to standard output, as the argument `svg` or `png`.

It imports nothing from the package, so that the process starts quickly.
"""

import sys

import vl_convert

VEGA_LITE = "5.21"  # the latest 5.x version in vl-convert
PIXEL_RATIO = 2.0  # of a PNG, pixels per px

if __name__ == "__main__":
    picture = sys.stdin.read()
    # With no allowed base URL, a picture cannot load external data.
    rendered = vl_convert.vegalite_to_svg(picture, vl_version=VEGA_LITE, allowed_base_urls=[]).encode() \
        if sys.argv[1] == "svg" else \
        vl_convert.vegalite_to_png(picture, vl_version=VEGA_LITE, allowed_base_urls=[], scale=PIXEL_RATIO)
    sys.stdout.buffer.write(rendered)
