"""Derivatives of the torque of the closing plates with what a law adds, engagement by engagement.

They are those of the steps of `piston_kernel.close`: a change of the piston's state follows a linear equation about the
state, so that a column takes three products in a sample instead of the whole piston.
"""

import numpy as np
from numba import njit

from slipstick.naming.piston_kernel import drive, rate_of, table

KINDS = ("chamber", "rate_extra", "gain", "clearance")
"""What a law may add to, by its number in the kernel."""
_CHAMBER, _RATE, _GAIN, _CLEARANCE = range(len(KINDS))


@njit(nogil=True, cache=True, error_model="numpy")
def respond(step, sub, late, end, pressure, change, slip, p, chamber, gain_change, clearance,  # type: ignore[no-untyped-def]
            friction_change, film_change, rate_extra, drag_at, drag_value, rate_at, rate_value, place_at, place_value,
            kind, basis, response):
    """Fill `response` (n, m, k) with changes of the torque in N m with the coefficients of a law; 0 beyond `end` (n,).

    The law adds `basis` (n, m, k) to the quantity of this `kind`. The other arguments are those of `close`.
    """
    n, m, k = basis.shape
    drags, rates, places = table(drag_at, drag_value), table(rate_at, rate_value), table(place_at, place_value)
    driven, x, kept, before, after = np.empty(k), np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    of_state, of_law = np.empty(k), np.empty(k)
    for i in range(n):
        last = min(end[i], k)
        if last > 0:
            drive(last, p[i], pressure[i], change[i], chamber[i], driven)
            x[0] = p[i, 7]
            to_drive, to_rate = p[i, 1] / p[i, 2] if kind == _CHAMBER else 0.0, 1.0 if kind == _RATE else 0.0
            _follow(step, sub, late, last, p[i, 3] / p[i, 2], driven, rate_extra[i], drags, rates, places, to_drive,
                    to_rate, x, kept, before, after)
            _press(kind, last, p[i], pressure[i], slip[i], chamber[i], gain_change[i], clearance[i],
                   friction_change[i], film_change[i], x, of_state, of_law)
        for j in range(m):
            y = 0.0
            for t in range(last):
                response[i, j, t] = of_state[t] * y + of_law[t] * basis[i, j, t]
                if t + 1 < last:
                    y = kept[t] * y + before[t] * basis[i, j, t] + after[t] * basis[i, j, t + 1]
            response[i, j, last:] = 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _follow(step, sub, late, last, d, driven, extra, drags, rates, places, to_drive, to_rate,  # type: ignore[no-untyped-def]
            x, kept, before, after):
    """Fill x at the samples from x[0] on, and the derivatives of each with the one before and with the law at both.

    A law adds `to_drive` times its value to the rate that the pressure gives, and `to_rate` times it to the rate.
    """
    per, cells = 1 / sub, (0, 0, 0)
    for t in range(last - 1):
        h = per * min(max((t + 1) * step - late, 0.0), step if t > 0 else 2 * step)
        rise, more = per * (driven[t + 1] - driven[t]), per * (extra[t + 1] - extra[t])
        state, kept[t], before[t], after[t] = x[t], 1.0, 0.0, 0.0
        for j in range(sub):
            now, added = driven[t] + j * rise, extra[t] + j * more
            r0, slope0, steep0, cells = rate_of(now, added, state, d, drags, rates, places, cells)
            r1, slope1, steep1, cells = rate_of(now + rise, added + more, state + h * r0, d, drags, rates, places,
                                                cells)
            state += 0.5 * h * (r0 + r1)
            carried = 1 + 0.5 * h * (slope0 + slope1 + h * slope0 * slope1)
            first = 0.5 * h * (1 + h * slope1) * (to_drive * steep0 + to_rate)
            second = 0.5 * h * (to_drive * steep1 + to_rate)
            kept[t] *= carried
            before[t] = carried * before[t] + first * (1 - j * per) + second * (1 - (j + 1) * per)
            after[t] = carried * after[t] + first * j * per + second * (j + 1) * per
        x[t + 1] = state


@njit(nogil=True, cache=True, error_model="numpy")
def _press(kind, last, p, pressure, slip, chamber, gain_change, clearance, friction_change,  # type: ignore[no-untyped-def]
           film_change, x, of_state, of_law):
    """Fill the derivatives of the torque with x and with the law at the same sample."""
    gain, contact = p[5], p[6]
    per_width, per_travel = 1 / (p[12] * contact), 1e5 / (contact - p[8])
    for t in range(last):
        travelled = gain * (1 + gain_change[t]) * x[t]
        z = max(0.0, travelled) - clearance[t]
        closes = z < contact
        z = min(contact, z)
        s = min(1.0, max(0.0, 1.0 - (contact - z) * per_width))
        friction = p[11] * p[10] * (1 + friction_change[t]) * per_travel * max(0.0, pressure[t] + chamber[t])
        film = p[11] * p[9] * (1 + film_change[t]) * slip[t]
        share = s * s * (3 - 2 * s)
        bent = 6 * s * (1 - s) * per_width
        gap = (1 - 4 * s) * per_width * per_width if s > 0 else 1 / ((contact - z) * (contact - z))
        of_place = friction * (bent * z + share) + film * gap if closes else 0.0
        of_travel = of_place if travelled > 0 else 0.0
        of_state[t] = of_travel * gain * (1 + gain_change[t])
        of_law[t] = 0.0
        if kind == _CHAMBER and pressure[t] + chamber[t] > 0:
            of_law[t] = p[11] * p[10] * (1 + friction_change[t]) * per_travel * share * z
        elif kind == _GAIN:
            of_law[t] = of_travel * gain * x[t]
        elif kind == _CLEARANCE:
            of_law[t] = -of_place
