"""The loop that feeds engagements to lanes, notes when they lock, and samples their signals."""

import numpy as np

from slipstick.clutch.driveline import driveline
from slipstick.clutch.fastmath import allocating, kernel
from slipstick.clutch.hydraulics import hydraulics
from slipstick.clutch.integrator import (
    LOCKS,
    LOSES,
    NOTHING,
    accept,
    dense,
    events,
    first_stage,
    locate,
    other_stages,
    settle,
)
from slipstick.clutch.lanes import (
    CLEARANCE,
    CLUTCH_TORQUE,
    CONTACT_POSITION,
    DIRECTION,
    EVENT,
    GEAR,
    LANES,
    LINE_END,
    SEGMENTS,
    SIZE,
    SLIPPING,
    STAGE_TIME,
    STATE,
    STEP,
    TIME,
)
from slipstick.clutch.loading import load, park, set_line

LOCKED, NEVER_LOCKED, FAILED = 0, 1, 2

@allocating
def workspace(curves):
    """The working memory, beginning on a cache line: else every vector of lanes would lie across two."""
    whole = np.zeros(SIZE + 8)
    first = -(whole.ctypes.data // 8) % 8
    whole[first + SEGMENTS:first + SEGMENTS + len(curves)] = curves
    return whole[first:first + SIZE]


@allocating
def drive(first, stop, each, vectors, coefficients, acts, curves, conditions, profiles, initial_speed, profile_lines, fine,
          coarse, sample_times, samples, times, status):
    """Simulate engagements first..stop-1 and fill `times` in s, `status`, and `samples` of this range if wanted.

    Engagement e is that of point e // each under condition e modulo n: each = n takes every point under all n
    conditions, each = 1 pairs them. `acts` says which effects act. `conditions` is (n, 4): motor speed, load inertia,
    brake torque, place in the run order; `profiles` (n, 2): current profile, column of `initial_speed`. A sample is the
    states, slipping or stuck, direction of the slip. An engagement that has not locked when its current profile ends
    never does.
    """
    active, states = acts.active, acts.states
    n, count, last_line = len(conditions), len(sample_times), profile_lines.shape[1] - 1
    b = workspace(curves)
    who, profile = np.full(LANES, -1), np.zeros(LANES, np.int64)
    line, sampled = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    waiting, busy = first, 0
    while True:
        for i in range(LANES):
            if who[i] < 0 and waiting < stop:
                point, condition = waiting // each, waiting % n
                profile[i] = profiles[condition, 0]
                load(b, i, vectors, coefficients, acts, point, conditions, condition,
                     initial_speed[point, profiles[condition, 1]])
                set_line(b, i, profile_lines, profile[i], 0)
                times[waiting], status[waiting] = np.nan, NEVER_LOCKED
                who[i], line[i], sampled[i] = waiting, 0, 0
                waiting += 1
                busy += 1
            elif who[i] < 0:
                park(b, i)
        if busy == 0:
            return
        freed = False
        while not freed:
            first_stage(b, active, fine, coarse)
            other_stages(b, active)
            marks = events(b)
            if count > 0:
                for i in range(LANES):
                    if who[i] >= 0:
                        sampled[i] = sample(b, i, states, sample_times, sampled[i], samples, who[i] - first)
            accept(b, active)
            if marks == 0 and count == 0:
                continue
            for i in range(LANES):
                engagement = who[i]
                if engagement < 0 or (b[EVENT + i] == 0.0 and sampled[i] < count):
                    continue
                what = NOTHING
                if b[EVENT + i] > 1.0:
                    what, share = locate(b, i)
                    settle(b, i, what, share, states)
                    if what == LOCKS and status[engagement] == NEVER_LOCKED and line[i] < last_line:
                        times[engagement], status[engagement] = b[TIME + i], LOCKED
                    elif what == LOSES:
                        times[engagement], status[engagement] = np.nan, FAILED
                        lose(samples, engagement - first, sampled[i])
                if b[TIME + i] >= b[LINE_END + i]:
                    line[i] += 1
                    set_line(b, i, profile_lines, profile[i], line[i])
                decided = status[engagement] == LOCKED or line[i] == last_line
                if what == LOSES or (decided and sampled[i] == count):
                    who[i] = -1
                    busy -= 1
                    freed = True


@kernel
def sample(b, i, states, sample_times, position, samples, row):
    """Keep lane i's states at all sample times from `position` on that its step reaches; returns the next position."""
    what, share = NOTHING, 1.0
    if b[EVENT + i] > 1.0:
        what, share = locate(b, i)
    reach = b[TIME + i] + share * b[STEP + i]
    while what != LOSES and position < len(sample_times) and sample_times[position] <= reach:
        at = (sample_times[position] - b[TIME + i]) / b[STEP + i]
        for s in range(states):
            samples[row, position, s] = dense(b, s * LANES + i, at)
        samples[row, position, states] = b[SLIPPING + i]
        samples[row, position, states + 1] = b[DIRECTION + i]
        position += 1
    return position


@kernel
def lose(samples, row, position):
    """Leave no sample of a failed engagement from `position` on."""
    for k in range(position, samples.shape[1]):
        for s in range(samples.shape[2]):
            samples[row, k, s] = np.nan


@allocating
def observe(first, stop, each, vectors, coefficients, acts, curves, conditions, profiles, profile_lines, sample_times, samples,
            signals):
    """Turn samples into signals[:, engagement, time]: pressure, both speeds, output torque, piston position.

    The arguments are those of `drive`.
    """
    active, states = acts.active, acts.states
    n, count = len(conditions), len(sample_times)
    b = workspace(curves)
    for engagement in range(first, stop):
        point, condition = engagement // each, engagement % n
        profile = profiles[condition, 0]
        line = 0
        for i in range(LANES):
            load(b, i, vectors, coefficients, acts, point, conditions, condition, 0.0)
        for start in range(0, count, LANES):
            for i in range(LANES):
                position = min(start + i, count - 1)
                for s in range(states):
                    b[STATE + s * LANES + i] = samples[engagement - first, position, s]
                b[SLIPPING + i] = samples[engagement - first, position, states]
                b[DIRECTION + i] = samples[engagement - first, position, states + 1]
                b[STAGE_TIME + i] = sample_times[position]
                while sample_times[position] >= profile_lines[profile, line, 3]:
                    line += 1
                set_line(b, i, profile_lines, profile, line)
            hydraulics(b, active)
            driveline(b, active)
            for i in range(min(LANES, count - start)):
                signals[0, engagement, start + i] = b[STATE + i]
                signals[1, engagement, start + i] = b[STATE + 3 * LANES + i]
                signals[2, engagement, start + i] = b[STATE + 4 * LANES + i]
                signals[3, engagement, start + i] = b[GEAR + i] * b[CLUTCH_TORQUE + i]
                signals[4, engagement, start + i] = b[CONTACT_POSITION + i] - b[CLEARANCE + i]
