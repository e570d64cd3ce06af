"""What looks wrong in imported recordings: the marks of a swapped channel, a wrong sign or a wrong unit.

A doubt refuses nothing. Each has a reason that no sound recording gives, whatever the bench.
"""

import numpy as np

from slipstick.acquisition.lock_up import lateness
from slipstick.bench import Bench, parameters
from slipstick.recordings import Recordings

_RATIO = 0.02
"""Relative deviation of the ratio of the speeds after lock-up from the gear ratio: teeth do not slip, and speed sensors
are better than that."""


def doubts(recordings: Recordings, bench: Bench, located: np.ndarray) -> tuple[str, ...]:
    """Sentences about what the measured signals show, each with what to check; none without signals.

    `located` (n,) are the shifting times by the speeds in s, NaN where these show none.
    """
    signals, lines = recordings.signals, []
    if signals is None:
        return ()
    gear, has = bench.physics.nominal[parameters.index("gear_ratio")], set(signals.names)
    time, lock = signals.time, recordings.measured_time[:, None]
    after, before = time >= lock, (time < lock) & (time > 0)
    if {"input_speed", "output_speed"} <= has and after.any():
        ratio = float(np.median(signals["input_speed"][after]) / np.median(signals["output_speed"][after]))
        if abs(ratio / gear - 1) > _RATIO:
            lines.append(f"After lock-up the input speed is {ratio:.3g} times the output speed, and the gear ratio of "
                         f"the bench is {gear:g}. Check the channels and units of both speeds, or gear_ratio")
    if "output_torque" in has and np.median(signals["output_torque"][before]) < 0:
        lines.append("Before lock-up the output torque is negative. If its sensor counts the other way round, add "
                     "sign = -1 to the mapping")
    if "pressure" in has:
        first, held = signals["pressure"][:, 0], np.median(signals["pressure"], axis=1)
        if np.median(held) <= np.median(first):
            lines.append("The pressure does not rise after the shift command. Check its channel and sign, and the "
                         "shift command")
    if "input_speed" in has:
        start = float(np.median(signals["input_speed"][:, 0] / recordings.conditions.motor_speed))
        if bench.physics.converter is not None and not 0 < start < 1 + _RATIO:
            lines.append(f"At the shift command the input speed is {start:.3g} times the motor speed, and a converter "
                         "transmits at most the motor speed. Check channels, units and signs of both")
    if {"input_speed", "output_speed"} <= has:
        slip = np.median(signals["input_speed"][:, 0] - gear * signals["output_speed"][:, 0])
        if slip <= 0:
            lines.append("At the shift command the output shaft is not slower than the input shaft. Check whether the "
                         "speeds are swapped")
    late = lateness(located, recordings.measured_time, time[1] - time[0])
    if late:
        side, later = ("after", "later") if late > 0 else ("before", "earlier")
        lines.append(f"The speeds become equal {1e3 * abs(late):.3g} ms {side} the recorded shifting time, in the "
                     f"median of {len(recordings)} engagements. If a delay of the trigger moves all signals, put t = 0 "
                     f"that much {later}, by a time in [shift_command]. If the recorded time is wrong, leave out "
                     "[shifting_time]: it is then computed from the speeds. Or else a speed sensor lags")
    return tuple(lines)
