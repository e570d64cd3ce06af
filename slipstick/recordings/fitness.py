"""What signals must be like so that they can be compared with a simulation, sample by sample."""

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.numerics.equal_steps import require_equal_steps
from slipstick.recordings.recordings import Recordings
from slipstick.recordings.signals import Signals


def require_one_clock(recordings: Recordings) -> None:
    """Raise `InvalidValue` where the signals do not contain the earliest engagement: times in another unit, say.

    An engagement that ends before the second sample is none that the signals show, such as with times in ms.
    """
    assert recordings.signals is not None
    time, shifting_time = recordings.signals.time, recordings.measured_time
    if not time[1] < shifting_time.min() < time[-1]:
        raise InvalidValue(
            f"The signals are from {time[0]:g} to {time[-1]:g} s, and the shifting times from {shifting_time.min():g} "
            f"to {shifting_time.max():g} s",
            "Give the times of the signals in seconds from the shift command, as the shifting times are")


def require_samples(recordings: Recordings, least: int) -> None:
    """Raise `InvalidValue` where samples are not equidistant, or half of the engagements have too few before lock-up.
    """
    assert recordings.signals is not None
    time = recordings.signals.time
    require_equal_steps(time)
    before = float(np.median(np.searchsorted(time, recordings.measured_time)))
    if before < least:
        raise InvalidValue(f"Half of the engagements have at most {before:.0f} samples before lock-up, "
                           f"{1e3 * (time[1] - time[0]):.3g} ms apart", f"Record at least {least}")


def require_no_copies(signals: Signals) -> None:
    """Raise `InvalidValue` where two engagements have the same signals: noise never repeats itself."""
    seen = dict[bytes, int]()
    for row in range(len(signals)):
        content = b"".join(np.ascontiguousarray(signals[name][row]).tobytes() for name in signals.names)
        first = seen.setdefault(content, row)
        if first != row:
            raise InvalidValue(f"The engagements {first} and {row}, numbered from 0, have the same signals",
                               "Leave out the copy: each engagement counts as an observation")
