"""The main loop: loads engagements into lanes, records lock-up, and samples the signals."""

import numpy as np

from slipstick.clutch.driveline import driveline
from slipstick.clutch.events import DIVERGES, LOCKS, NO_EVENT, SEGMENT_ENDS, apply_event, locate_event, mark_events
from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.hydraulics import hydraulics
from slipstick.clutch.integrator import accept_step, first_stage, other_stages
from slipstick.clutch.lanes import (
    BUFFER_SIZE,
    CLEARANCE,
    CLUTCH_TORQUE,
    CONTACT_POSITION,
    CURVES,
    DIRECTION,
    EVENT,
    GEAR,
    INPUT_SPEED,
    LANES,
    LAWS,
    OUTPUT_SPEED,
    PRESSURE,
    SEGMENT_END,
    SEGMENT_TIME,
    SLIPPING,
    STAGE,
    STAGE_TIME,
    STEP,
    TIME,
)
from slipstick.clutch.loading import load, park, set_segment
from slipstick.clutch.sampling import clear_samples, sample

LOCKED, NEVER_LOCKED, FAILED = 0, 1, 2


def workspace(curves: np.ndarray, laws: np.ndarray) -> np.ndarray:
    """Working memory aligned to a cache line; unaligned, every vector of lanes would span two lines.

    `curves` are the `Converter.terms`, `laws` the `law_kernels.terms`.
    """
    memory = np.zeros(BUFFER_SIZE + 8)
    first = -(memory.ctypes.data // 8) % 8
    buffer = memory[first:first + BUFFER_SIZE]
    buffer[CURVES:CURVES + len(curves)] = curves
    buffer[LAWS:LAWS + len(laws)] = laws
    return buffer


def drive(b, lanes, first, stop, conditions_per_point, vectors, coefficients, active_effects, conditions, profiles,
          initial_speed, profile_segments, fine, coarse, sample_times, samples, signals, times, status):
    """Simulate engagements first..stop-1: `times` in s, `status`, and `samples` and `signals` at `sample_times` in s.

    `b` is a `workspace`, and `lanes` (4, LANES) holds whole numbers; what allocates arrays takes longer to compile.
    Engagement e combines point e // conditions_per_point and condition e modulo n: conditions_per_point = n combines
    every point with all n conditions, 1 pairs them. `conditions` is (n, 5): motor speed, load inertia, brake torque,
    position in the run order, given input torque. `profiles` is (n, 2): current profile, column of `initial_speed`.
    A sample is the state vector, the slip flag and the sign of the slip, and the signals are those of `observe`. An
    engagement that has not locked by the end of its current profile counts as never locked.
    """
    active, state_size = active_effects.flags, active_effects.state_size
    n, count, last_segment = len(conditions), len(sample_times), profile_segments.shape[1] - 1
    engagements, profile, segment, sampled = lanes[0], lanes[1], lanes[2], lanes[3]
    following, busy_lanes = first, 0
    for i in range(LANES):
        b[EVENT + i], engagements[i] = SEGMENT_ENDS, -1  # every lane is to be loaded
    while True:
        for i in range(LANES):
            if b[EVENT + i] == 0.0 and (count == 0 or sampled[i] < count):
                continue
            engagement = engagements[i]
            if engagement >= 0:
                event, fraction = locate_event(b, i) if b[EVENT + i] > SEGMENT_ENDS else (NO_EVENT, 0.0)
                if event == LOCKS and status[engagement] == NEVER_LOCKED and segment[i] < last_segment:
                    times[engagement], status[engagement] = b[TIME + i] + fraction * b[STEP + i], LOCKED
                elif event == DIVERGES:
                    times[engagement], status[engagement] = np.nan, FAILED
                    clear_samples(samples, engagement - first, sampled[i])
                is_over = event == DIVERGES or (status[engagement] == LOCKED and sampled[i] == count)
                if not is_over:
                    if event != NO_EVENT:
                        apply_event(b, i, event, fraction, state_size)
                    if b[TIME + i] >= b[SEGMENT_END + i]:
                        segment[i] += 1
                        set_segment(b, i, profile_segments, profile[i], segment[i])
                    is_decided = status[engagement] == LOCKED or segment[i] == last_segment
                    is_over = is_decided and sampled[i] == count
                if not is_over:
                    continue
                busy_lanes -= 1
            engagements[i], sampled[i] = -1, 0
            if following < stop:
                point, condition = following // conditions_per_point, following % n
                engagements[i], segment[i], profile[i] = following, 0, profiles[condition, 0]
                load(b, i, vectors, coefficients, active_effects, point, conditions, condition,
                     initial_speed[point, profiles[condition, 1]])
                set_segment(b, i, profile_segments, profile[i], segment[i])
                times[following], status[following] = np.nan, NEVER_LOCKED
                following += 1
                busy_lanes += 1
            else:
                park(b, i)
        if busy_lanes == 0:
            break
        first_stage(b, active, fine, coarse)
        other_stages(b, active)
        mark_events(b)
        if count > 0:
            for i in range(LANES):
                # A step that ends before the next sample has none.
                if engagements[i] >= 0 and sampled[i] < count and sample_times[sampled[i]] <= b[TIME + i] + b[STEP + i]:
                    event, fraction = locate_event(b, i) if b[EVENT + i] > SEGMENT_ENDS else (NO_EVENT, 1.0)
                    if event != DIVERGES:
                        sampled[i] = sample(b, i, state_size, sample_times, sampled[i],
                                            b[TIME + i] + fraction * b[STEP + i], engagements[i] - first, samples)
        accept_step(b, active)
    if count > 0:
        observe(b, first, stop, conditions_per_point, vectors, coefficients, active_effects, conditions, profiles,
                profile_segments, sample_times, samples, signals)


@kernel
def observe(b, first, stop, conditions_per_point, vectors, coefficients, active_effects, conditions, profiles,
            profile_segments, sample_times, samples, signals):
    """Compute signals[:, engagement, time] from samples: pressure, both speeds, output torque, piston position.

    The arguments are those of `drive`, which calls it: an entry point of its own would contain all equations once more.
    """
    active, state_size = active_effects.flags, active_effects.state_size
    n, count = len(conditions), len(sample_times)
    for engagement in range(first, stop):
        point, condition = engagement // conditions_per_point, engagement % n
        profile = profiles[condition, 0]
        segment = np.int64(0)  # without a type, it would be compiled into a second version of set_segment
        for i in range(LANES):
            load(b, i, vectors, coefficients, active_effects, point, conditions, condition, 0.0)
            set_segment(b, i, profile_segments, profile, segment)
        for start in range(0, count, LANES):
            end = min(count, start + LANES)
            valid = end - start  # the lanes behind keep what they had
            for s in range(state_size):
                fill(b[STAGE + s * LANES:], samples[engagement - first, s, start:end])
            fill(b[SLIPPING:], samples[engagement - first, state_size, start:end])
            fill(b[DIRECTION:], samples[engagement - first, state_size + 1, start:end])
            fill(b[STAGE_TIME:], sample_times[start:end])
            for i in range(valid):
                while b[STAGE_TIME + i] >= profile_segments[profile, segment, 3]:
                    segment += 1
                if b[SEGMENT_TIME + i] != profile_segments[profile, segment, 0]:
                    set_segment(b, i, profile_segments, profile, segment)
            hydraulics(b, active)
            driveline(b, active)
            fill(signals[0, engagement, start:end], b[PRESSURE:PRESSURE + valid])
            fill(signals[1, engagement, start:end], b[INPUT_SPEED:INPUT_SPEED + valid])
            fill(signals[2, engagement, start:end], b[OUTPUT_SPEED:OUTPUT_SPEED + valid])
            torque, position = signals[3, engagement, start:end], signals[4, engagement, start:end]
            for i in range(valid):
                torque[i] = b[GEAR + i] * b[CLUTCH_TORQUE + i]
                position[i] = b[CONTACT_POSITION + i] - b[CLEARANCE + i]


@inlined
def fill(target, values):
    """Copy `values` to the beginning of `target`: assignment of a slice would copy it twice, into memory of its own."""
    for i in range(len(values)):
        target[i] = values[i]
