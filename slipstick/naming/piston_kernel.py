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
    for i in range(len(p)):
        a, b, d = p[i, 0] / p[i, 2], p[i, 1] / p[i, 2], p[i, 3] / p[i, 2]
        bias, gain, contact = p[i, 4], p[i, 5], p[i, 6]
        x = p[i, 7]
        # Divisions take most of the time of a step.
        per_width, per_travel, share = 1 / (p[i, 12] * contact), 1e5 / (contact - p[i, 8]), 1.0 / sub
        for t in range(end[i]):
            # From the command on; where signals are read early, the first step has what lies before it.
            h = min(max((t + 1) * step - late, 0.0), step if t > 0 else 2 * step) * share
            z = min(contact, max(0.0, gain * (1 + gain_change[i, t]) * x - clearance[i, t]))
            position[i, t] = z
            s = min(1.0, max(0.0, 1.0 - (contact - z) * per_width))
            per_gap = (1 - s) * (1 + 2 * s) * per_width if s > 0 else 1 / (contact - z)
            force = z * per_travel * max(0.0, pressure[i, t] + chamber[i, t])
            torque[i, t] = p[i, 11] * (s * s * (3 - 2 * s) * p[i, 10] * (1 + friction_change[i, t]) * force
                                       + p[i, 9] * (1 + film_change[i, t]) * per_gap * slip[i, t])
            if t + 1 == end[i] or t + 1 == pressure.shape[1]:
                break
            for j in range(sub):
                w0, w1 = j * share, (j + 1) * share
                f0 = b * (pressure[i, t] * (1 - w0) + pressure[i, t + 1] * w0
                          + chamber[i, t] * (1 - w0) + chamber[i, t + 1] * w0 - bias) \
                    + a * (change[i, t] * (1 - w0) + change[i, t + 1] * w0)
                f1 = b * (pressure[i, t] * (1 - w1) + pressure[i, t + 1] * w1
                          + chamber[i, t] * (1 - w1) + chamber[i, t + 1] * w1 - bias) \
                    + a * (change[i, t] * (1 - w1) + change[i, t + 1] * w1)
                e0 = rate_extra[i, t] * (1 - w0) + rate_extra[i, t + 1] * w0
                e1 = rate_extra[i, t] * (1 - w1) + rate_extra[i, t + 1] * w1
                v0 = f0 - d * x
                if drag > 0:
                    v0 = v0 - drag * v0 / np.sqrt(v0 * v0 + drag * drag)
                r0 = v0 * (1 + _table(v0, rate_at, rate_value)) + _table(x, place_at, place_value) + e0
                y = x + h * r0
                v1 = f1 - d * y
                if drag > 0:
                    v1 = v1 - drag * v1 / np.sqrt(v1 * v1 + drag * drag)
                r1 = v1 * (1 + _table(v1, rate_at, rate_value)) + _table(y, place_at, place_value) + e1
                x = x + 0.5 * h * (r0 + r1)
