"""The main loop: loads engagements into lanes, records lock-up, and samples the signals."""

import numpy as np

from slipstick.clutch.driveline import driveline
from slipstick.clutch.fastmath import allocating, kernel
from slipstick.clutch.hydraulics import hydraulics
from slipstick.clutch.integrator import (
    DIVERGES,
    LOCKS,
    NO_EVENT,
    accept_step,
    apply_event,
    dense_output,
    first_stage,
    locate_event,
    mark_events,
    other_stages,
)
from slipstick.clutch.lanes import (
    BUFFER_SIZE,
    CLEARANCE,
    CLUTCH_TORQUE,
    CONTACT_POSITION,
    CURVES,
    DIRECTION,
    EVENT,
    GEAR,
    LANES,
    LAWS,
    SEGMENT_END,
    SLIPPING,
    STAGE,
    STAGE_TIME,
    STEP,
    TIME,
)
from slipstick.clutch.loading import load, park, set_segment

LOCKED, NEVER_LOCKED, FAILED = 0, 1, 2


@allocating
def workspace(curves, laws):
    """Working memory aligned to a cache line; unaligned, every vector of lanes would span two lines."""
    memory = np.zeros(BUFFER_SIZE + 8)
    first = -(memory.ctypes.data // 8) % 8
    # As loops: the check of the shapes in an assignment of slices takes numba over a second to compile.
    for k in range(len(curves)):
        memory[first + CURVES + k] = curves[k]
    for k in range(len(laws)):
        memory[first + LAWS + k] = laws[k]
    return memory[first:first + BUFFER_SIZE]


def drive(first, stop, conditions_per_point, vectors, coefficients, active_effects, curves, laws, conditions, profiles,
          initial_speed, profile_segments, fine, coarse, sample_times, samples, times, status):
    """Simulate engagements first..stop-1; fill `times` in s, `status`, and `samples` of this range at `sample_times`.

    Engagement e combines point e // conditions_per_point and condition e modulo n: conditions_per_point = n combines
    every point with all n conditions, 1 pairs them. `conditions` is (n, 5): motor speed, load inertia, brake torque,
    position in the run order, given input torque. `curves` are the `Converter.terms`, `laws` the `law_kernels.terms`.
    `profiles` is (n, 2): current profile, column of `initial_speed`. A sample is the state vector, the slip flag and
    the sign of the slip. An engagement that has not locked by the end of its current profile counts as never locked.
    """
    active, state_size = active_effects.flags, active_effects.state_size
    n, count, last_segment = len(conditions), len(sample_times), profile_segments.shape[1] - 1
    b = workspace(curves, laws)
    engagements, profile = np.full(LANES, -1), np.zeros(LANES, np.int64)
    segment, sampled = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    next_engagement, busy_lanes = first, 0
    while True:
        for i in range(LANES):
            if engagements[i] < 0 and next_engagement < stop:
                point, condition = next_engagement // conditions_per_point, next_engagement % n
                profile[i] = profiles[condition, 0]
                load(b, i, vectors, coefficients, active_effects, point, conditions, condition,
                     initial_speed[point, profiles[condition, 1]])
                set_segment(b, i, profile_segments, profile[i], 0)
                times[next_engagement], status[next_engagement] = np.nan, NEVER_LOCKED
                engagements[i], segment[i], sampled[i] = next_engagement, 0, 0
                next_engagement += 1
                busy_lanes += 1
            elif engagements[i] < 0:
                park(b, i)
        if busy_lanes == 0:
            return
        has_free_lane = False
        while not has_free_lane:
            first_stage(b, active, fine, coarse)
            other_stages(b, active)
            marks = mark_events(b)
            if count > 0:
                for i in range(LANES):
                    if engagements[i] >= 0:
                        row = engagements[i] - first
                        sampled[i] = sample(b, i, state_size, sample_times, sampled[i], samples, row)
            accept_step(b, active)
            if marks == 0 and count == 0:
                continue
            for i in range(LANES):
                engagement = engagements[i]
                if engagement < 0 or (b[EVENT + i] == 0.0 and sampled[i] < count):
                    continue
                event = NO_EVENT
                if b[EVENT + i] > 1.0:
                    event, fraction = locate_event(b, i)
                    apply_event(b, i, event, fraction, state_size)
                    if event == LOCKS and status[engagement] == NEVER_LOCKED and segment[i] < last_segment:
                        times[engagement], status[engagement] = b[TIME + i], LOCKED
                    elif event == DIVERGES:
                        times[engagement], status[engagement] = np.nan, FAILED
                        clear_samples(samples, engagement - first, sampled[i])
                if b[TIME + i] >= b[SEGMENT_END + i]:
                    segment[i] += 1
                    set_segment(b, i, profile_segments, profile[i], segment[i])
                is_decided = status[engagement] == LOCKED or segment[i] == last_segment
                if event == DIVERGES or (is_decided and sampled[i] == count):
                    engagements[i] = -1
                    busy_lanes -= 1
                    has_free_lane = True


@kernel
def sample(b, i, state_size, sample_times, position, samples, row):
    """Store the samples of lane i from `position` up to the end of its step; returns the next position."""
    event, fraction = NO_EVENT, 1.0
    if b[EVENT + i] > 1.0:
        event, fraction = locate_event(b, i)
    end = b[TIME + i] + fraction * b[STEP + i]
    while event != DIVERGES and position < len(sample_times) and sample_times[position] <= end:
        at = (sample_times[position] - b[TIME + i]) / b[STEP + i]
        for s in range(state_size):
            samples[row, position, s] = dense_output(b, s * LANES + i, at)
        samples[row, position, state_size] = b[SLIPPING + i]
        samples[row, position, state_size + 1] = b[DIRECTION + i]
        position += 1
    return position


@kernel
def clear_samples(samples, row, position):
    """Set the samples of a failed engagement from `position` on to NaN."""
    for k in range(position, samples.shape[1]):
        for s in range(samples.shape[2]):
            samples[row, k, s] = np.nan


def observe(first, stop, conditions_per_point, vectors, coefficients, active_effects, curves, laws, conditions,
            profiles, profile_segments, sample_times, samples, signals):
    """Compute signals[:, engagement, time] from samples: pressure, both speeds, output torque, piston position.

    The arguments are those of `drive`.
    """
    active, state_size = active_effects.flags, active_effects.state_size
    n, count = len(conditions), len(sample_times)
    b = workspace(curves, laws)
    for engagement in range(first, stop):
        point, condition = engagement // conditions_per_point, engagement % n
        profile = profiles[condition, 0]
        segment = 0
        for i in range(LANES):
            load(b, i, vectors, coefficients, active_effects, point, conditions, condition, 0.0)
        for start in range(0, count, LANES):
            for i in range(LANES):
                position = min(start + i, count - 1)
                for s in range(state_size):
                    b[STAGE + s * LANES + i] = samples[engagement - first, position, s]
                b[SLIPPING + i] = samples[engagement - first, position, state_size]
                b[DIRECTION + i] = samples[engagement - first, position, state_size + 1]
                b[STAGE_TIME + i] = sample_times[position]
                while sample_times[position] >= profile_segments[profile, segment, 3]:
                    segment += 1
                set_segment(b, i, profile_segments, profile, segment)
            hydraulics(b, active)
            driveline(b, active)
            for i in range(min(LANES, count - start)):
                signals[0, engagement, start + i] = b[STAGE + i]
                signals[1, engagement, start + i] = b[STAGE + 3 * LANES + i]
                signals[2, engagement, start + i] = b[STAGE + 4 * LANES + i]
                signals[3, engagement, start + i] = b[GEAR + i] * b[CLUTCH_TORQUE + i]
                signals[4, engagement, start + i] = b[CONTACT_POSITION + i] - b[CLEARANCE + i]
