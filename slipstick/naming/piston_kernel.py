"""The piston and the torque of the plates, engagement by engagement (lines 3 and 4 of eq. 1, and eq. 2).

    v = b2/c2 (p + chamber - aa) + a2/c2 p' - d2/c2 x,   x' = v (1 + rate(v)) + place(x) + rate_extra,   x(0) = initial
    z = min(contact, max(0, alpha_T (1 + gain) x - clearance)),   s = the share of the ramp before contact that z is on
    torque = g (s^2 (3 - 2 s) alpha (1 + friction) F + beta (1 + film) slip / gap),   F = 1e5 z p / (contact - length)

A drag d takes v d / sqrt(v^2 + d^2) off the rate v. Heun's method integrates x with a pressure linear between samples.
"""

import numpy as np
from numba import njit

NAMES = ("piston_pressure_rate", "piston_pressure", "piston_inertia", "piston_return", "pressure_bias",
         "temperature_gain", "contact_position", "initial_position", "contact_length", "film_coefficient",
         "friction_coefficient", "gear_ratio", "ramp_share")
"""Parameters of the kernel, in the order of its columns."""


@njit(nogil=True, cache=True, error_model="numpy")
def _table(x, at, value):  # type: ignore[no-untyped-def]
    m = len(at)
    if m == 0:
        return 0.0
    if x <= at[0]:
        return value[0]
    for j in range(1, m):
        if x < at[j]:
            return value[j - 1] + (value[j] - value[j - 1]) * (x - at[j - 1]) / (at[j] - at[j - 1])
    return value[m - 1]


@njit(nogil=True, cache=True, error_model="numpy")
def close(step, sub, late, end, pressure, change, slip, p, chamber, gain_change, clearance,  # type: ignore[no-untyped-def]
          friction_change, film_change, rate_extra, rate_at, rate_value, place_at, place_value, drag, torque, position):
    """Fill `torque` (n, k) in N m and `position` (n, k) in m up to the samples `end` (n,); both stay 0 beyond.

    `pressure` in bar, its derivative `change` in bar/s and the `slip` in rad/s behind the gear are (n, k); `p` (n, 13)
    has the parameters `NAMES`. What laws add is (n, k): pressure in the `chamber` in bar, relative changes of piston
    gain, friction and film torque, the `clearance` in m and `rate_extra` in m/s; or a table of the rate and of the
    position (`place`) at some points; or the `drag` in m/s. A sample has `sub` steps. A signal at a sample is that of
    `late` s before: the piston leaves its initial position, which it has at the command, that much later.
    """
    k = pressure.shape[1]
    driven, extra = np.empty(k * sub), np.empty(k * sub)
    for i in range(len(p)):
        last = min(end[i], k)
        if last == 0:
            continue
        _inputs(sub, last, p[i, 0] / p[i, 2], p[i, 1] / p[i, 2], p[i, 4], pressure[i], change[i], chamber[i],
                rate_extra[i], driven, extra)
        _move(step, sub, late, last, p[i, 7], p[i, 3] / p[i, 2], driven, extra, rate_at, rate_value, place_at,
              place_value, drag, position[i])
        _press(last, p[i], pressure[i], slip[i], chamber[i], gain_change[i], clearance[i], friction_change[i],
               film_change[i], torque[i], position[i])


@njit(nogil=True, cache=True, error_model="numpy")
def _inputs(sub, last, a, b, bias, pressure, change, chamber, rate_extra, driven, extra):  # type: ignore[no-untyped-def]
    """Fill the rate that the pressure gives and `extra` at every step, `sub` of them between two samples."""
    for t in range(last - 1):
        for j in range(sub):
            w = j / sub
            driven[t * sub + j] = b * (pressure[t] * (1 - w) + pressure[t + 1] * w
                                       + chamber[t] * (1 - w) + chamber[t + 1] * w - bias) \
                + a * (change[t] * (1 - w) + change[t + 1] * w)
            extra[t * sub + j] = rate_extra[t] * (1 - w) + rate_extra[t + 1] * w
    end = (last - 1) * sub
    driven[end] = b * (pressure[last - 1] + chamber[last - 1] - bias) + a * change[last - 1]
    extra[end] = rate_extra[last - 1]


@njit(nogil=True, cache=True, error_model="numpy")
def _move(step, sub, late, last, x, d, driven, extra, rate_at, rate_value, place_at,  # type: ignore[no-untyped-def]
          place_value, drag, position):
    """Fill `position` with x at the samples."""
    is_linear = drag <= 0 and len(rate_at) == 0 and len(place_at) == 0
    position[0] = x
    for t in range(last - 1):
        # From the command on; where signals are read early, the first step has what lies before it.
        h = min(max((t + 1) * step - late, 0.0), step if t > 0 else 2 * step) / sub
        decay, kept = 1 - h * d * (1 - 0.5 * h * d), 1 - h * d
        for j in range(t * sub, t * sub + sub):
            if is_linear:  # the same step, in which only one product waits for the last one
                x = decay * x + 0.5 * h * ((driven[j] + extra[j]) * kept + driven[j + 1] + extra[j + 1])
                continue
            v0 = driven[j] - d * x
            if drag > 0:
                v0 = v0 - drag * v0 / np.sqrt(v0 * v0 + drag * drag)
            r0 = v0 * (1 + _table(v0, rate_at, rate_value)) + _table(x, place_at, place_value) + extra[j]
            y = x + h * r0
            v1 = driven[j + 1] - d * y
            if drag > 0:
                v1 = v1 - drag * v1 / np.sqrt(v1 * v1 + drag * drag)
            r1 = v1 * (1 + _table(v1, rate_at, rate_value)) + _table(y, place_at, place_value) + extra[j + 1]
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
        z = min(contact, max(0.0, gain * (1 + gain_change[t]) * position[t] - clearance[t]))
        position[t] = z
        s = min(1.0, max(0.0, 1.0 - (contact - z) * per_width))
        per_gap = (1 - s) * (1 + 2 * s) * per_width if s > 0 else 1 / (contact - z)
        force = z * per_travel * max(0.0, pressure[t] + chamber[t])
        torque[t] = p[11] * (s * s * (3 - 2 * s) * p[10] * (1 + friction_change[t]) * force
                             + p[9] * (1 + film_change[t]) * per_gap * slip[t])
