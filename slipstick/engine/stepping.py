"""Compiled kernels that evaluate a tape for many runs at once, and step its equations over the instants of these runs.

`Equations.advance` and `trajectory.integrate` are the same in numpy.

Arrays of a problem are (..., n), the runs last, and R (rows, LANES) are the rows of a tape for some of them. A `tape`
is the tuple that `trajectory` packs. Integers are never literals in calls, and rows are copied in loops: numba would
compile a kernel once more for each literal, and takes long for slices.
"""

import numpy as np
from numba import njit

from slipstick.engine.equations import EDGE
from slipstick.numerics.linking import linked

_LANES = 256
"""Numbers in a row: looking an operation up costs as much as some ten of them, and rows must stay in the cache."""


@linked
def evaluate(tape, first, last, R, count):  # type: ignore[no-untyped-def]
    """Do the operations of a tape from the `first` up to the `last` in R (rows, lanes) for `count` lanes."""
    program, starts, knots, values, slopes = tape[0], tape[2], tape[3], tape[4], tape[5]
    for m in range(first, last):
        code, to, a, b, c = program[m, 0], program[m, 1], program[m, 2], program[m, 3], program[m, 4]
        if code == 0:  # add
            for g in range(count):
                R[to, g] = R[a, g] + R[b, g]
        elif code == 1:  # subtract
            for g in range(count):
                R[to, g] = R[a, g] - R[b, g]
        elif code == 2:  # multiply
            for g in range(count):
                R[to, g] = R[a, g] * R[b, g]
        elif code == 3:  # divide
            for g in range(count):
                R[to, g] = R[a, g] / R[b, g]
        elif code == 4:  # negative
            for g in range(count):
                R[to, g] = -R[a, g]
        elif code == 5:  # maximum
            for g in range(count):
                R[to, g] = R[a, g] if R[a, g] >= R[b, g] or R[a, g] != R[a, g] else R[b, g]
        elif code == 6:  # minimum
            for g in range(count):
                R[to, g] = R[a, g] if R[a, g] <= R[b, g] or R[a, g] != R[a, g] else R[b, g]
        elif code == 7:  # sqrt
            for g in range(count):
                R[to, g] = np.sqrt(R[a, g])
        elif code == 8:  # power
            for g in range(count):
                R[to, g] = R[a, g] ** R[b, g]
        elif code == 9:  # exp
            for g in range(count):
                R[to, g] = np.exp(R[a, g])
        elif code == 10:  # log
            for g in range(count):
                R[to, g] = np.log(R[a, g])
        elif code == 11:  # absolute
            for g in range(count):
                R[to, g] = abs(R[a, g])
        elif code == 12:  # sign
            for g in range(count):
                R[to, g] = (1.0 if R[a, g] > 0 else -1.0 if R[a, g] < 0 else R[a, g])
        elif code == 13:  # sin
            for g in range(count):
                R[to, g] = np.sin(R[a, g])
        elif code == 14:  # cos
            for g in range(count):
                R[to, g] = np.cos(R[a, g])
        elif code == 15:  # tan
            for g in range(count):
                R[to, g] = np.tan(R[a, g])
        elif code == 16:  # tanh
            for g in range(count):
                R[to, g] = np.tanh(R[a, g])
        elif code == 17:  # arctan
            for g in range(count):
                R[to, g] = np.arctan(R[a, g])
        elif code == 18:  # arctan2
            for g in range(count):
                R[to, g] = np.arctan2(R[a, g], R[b, g])
        elif code == 19:  # sinh
            for g in range(count):
                R[to, g] = np.sinh(R[a, g])
        elif code == 20:  # cosh
            for g in range(count):
                R[to, g] = np.cosh(R[a, g])
        elif code == 21:  # arcsin
            for g in range(count):
                R[to, g] = np.arcsin(R[a, g])
        elif code == 22:  # arccos
            for g in range(count):
                R[to, g] = np.arccos(R[a, g])
        elif code == 23:  # floor
            for g in range(count):
                R[to, g] = np.floor(R[a, g])
        elif code == 24:  # remainder
            for g in range(count):
                R[to, g] = R[a, g] % R[b, g]
        elif code == 25:  # less
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] < R[b, g] else 0.0
        elif code == 26:  # less_equal
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] <= R[b, g] else 0.0
        elif code == 27:  # equal
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] == R[b, g] else 0.0
        elif code == 28:  # not_equal
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] != R[b, g] else 0.0
        elif code == 29:  # logical_and
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] != 0 and R[b, g] != 0 else 0.0
        elif code == 30:  # logical_or
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] != 0 or R[b, g] != 0 else 0.0
        elif code == 31:  # logical_not
            for g in range(count):
                R[to, g] = 1.0 if R[a, g] == 0 else 0.0
        elif code == 32:  # where
            for g in range(count):
                R[to, g] = R[b, g] if R[a, g] != 0 else R[c, g]
        else:  # a table, at 33, or one with a jump, on the side in c
            table = int(R[b, 0])
            if table < 0:
                table += len(starts) - 1
            begin, end = starts[table], starts[table + 1] - 1
            if code == 34:
                edge = EDGE * (knots[end] - knots[begin])
                for g in range(count):
                    x, side = R[a, g], R[c, g]
                    R[to, g] = max(x, edge) if side >= 1 else min(x, -edge) if side <= -1 else side * edge
                a = to
            lowest, highest, beyond = knots[begin], knots[end], values[end]
            for g in range(count):
                x = R[a, g]
                x = lowest if x < lowest else x
                low, cells = begin, end - begin
                while cells > 1:  # without a branch that depends on x
                    half = cells // 2
                    low += half if knots[low + half] <= x else 0
                    cells -= half
                R[to, g] = beyond if x >= highest else values[low] + (x - knots[low]) * slopes[low]


@linked
def fill_constants(tape, P, first, runs, together, R):  # type: ignore[no-untyped-def]
    """Fill the rows of what is constant in a run, of literals, and of what follows from both, for several instants."""
    literals, at = tape[7], tape[12]
    for row in range(len(P)):
        for t in range(together):
            for i in range(runs):
                R[row, t * runs + i] = P[row, first + i]
    for row in range(len(literals)):
        for g in range(together * runs):
            R[at + row, g] = literals[row]
    evaluate(tape, 0 * runs, tape[1][0], R, together * runs)


@linked
def _step(tape, R, x, begin, end, h, out, work, count):  # type: ignore[no-untyped-def]
    """Fill out (d, lanes) with the states after a Runge-Kutta step of h (lanes,), on the sides that are in R.

    Of states that rest, the sides are found anew in each stage.
    """
    lowest, results, at, d, switches = tape[8], tape[6], tape[11], len(x), tape[9]
    ends, drives, k, total = tape[1], tape[10], work[0], work[1]
    for stage in range(4):
        shares = (1.0, 0.0) if stage == 0 else (0.0, 1.0) if stage == 3 else (0.5, 0.5)
        for row in range(len(begin)):
            for g in range(count):
                R[drives + row, g] = shares[0] * begin[row, g] + shares[1] * end[row, g]
        for state in range(d):
            low = lowest[state]
            for g in range(count):
                value = x[state, g]
                if stage:
                    value += (0.5 if stage < 3 else 1.0) * h[g] * k[state, g]
                    value = low if value < low else value
                R[at + state, g] = value
        if len(switches):
            _settle(tape, R, work, count)
        evaluate(tape, ends[1 if stage == 2 else 0], ends[2], R, count)  # both in the middle are driven alike
        for state in range(d):
            row, weight = results[state], 2.0 if stage in (1, 2) else 1.0
            for g in range(count):
                k[state, g] = R[row, g]
                total[state, g] = (total[state, g] if stage else 0.0) + weight * R[row, g]
    for state in range(d):
        low = lowest[state]
        for g in range(count):
            value = x[state, g] + h[g] / 6 * total[state, g]
            out[state, g] = low if value < low else value


@linked
def _choose_sides(tape, R, x, u, work, count):  # type: ignore[no-untyped-def]
    """Fill the sides of switching states in R and in memory, as `Equations.sides` does."""
    switches, at, d, drives, sides, rests = tape[9], tape[11], len(x), tape[10], work[2], False
    for state in switches:
        for g in range(count):
            sides[state, g] = np.sign(x[state, g])
            R[at + d + state, g] = sides[state, g]
            rests = rests or x[state, g] == 0
    if not rests:
        return
    for row in range(len(u)):
        for g in range(count):
            R[drives + row, g] = u[row, g]
    for state in range(d):
        for g in range(count):
            R[at + state, g] = x[state, g]
    _settle(tape, R, work, count)
    for state in switches:
        for g in range(count):
            sides[state, g] = R[at + d + state, g]


@linked
def _settle(tape, R, work, count):  # type: ignore[no-untyped-def]
    """Fill the sides in R of states that rest by those in memory: as the rate leads, or the share at which it is 0."""
    results, at, sides, up = tape[6], tape[11], work[2], work[3]
    d = len(sides)
    for state in tape[9]:
        side, rate, rests = at + d + state, results[state], False
        for g in range(count):
            rests = rests or abs(sides[state, g]) < 1
        if not rests:
            continue
        for part in range(2):
            for g in range(count):
                up[0, g] = R[rate, g]
                R[side, g] = -1.0 if part else 1.0
            evaluate(tape, tape[1][0], tape[1][2], R, count)
        for g in range(count):
            value, rise, fall = R[at + state, g], up[0, g], R[rate, g]
            if abs(sides[state, g]) >= 1:
                R[side, g] = sides[state, g]
            elif value != 0:
                R[side, g] = np.sign(value)
            elif rise > 0:
                R[side, g] = 1.0
            elif fall < 0:
                R[side, g] = -1.0
            else:
                R[side, g] = (rise + fall) / (fall - rise) if fall > rise else 0.0


@linked
def _is_across(value, side):  # type: ignore[no-untyped-def]
    """Whether a state that does not rest at the begin of a step is on the other side behind it."""
    return abs(side) == 1 and value * side < 0


@linked
def _advance(tape, R, x, begin, end, h, out, work, count):  # type: ignore[no-untyped-def]
    """Fill out (d, lanes) with the states a step later. A state that meets its surface goes on from there, or rests."""
    switches, sides = tape[9], work[2]
    if len(switches):
        _choose_sides(tape, R, x, begin, work, count)
    _step(tape, R, x, begin, end, h, out, work, count)
    for state in switches:
        meeting = 0 * count
        for g in range(count):
            if _is_across(out[state, g], sides[state, g]):
                meeting += 1
        if meeting:
            _meet(tape, R, sides, state, meeting, x, begin, end, h, out, count)


@linked
def _meet(tape, R, sides, state, meeting, x, begin, end, h, out, count):  # type: ignore[no-untyped-def]
    """Fill the states a step later of those lanes in which a state meets its surface within the step."""
    d, work = len(x), _make_work(len(x), meeting)
    own, lanes = np.empty((len(R), meeting)), np.empty(meeting, np.int64)
    first, there = np.empty((d, meeting)), np.empty((d, meeting))
    u, u_there, u_last = (np.empty((len(begin), meeting)), np.empty((len(begin), meeting)),
                          np.empty((len(begin), meeting)))
    before, behind = np.empty(meeting), np.empty(meeting)
    m = 0
    for g in range(count):
        if _is_across(out[state, g], sides[state, g]):
            lanes[m] = g
            share = x[state, g] / (x[state, g] - out[state, g])  # of the step, as if the state were linear
            before[m], behind[m] = share * h[g], (1 - share) * h[g]
            for row in range(len(R)):
                own[row, m] = R[row, g]
            for other in range(d):
                first[other, m], work[2][other, m] = x[other, g], sides[other, g]
            for row in range(len(begin)):
                u[row, m], u_last[row, m] = begin[row, g], end[row, g]
                u_there[row, m] = begin[row, g] + share * (end[row, g] - begin[row, g])
            m += 1
    for part in range(2):  # to the surface, and on from there
        if part:
            for m in range(meeting):
                there[state, m] = 0.0
            _choose_sides(tape, own, there, u_there, work, meeting)
            first, u, u_there, before, there = there, u_there, u_last, behind, first
        _step(tape, own, first, u, u_there, before, there, work, meeting)
    for m in range(meeting):
        if _is_across(there[state, m], work[2][state, m]):
            there[state, m] = 0.0
        for other in range(d):
            out[other, lanes[m]] = there[other, m]


@linked
def _make_work(states, lanes):  # type: ignore[no-untyped-def]
    """Return memory for a step: rates, their sum, the sides of states at its begin, and a rate."""
    return np.empty((states, lanes)), np.empty((states, lanes)), np.empty((states, lanes)), np.empty((1, lanes))


@linked
def _gather(values, j, instants, first, runs, lanes):  # type: ignore[no-untyped-def]
    """Fill lanes (rows, instants times runs) with values (rows, K, n) of some instants and runs."""
    for row in range(len(values)):
        for t in range(instants):
            for i in range(runs):
                lanes[row, t * runs + i] = values[row, j + t, first + i]


@linked
def _scatter(lanes, j, instants, first, runs, values):  # type: ignore[no-untyped-def]
    """Fill values (rows, K, n) of some instants and runs with lanes."""
    for row in range(len(values)):
        for t in range(instants):
            for i in range(runs):
                values[row, j + t, first + i] = lanes[row, t * runs + i]


@njit(nogil=True, cache=True, error_model="numpy")
def follow(tape, P, V, start, h, X):  # type: ignore[no-untyped-def]
    """Fill the states X (d, K, n) from those at the `start` (d, n) on, with steps h (K - 1,).

    P (c, n) and V (v, K, n) are what is constant and what is driven.
    """
    d, size, n = X.shape
    R, out, x, steps = np.empty((tape[13], _LANES)), np.empty((d, _LANES)), np.empty((d, _LANES)), np.empty(_LANES)
    begin, end = np.zeros((len(V) + 1, _LANES)), np.zeros((len(V) + 1, _LANES))
    work = _make_work(d, _LANES)
    for first in range(0, n, _LANES):
        count = min(_LANES, n - first)
        fill_constants(tape, P, first, count, min(1, count), R)
        for state in range(d):
            for g in range(count):
                x[state, g] = start[state, first + g]
        _gather(V, 0, 1, first, count, begin)
        for j in range(size):
            _scatter(x, j, 1, first, count, X)
            if j + 1 < size:
                _gather(V, j + 1, 1, first, count, end)
                for g in range(count):
                    steps[g] = h[j]
                _advance(tape, R, x, begin, end, steps, out, work, count)
                begin, end = end, begin
                x, out = out, x


@njit(nogil=True, cache=True, error_model="numpy")
def step_all(tape, P, V, X, shift, change, h, out):  # type: ignore[no-untyped-def]
    """Fill out (d, K - 1, n) with what a step makes of states X (d, K, n).

    They are shifted by (d,), and values change by (2,) at the begin and at the end of a step.
    """
    d, size, n = X.shape
    R, after, x, steps = np.empty((tape[13], _LANES)), np.empty((d, _LANES)), np.empty((d, _LANES)), np.empty(_LANES)
    begin, end = np.empty((len(V) + 1, _LANES)), np.empty((len(V) + 1, _LANES))
    for g in range(_LANES):
        begin[len(V), g], end[len(V), g] = change[0], change[1]
    work = _make_work(d, _LANES)
    for first in range(0, n, _LANES):
        runs = min(_LANES, n - first)
        together = _LANES // runs
        fill_constants(tape, P, first, runs, together, R)
        for j in range(0, size - 1, together):
            instants = min(together, size - 1 - j)
            _gather(V, j, instants, first, runs, begin)
            _gather(V, j + 1, instants, first, runs, end)
            _gather(X, j, instants, first, runs, x)
            for state in range(d):
                for g in range(instants * runs):
                    x[state, g] += shift[state]
            for t in range(instants):
                for i in range(runs):
                    steps[t * runs + i] = h[j + t]
            _advance(tape, R, x, begin, end, steps, after, work, instants * runs)
            _scatter(after, j, instants, first, runs, out)


@njit(nogil=True, cache=True, error_model="numpy")
def read_all(tape, rates, P, V, X, shift, change, out):  # type: ignore[no-untyped-def]
    """Fill out (o, K, n) with the outputs at states X (d, K, n) that are shifted, with values that change.

    `rates` is the tape of the rates, by which switching states choose their sides.
    """
    d, size, n = X.shape
    R, S, x = np.empty((tape[13], _LANES)), np.empty((rates[13], _LANES)), np.empty((d, _LANES))
    u, work, at, results = np.empty((len(V) + 1, _LANES)), _make_work(d, _LANES), tape[11], tape[6]
    y, switches = np.empty((len(results), _LANES)), tape[9]
    for g in range(_LANES):
        u[len(V), g] = change
    for first in range(0, n, _LANES):
        runs = min(_LANES, n - first)
        together = _LANES // runs
        fill_constants(tape, P, first, runs, together, R)
        if len(switches):
            fill_constants(rates, P, first, runs, together, S)
        for j in range(0, size, together):
            instants = min(together, size - j)
            count = instants * runs
            _gather(V, j, instants, first, runs, u)
            _gather(X, j, instants, first, runs, x)
            for state in range(d):
                for g in range(count):
                    x[state, g] += shift[state]
                    R[at + state, g] = x[state, g]
            if len(switches):
                _choose_sides(rates, S, x, u, work, count)
                for state in switches:
                    for g in range(count):
                        R[at + d + state, g] = S[at + d + state, g]
            for row in range(len(u)):
                for g in range(count):
                    R[tape[10] + row, g] = u[row, g]
            evaluate(tape, tape[1][0], tape[1][2], R, count)
            for output in range(len(results)):
                for g in range(count):
                    y[output, g] = R[results[output], g]
            _scatter(y, j, instants, first, runs, out)
