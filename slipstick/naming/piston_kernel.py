"""The piston and the torque of the plates, engagement by engagement (lines 3 and 4 of eq. 1, and eq. 2).

    u = b2/c2 (p + chamber - aa) + a2/c2 p' - d2/c2 x,   v = u + drag(u)
    x' = v (1 + rate(|v|)) + place(x) + rate_extra,   x(0) = initial
    z = min(contact, max(0, alpha_T (1 + gain) x) - clearance),   s = the share of the ramp before contact that z is on
    torque = g (s^2 (3 - 2 s) alpha (1 + friction) F + beta (1 + film) slip / gap),   F = 1e5 z p / (contact - length)

Heun's method integrates x with a pressure linear between samples.
"""

import numpy as np
from numba import njit

NAMES = ("piston_pressure_rate", "piston_pressure", "piston_inertia", "piston_return", "pressure_bias",
         "temperature_gain", "contact_position", "initial_position", "contact_length", "film_coefficient",
         "friction_coefficient", "gear_ratio", "ramp_share")
"""Parameters of the kernel, in the order of its columns."""


@njit(nogil=True, cache=True, error_model="numpy")
def table(at, value):  # type: ignore[no-untyped-def]
    """Points, values and slopes (3, m) of a table, whose division would be what a step waits for."""
    tabulated = np.zeros((3, len(at)))
    tabulated[0], tabulated[1] = at, value
    for j in range(len(at) - 1):
        tabulated[2, j] = (value[j + 1] - value[j]) / (at[j + 1] - at[j])
    return tabulated


@njit(nogil=True, cache=True, error_model="numpy")
def at(x, tabulated, cell):  # type: ignore[no-untyped-def]
    """The value at x of a table that is constant beyond its ends, and its cell, searched from another one on."""
    m = tabulated.shape[1]
    if m == 0:
        return 0.0, 0
    within = min(max(x, tabulated[0, 0]), tabulated[0, m - 1])
    while cell < m - 2 and within >= tabulated[0, cell + 1]:
        cell += 1
    while within < tabulated[0, cell]:
        cell -= 1
    return tabulated[1, cell] + tabulated[2, cell] * (within - tabulated[0, cell]), cell


@njit(nogil=True, cache=True, error_model="numpy")
def slope(x, tabulated, cell):  # type: ignore[no-untyped-def]
    """The slope at x of a table, in whose `cell` it is."""
    return tabulated[2, cell] if tabulated.size > 0 and tabulated[0, 0] < x < tabulated[0, -1] else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def rate_of(driven, extra, x, d, drags, rates, places, cells):  # type: ignore[no-untyped-def]
    """The rate of x, its derivatives with x and with the rate that the pressure gives, and the cells of the tables."""
    u = driven - d * x
    drag, drag_cell = at(u, drags, cells[0])
    v = u + drag
    rate, rate_cell = at(abs(v), rates, cells[1])
    place, place_cell = at(x, places, cells[2])
    steep = (1 + slope(u, drags, drag_cell)) * (1 + rate + abs(v) * slope(abs(v), rates, rate_cell))
    spring = slope(x, places, place_cell)
    return v * (1 + rate) + place + extra, spring - d * steep, steep, (drag_cell, rate_cell, place_cell)


@njit(nogil=True, cache=True, error_model="numpy")
def drive(last, p, pressure, change, chamber, driven):  # type: ignore[no-untyped-def]
    """Fill the rate that the pressure gives at the samples, without the return of the piston."""
    a, b = p[0] / p[2], p[1] / p[2]
    for t in range(last):
        driven[t] = b * (pressure[t] + chamber[t] - p[4]) + a * change[t]


@njit(nogil=True, cache=True, error_model="numpy")
def close(step, sub, late, end, pressure, change, slip, p, chamber, gain_change, clearance,  # type: ignore[no-untyped-def]
          friction_change, film_change, rate_extra, drag_at, drag_value, rate_at, rate_value, place_at, place_value,
          torque, position):
    """Fill `torque` (n, k) in N m and `position` (n, k) in m up to the samples `end` (n,); both stay 0 beyond.

    `pressure` in bar, its derivative `change` in bar/s and the `slip` in rad/s behind the gear are (n, k); `p` (n, 13)
    has the parameters `NAMES`. What laws add is (n, k): pressure in the `chamber` in bar, relative changes of piston
    gain, friction and film torque, the `clearance` in m and `rate_extra` in m/s; or a table over the rate, in m/s
    (`drag`) or relative (`rate`), or over the position (`place`). A sample has `sub` steps. A signal at a sample is
    that of `late` s before: the piston leaves its initial position, which it has at the command, that much later.
    """
    driven = np.empty(pressure.shape[1])
    drags, rates, places = table(drag_at, drag_value), table(rate_at, rate_value), table(place_at, place_value)
    for i in range(len(p)):
        last = min(end[i], len(driven))
        if last == 0:
            continue
        drive(last, p[i], pressure[i], change[i], chamber[i], driven)
        _move(step, sub, late, last, p[i, 7], p[i, 3] / p[i, 2], driven, rate_extra[i], drags, rates, places,
              position[i])
        _press(last, p[i], pressure[i], slip[i], chamber[i], gain_change[i], clearance[i], friction_change[i],
               film_change[i], torque[i], position[i])


@njit(nogil=True, cache=True, error_model="numpy")
def _move(step, sub, late, last, x, d, driven, extra, drags, rates, places, position):  # type: ignore[no-untyped-def]
    """Fill `position` with x at the samples, between which the rate that the pressure gives and `extra` are linear."""
    is_linear = drags.size == 0 and rates.size == 0 and places.size == 0
    per, cells = 1 / sub, (0, 0, 0)
    position[0] = x
    for t in range(last - 1):
        # From the command on; where signals are read early, the first step has what lies before it.
        h = per * min(max((t + 1) * step - late, 0.0), step if t > 0 else 2 * step)
        decay, kept = 1 - h * d * (1 - 0.5 * h * d), 1 - h * d
        rise, more = per * (driven[t + 1] - driven[t]), per * (extra[t + 1] - extra[t])
        for j in range(sub):
            now, added = driven[t] + j * rise, extra[t] + j * more
            if is_linear:  # the same step, in which only one product waits for the last one
                x = decay * x + 0.5 * h * ((now + added) * kept + now + rise + added + more)
                continue
            r0, _, _, cells = rate_of(now, added, x, d, drags, rates, places, cells)
            r1, _, _, cells = rate_of(now + rise, added + more, x + h * r0, d, drags, rates, places, cells)
            x = x + 0.5 * h * (r0 + r1)
        position[t + 1] = x


@njit(nogil=True, cache=True, error_model="numpy")
def _press(last, p, pressure, slip, chamber, gain_change, clearance, friction_change,  # type: ignore[no-untyped-def]
           film_change, torque, position):
    """Fill `torque`, and replace x in `position` by z."""
    gain, contact = p[5], p[6]
    # Divisions take most of the time.
    per_width, per_travel = 1 / (p[12] * contact), 1e5 / (contact - p[8])
    for t in range(last):
        z = min(contact, max(0.0, gain * (1 + gain_change[t]) * position[t]) - clearance[t])
        position[t] = z
        s = min(1.0, max(0.0, 1.0 - (contact - z) * per_width))
        per_gap = (1 - s) * (1 + 2 * s) * per_width if s > 0 else 1 / (contact - z)
        force = z * per_travel * max(0.0, pressure[t] + chamber[t])
        torque[t] = p[11] * (s * s * (3 - 2 * s) * p[10] * (1 + friction_change[t]) * force
                             + p[9] * (1 + film_change[t]) * per_gap * slip[t])
