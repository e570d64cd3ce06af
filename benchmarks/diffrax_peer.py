"""The simulator in JAX: Dormand-Prince 5(4) with adaptive steps and the event of lock-up by diffrax, in float64.

The conditions of a point, or of several, are one vectorized integration, which takes as many steps as its slowest
engagement, and the points are a loop. Steps end at the breakpoints of the current. Importing this module needs the
extra `bench`; JAX then has one thread.
"""

import os

os.environ["NPROC"] = "1"  # read by XLA; before jax is imported

from functools import partial

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from benchmarks.benches import HEAVY

jax.config.update("jax_enable_x64", True)

SCALES = (1.0, 100.0, 1e-3, 100.0, 10.0)  # of the states, which diffrax gives one tolerance
EVENT = diffrax.Event(lambda t, y, args, **_: _slip(y, args[0]), optimistix.Bisection(0.0, 1e-9))


def shifting_times(vectors, profile, profile_time, profile_current, speed, inertia, brake, initial, tolerance,
                   together=None):
    """As `scalar_dopri.shifting_times`, with a tolerance relative to `SCALES`, and `together` points at a time."""
    conditions = profile_time[profile], profile_current[profile], speed, inertia, brake
    return np.asarray(_ensemble(vectors, initial, conditions, tolerance, together))


@partial(jax.jit, static_argnums=4)
def _ensemble(vectors, initial, conditions, tolerance, together):
    def of_point(point):
        p, initial_speed = point
        return jax.vmap(partial(_engagement, tolerance, p))(initial_speed, *conditions)

    return jax.lax.map(of_point, (vectors, initial), batch_size=together)


def _engagement(tolerance, p, initial_speed, time, current, speed, inertia, brake):
    steps = diffrax.ClipStepSizeController(
        diffrax.PIDController(rtol=0, atol=tolerance, norm=optimistix.max_norm), jump_ts=time[1:-1])
    start = (0.0, 0.0, p[10] / SCALES[2], initial_speed / SCALES[3], 0.0)
    args = p, current[0], _bends(time, current), speed, inertia, brake
    solution = diffrax.diffeqsolve(diffrax.ODETerm(_rates), diffrax.Dopri5(), time[0], time[-1], 1e-3, start, args,
                                   stepsize_controller=steps, event=EVENT, max_steps=None, throw=False)
    return jnp.where(solution.result == diffrax.RESULTS.event_occurred, solution.ts[0], jnp.nan)


def _bends(x, y):
    """Lines between points as pairs (x, change of slope): their sum of hinges is 40 % faster than `jnp.interp`."""
    return list(zip(x[:-1], jnp.diff(jnp.diff(y) / jnp.diff(x), prepend=0.0), strict=True))


def _line(first, bends, x):
    return first + sum(bend * jnp.maximum(0.0, x - place) for place, bend in bends)


def _slip(y, p):
    return SCALES[3] * y[3] / p[14] - SCALES[4] * y[4]


def _rates(t, y, args):
    p, first, bends, speed, inertia, brake = args
    x1, x2, x3, w, v = (scale * value for scale, value in zip(SCALES, y, strict=True))
    u, slope = _line(first, bends, t), sum(bend * (t >= place) for place, bend in bends)
    dx2 = (6 * p[2] * (u - p[1]) - 6 * x1) / p[0] ** 2 - (4 * x2 + 2 * p[2] * slope) / p[0]
    dx3 = (p[4] * (x1 - p[7]) + p[3] * x2 - p[6] * x3) / p[5]
    z = jnp.clip(p[8] * x3, 0.0, p[9])
    width = p[19] * p[9]
    s = jnp.clip(1 - (p[9] - z) / width, 0.0, 1.0)
    per_gap = jnp.where(s > 0, (1 - s) * (1 + 2 * s) / width, 1 / (p[9] - z))
    contact = z / (p[9] - p[11]) * 1e5 * jnp.maximum(0.0, x1)
    torque = p[12] * per_gap * _slip(y, p) + s * s * (3 - 2 * s) * p[13] * contact
    drive = _converter(w, speed) - p[17] * w - p[16]
    net = p[14] * torque - brake - p[18] * v
    rates = x2, dx2, dx3, (drive - torque) / p[15], jnp.where((v > 0) | (net > 0), net / inertia, 0.0)
    return tuple(rate / scale for rate, scale in zip(rates, SCALES, strict=True))


def _converter(w, speed):
    curves, nu = HEAVY.physics.curves, jnp.clip(w / speed, 0.0, 1.0)
    ratio, capacity = (_line(curve[0], _bends(np.array(curves.speed_ratio), np.array(curve)), nu)
                       for curve in (curves.torque_ratio, curves.capacity_factor))
    return speed**2 * ratio / capacity**2
