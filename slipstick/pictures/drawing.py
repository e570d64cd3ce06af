"""Run as a script, with `svg` or `png` as its argument: a Vega-Lite picture on standard input, drawn on the output.

It imports nothing of the package, so that the process is quick to start.
"""

import sys

import vl_convert

VEGA_LITE = "5.21"  # the newest of version 5 that the library has
DOTS = 2.0  # of a PNG, per px

if __name__ == "__main__":
    picture = sys.stdin.read()
    # An empty list of addresses: what a picture might refer to is not fetched.
    drawn = vl_convert.vegalite_to_svg(picture, vl_version=VEGA_LITE, allowed_base_urls=[]).encode() \
        if sys.argv[1] == "svg" else \
        vl_convert.vegalite_to_png(picture, vl_version=VEGA_LITE, allowed_base_urls=[], scale=DOTS)
    sys.stdout.buffer.write(drawn)
