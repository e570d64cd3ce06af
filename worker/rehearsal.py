"""What jobs run is compiled by studies and a fit of what is shipped: `python -m worker.rehearsal`.

The image is made with it, and a worker runs it beside itself when it starts, at the lowest priority, so that no job
waits for a compiler. Numba keeps the machine code (`slipstick.building.compiling`).
"""

import os

from slipstick.interface.rehearsal import rehearse

if __name__ == "__main__":
    os.nice(19)
    rehearse()
