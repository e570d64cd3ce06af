"""What jobs run is compiled by studies and a fit of what is shipped: `python -m worker.rehearsal`.

The image is made with it, and a worker runs it beside itself when it starts, at the lowest priority, so that no job
waits for a compiler. With `clutch` or `machines` it compiles what one of both needs, so that two processes share the
work. Numba keeps the machine code (`slipstick.building.compiling`).
"""

import os
import sys

from slipstick.interface.rehearsal import rehearse_clutch, rehearse_machines

_PARTS = {"clutch": rehearse_clutch, "machines": rehearse_machines}

if __name__ == "__main__":
    os.nice(19)
    for part in sys.argv[1:] or _PARTS:
        _PARTS[part]()
