"""Times of samples whose steps must be equal."""

import numpy as np

from slipstick.errors import InvalidValue

_UNEVEN = 0.1
"""Share of a step by which samples may be off equal steps: clocks are estimated to about as much."""


def require_equal_steps(time: np.ndarray) -> None:
    """Raise `InvalidValue` where the `time` (k,) of samples in s does not have equal steps."""
    even = np.linspace(time[0], time[-1], len(time))
    off, step = float(np.abs(time - even).max()), float(even[1] - even[0])
    if off > _UNEVEN * step:
        raise InvalidValue(f"The times of the signals are not equidistant: one is {1e3 * off:.3g} ms from where it "
                           f"would be with equal steps of {1e3 * step:.3g} ms",
                           "Interpolate the signals at equal steps, as `import` does")
