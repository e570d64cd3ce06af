"""The driveline after lock-up, where the clutch couples both shafts rigidly.

    (Ji + Jo / g^2) Omega' = T_conv(Omega) + T_given - b_iv Omega - T_ic - load / g,   load = brake + b_ov Omega / g
    torque = Jo Omega' / g + load

with the input speed Omega in rad/s, the gear ratio g, and the torque in N m at the sensor behind the gear.
"""

from numba import njit

from slipstick.blocks.input import converter_torque

_AFTER = 2
"""Samples from lock-up to the speed that the integration starts from: the smoothed speed has a corner at lock-up."""


@njit(nogil=True, cache=True, error_model="numpy")
def couple(time, lock, speed, motor, inertia, brake, given, losses, curves, torque):  # type: ignore[no-untyped-def]
    """Replace `torque` (n, k) from the samples `lock` (n,) on.

    `time` (k,), input `speed` (n, k), `motor` speed, load `inertia`, `brake` and `given` input torque (n,). `losses`
    are T_ic, b_iv, b_ov, Ji and g; `curves` (3, m) the speed ratio, torque ratio and capacity factor of the converter.
    """
    coulomb, viscous, load_viscous, own, gear = losses
    for i in range(len(lock)):
        if lock[i] >= len(time):
            continue
        x = speed[i, min(lock[i] + _AFTER, len(time) - 1)]
        for t in range(lock[i], len(time)):
            drive = converter_torque(x, motor[i], curves) + given[i] - viscous * x - coulomb
            load = brake[i] + load_viscous * x / gear
            rate = (drive - load / gear) / (own + inertia[i] / (gear * gear))
            torque[i, t] = inertia[i] * rate / gear + load
            if t + 1 < len(time):
                x = x + (time[t + 1] - time[t]) * rate
