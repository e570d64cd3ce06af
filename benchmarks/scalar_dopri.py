"""A compiled code for comparison: adaptive Dormand-Prince 5(4) in numba, one engagement at a time.

Steps end at the breakpoints of the current. Lock-up is located on the cubic Hermite interpolant of the last step.
"""

import numpy as np
from numba import njit

from benchmarks.benches import HEAVY

_CURVES = HEAVY.physics.curves
_RATIO, _TORQUE = np.array(_CURVES.speed_ratio), np.array(_CURVES.torque_ratio)
_CAPACITY = np.array(_CURVES.capacity_factor)


@njit(error_model="numpy", inline="always")
def _converter(w, speed):
    nu = min(1.0, max(0.0, w / speed))
    i = min(int(nu * 10), 8) if nu < 0.8 else min(8 + int((nu - 0.8) * 20), 11)
    share = (nu - _RATIO[i]) / (_RATIO[i + 1] - _RATIO[i])
    ratio = _TORQUE[i] + share * (_TORQUE[i + 1] - _TORQUE[i])
    capacity = _CAPACITY[i] + share * (_CAPACITY[i + 1] - _CAPACITY[i])
    return speed * speed * ratio / (capacity * capacity)


@njit(error_model="numpy", inline="always")
def _rates(p, t, x1, x2, x3, w, v, t0, u0, slope, speed, inertia, brake):
    u = u0 + slope * (t - t0)
    dx2 = (6 * p[2] * (u - p[1]) - 6 * x1) / (p[0] * p[0]) - (4 * x2 + 2 * p[2] * slope) / p[0]
    dx3 = (p[4] * (x1 - p[7]) + p[3] * x2 - p[6] * x3) / p[5]
    z = min(p[9], max(0.0, p[8] * x3))
    width = p[19] * p[9]
    s = min(1.0, max(0.0, 1 - (p[9] - z) / width))
    per_gap = (1 - s) * (1 + 2 * s) / width if s > 0 else 1 / (p[9] - z)
    contact = z / (p[9] - p[11]) * 1e5 * max(0.0, x1)
    torque = p[12] * per_gap * (w / p[14] - v) + s * s * (3 - 2 * s) * p[13] * contact
    drive = _converter(w, speed) - p[17] * w - p[16]
    net = p[14] * torque - brake - p[18] * v
    return x2, dx2, dx3, (drive - torque) / p[15], net / inertia if v > 0 or net > 0 else 0.0


@njit(error_model="numpy")
def _engagement(p, time, current, speed, inertia, brake, initial_speed, rtol):
    x1, x2, x3, w, v, t = 0.0, 0.0, p[10], initial_speed, 0.0, 0.0
    h = 1e-3
    for line in range(len(time) - 1):
        t0, u0, end = time[line], current[line], time[line + 1]
        slope = (current[line + 1] - u0) / (end - t0)
        a = _rates(p, t, x1, x2, x3, w, v, t0, u0, slope, speed, inertia, brake)
        while t < end:
            last = t + h >= end * (1 - 1e-14)
            step = end - t if last else h
            g = step / 5
            b = _rates(p, t + g, x1 + g * a[0], x2 + g * a[1], x3 + g * a[2], w + g * a[3], v + g * a[4], t0, u0, slope,
                       speed, inertia, brake)
            g, c1, c2 = step, 3 / 40, 9 / 40
            c = _rates(p, t + 0.3 * g, x1 + g * (c1 * a[0] + c2 * b[0]), x2 + g * (c1 * a[1] + c2 * b[1]),
                       x3 + g * (c1 * a[2] + c2 * b[2]), w + g * (c1 * a[3] + c2 * b[3]),
                       v + g * (c1 * a[4] + c2 * b[4]), t0, u0, slope, speed, inertia, brake)
            c1, c2, c3 = 44 / 45, -56 / 15, 32 / 9
            d = _rates(p, t + 0.8 * g, x1 + g * (c1 * a[0] + c2 * b[0] + c3 * c[0]),
                       x2 + g * (c1 * a[1] + c2 * b[1] + c3 * c[1]), x3 + g * (c1 * a[2] + c2 * b[2] + c3 * c[2]),
                       w + g * (c1 * a[3] + c2 * b[3] + c3 * c[3]), v + g * (c1 * a[4] + c2 * b[4] + c3 * c[4]), t0,
                       u0, slope, speed, inertia, brake)
            c1, c2, c3, c4 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
            e = _rates(p, t + 8 / 9 * g, x1 + g * (c1 * a[0] + c2 * b[0] + c3 * c[0] + c4 * d[0]),
                       x2 + g * (c1 * a[1] + c2 * b[1] + c3 * c[1] + c4 * d[1]),
                       x3 + g * (c1 * a[2] + c2 * b[2] + c3 * c[2] + c4 * d[2]),
                       w + g * (c1 * a[3] + c2 * b[3] + c3 * c[3] + c4 * d[3]),
                       v + g * (c1 * a[4] + c2 * b[4] + c3 * c[4] + c4 * d[4]), t0, u0, slope, speed, inertia, brake)
            c1, c2, c3, c4, c5 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
            f = _rates(p, t + g, x1 + g * (c1 * a[0] + c2 * b[0] + c3 * c[0] + c4 * d[0] + c5 * e[0]),
                       x2 + g * (c1 * a[1] + c2 * b[1] + c3 * c[1] + c4 * d[1] + c5 * e[1]),
                       x3 + g * (c1 * a[2] + c2 * b[2] + c3 * c[2] + c4 * d[2] + c5 * e[2]),
                       w + g * (c1 * a[3] + c2 * b[3] + c3 * c[3] + c4 * d[3] + c5 * e[3]),
                       v + g * (c1 * a[4] + c2 * b[4] + c3 * c[4] + c4 * d[4] + c5 * e[4]), t0, u0, slope, speed,
                       inertia, brake)
            c1, c3, c4, c5, c6 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
            y1 = x1 + g * (c1 * a[0] + c3 * c[0] + c4 * d[0] + c5 * e[0] + c6 * f[0])
            y2 = x2 + g * (c1 * a[1] + c3 * c[1] + c4 * d[1] + c5 * e[1] + c6 * f[1])
            y3 = x3 + g * (c1 * a[2] + c3 * c[2] + c4 * d[2] + c5 * e[2] + c6 * f[2])
            y4 = w + g * (c1 * a[3] + c3 * c[3] + c4 * d[3] + c5 * e[3] + c6 * f[3])
            y5 = v + g * (c1 * a[4] + c3 * c[4] + c4 * d[4] + c5 * e[4] + c6 * f[4])
            q = _rates(p, t + g, y1, y2, y3, y4, y5, t0, u0, slope, speed, inertia, brake)
            e1, e3, e4, e5, e6, e7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
            error = 0.0
            for k, scale in ((0, 1.0), (1, 100.0), (2, 1e-3), (3, 100.0), (4, 10.0)):
                size = g * (e1 * a[k] + e3 * c[k] + e4 * d[k] + e5 * e[k] + e6 * f[k] + e7 * q[k]) / (rtol * scale)
                error = max(error, abs(size))
            factor = 0.9 * (error + 1e-12) ** -0.2
            if error > 1:
                h = step * max(0.2, factor)
                continue
            slip, new_slip = w / p[14] - v, y4 / p[14] - y5
            if new_slip <= 0:
                slow, fast = g * (a[3] / p[14] - a[4]), g * (q[3] / p[14] - q[4])
                low, high = 0.0, 1.0
                for _ in range(40):
                    x = 0.5 * (low + high)
                    value = ((1 - x) ** 2 * (slip * (1 + 2 * x) + slow * x)
                             + x * x * (new_slip * (3 - 2 * x) + fast * (x - 1)))
                    low, high = (x, high) if value > 0 else (low, x)
                return t + high * g
            t = end if last else t + g
            x1, x2, x3, w, v, a = y1, y2, y3, y4, max(0.0, y5), q
            h = max(step, h if last else 0.0) * min(5.0, max(0.2, factor))
    return np.nan


@njit(error_model="numpy", nogil=True)
def shifting_times(vectors, profile, profile_time, profile_current, speed, inertia, brake, initial, rtol):
    out = np.empty((len(vectors), len(speed)))
    for m in range(len(vectors)):
        for i in range(len(speed)):
            out[m, i] = _engagement(vectors[m], profile_time[profile[i]], profile_current[profile[i]], speed[i],
                                    inertia[i], brake[i], initial[m, i], rtol)
    return out
