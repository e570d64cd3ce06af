"""The input shaft under a measured torque, engagement by engagement.

    J w' = factor m^2 f(w / m) + drive - b_iv w - torque,   m = motor (1 - sag pump / largest),   pump = m^2 h(w / m)

with tables f and h at equal distances over the speed ratio, and constant beyond them.
"""

from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def _at(ratio, lowest, per, table):  # type: ignore[no-untyped-def]
    x = min(max(0.0, (ratio - lowest) * per), len(table) - 1.0)
    j = min(int(x), len(table) - 2)
    return table[j] + (x - j) * (table[j + 1] - table[j])


@njit(nogil=True, cache=True, error_model="numpy")
def turn(time, torque, factor, start, motor, drive, viscous, inertia, lowest, per,  # type: ignore[no-untyped-def]
         f, h, sag, steps, out):
    """Fill `out` (n, k) with the speed in rad/s at `time` (k,), by `steps` Runge-Kutta steps in a sample.

    `torque` in N m and `factor`, (n, k) each, are linear between samples, and the motor speed constant in a step. `per`
    is the number of points of the tables in a unit of the ratio, `sag` over the largest torque of the pump.
    """
    for i in range(len(start)):
        x = start[i]
        out[i, 0] = x
        for k in range(len(time) - 1):
            d = (time[k + 1] - time[k]) / steps
            for step in range(steps):
                before = torque[i, k] + (torque[i, k + 1] - torque[i, k]) * step / steps
                after = torque[i, k] + (torque[i, k + 1] - torque[i, k]) * (step + 1) / steps
                middle = 0.5 * (before + after)
                first = factor[i, k] + (factor[i, k + 1] - factor[i, k]) * step / steps
                last = factor[i, k] + (factor[i, k + 1] - factor[i, k]) * (step + 1) / steps
                m = motor[i]
                for _ in range(2 if sag != 0 else 0):
                    m = motor[i] * (1 - sag * m * m * _at(x / m, lowest, per, h))
                free, square = drive[i], m * m
                first, half, last = square * first, square * (0.5 * (first + last)), square * last
                a = (first * _at(x / m, lowest, per, f) + free - viscous[i] * x - before) / inertia[i]
                y = x + 0.5 * d * a
                b = (half * _at(y / m, lowest, per, f) + free - viscous[i] * y - middle) / inertia[i]
                y = x + 0.5 * d * b
                c = (half * _at(y / m, lowest, per, f) + free - viscous[i] * y - middle) / inertia[i]
                y = x + d * c
                e = (last * _at(y / m, lowest, per, f) + free - viscous[i] * y - after) / inertia[i]
                x += d / 6 * (a + 2 * b + 2 * c + e)
            out[i, k + 1] = x
