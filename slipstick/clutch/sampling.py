"""Samples of the state vector within steps, on polynomials through what the method knows of each step."""

from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.lanes import (
    DIRECTION,
    END,
    FIRST,
    LANES,
    MIDDLE,
    MIDPOINT,
    RATE,
    SLIPPING,
    START,
    STEP,
    TIME,
)


@inlined
def sample(b, i, state_size, sample_times, first, end, row, samples):
    """Store the samples of lane i from number `first` up to the time `end` in s; returns the next number.

    Those of eq. 1 lie on the polynomial of fifth degree through their values and rates at the start, the middle and the
    end of the step, and the others on the cubic dense output.
    """
    last = first
    while last < len(sample_times) and sample_times[last] <= end:
        last += 1
    if last == first:
        return last
    step, start_time = b[STEP + i], b[TIME + i]
    now = sample_times[first:last]  # an index that might be negative would be looked up value by value
    per_step = 1.0 / step
    for s in range(state_size):
        k = s * LANES + i
        start, before, middle, after = b[START + k], step * b[FIRST + k], step * b[MIDDLE + k], step * b[RATE + k]
        if s < 3:
            whole, half = b[END + k] - start, b[MIDPOINT + k] - start
            c2 = 7.0 * whole + 16.0 * half - 6.0 * before - 4.0 * middle - after
            c3 = -34.0 * whole - 32.0 * half + 13.0 * before + 16.0 * middle + 5.0 * after
            c4 = 52.0 * whole + 16.0 * half - 12.0 * before - 20.0 * middle - 8.0 * after
            c5 = -24.0 * whole + 4.0 * before + 8.0 * middle + 4.0 * after
        else:
            c2, c3 = middle - 1.5 * before - 0.5 * after, 2.0 / 3.0 * (before - middle + after)
            c4, c5 = 0.0, 0.0
        values = samples[row, s, first:last]
        for j in range(len(now)):
            x = (now[j] - start_time) * per_step
            values[j] = start + x * (before + x * (c2 + x * (c3 + x * (c4 + x * c5))))
    slipping, direction = samples[row, state_size, first:last], samples[row, state_size + 1, first:last]
    for j in range(len(now)):
        slipping[j], direction[j] = b[SLIPPING + i], b[DIRECTION + i]
    return last


@kernel
def clear_samples(samples, row, first):
    """Set the samples of a failed engagement from number `first` on to NaN."""
    for s in range(samples.shape[1]):
        for j in range(first, samples.shape[2]):
            samples[row, s, j] = float("nan")
