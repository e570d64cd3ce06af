"""Recordings that cannot be of a bench: of another machine, or with a wrong sign or a unit off by powers of ten.

What most engagements show is compared with the simulation of their conditions, so that single flawed recordings do not
count. A level cannot be right if it is nearer to a tenth of the simulated one, or to ten times it, than to it, wherever
the uncertain parameters lie within their bounds.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.blocks.load import Load
from slipstick.clutch import effects, ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings

_NEAR = np.sqrt(10)
"""Factor beyond which a ratio is nearer to a power of ten than to 1, in the logarithm."""
_SETTLED = 0.1
"""Share of the samples after lock-up that counts, the one nearest to the gear ratio: sensors lag, and clutches open."""
_CONDITIONS = "the units of motor_speed, load_inertia, brake_torque and the current profiles"


@dataclass(frozen=True)
class Mismatch:
    """Why recordings cannot be of a bench, and what to check."""

    cause: str
    remedy: str


def require_match(recordings: Recordings, bench: Bench, model: Model | None = None) -> None:
    """Raise `InvalidValue` with all `mismatches`, if there are any."""
    reasons = mismatches(recordings, bench, model)
    if reasons:
        raise InvalidValue("; ".join(mismatch.cause for mismatch in reasons),
                           ". ".join(dict.fromkeys(mismatch.remedy for mismatch in reasons)))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # of levels of 0
def mismatches(recordings: Recordings, bench: Bench, model: Model | None = None) -> tuple[Mismatch, ...]:
    """Why the n `recordings` cannot be of the `bench`, whose nominal model is simulated if there is no other `model`.

    It takes one simulation of the n engagements, and two for each uncertain parameter before a level is called wrong.
    """
    model = model or Model(bench.physics)
    vector, free = np.array(model.parameters), [parameters.index(name) for name in bench.uncertain]
    bounds = np.array([(bench.prior(name).lower, bench.prior(name).upper) for name in bench.uncertain]).reshape(-1, 2)
    lower, upper = bounds.T * np.array(bench.physics.nominal)[free]

    def ratios_at(values: np.ndarray) -> np.ndarray:
        changed = vector.copy()
        changed[free] = values
        return _ratios(recordings, replace(model, parameters=tuple(changed.tolist())))

    ratios = ratios_at(vector[free])
    nearest = nearest_ratios(lambda values: _medians(ratios_at(values)), _medians(ratios), vector[free], lower, upper)
    names = ("shifting_time", *_signals(recordings))
    levels = [_level(*each) for each in zip(names, ratios, nearest, strict=True) if not is_near(each[2])]
    has_reversed_torque = bool(nearest[names.index("output_torque")] < 0) if "output_torque" in names else False
    load = [] if has_reversed_torque else _load(recordings, vector)
    return *_gear(recordings, float(vector[parameters.index("gear_ratio")])), *load, *levels


def is_near(ratio: float) -> bool:
    """Whether a ratio of levels is positive and nearer to 1 than to a power of ten; NaN, that of nothing, is."""
    return not (ratio < 1 / _NEAR or ratio > _NEAR)


@np.errstate(divide="ignore")
def nearest_ratios(ratios: Callable[[np.ndarray], np.ndarray], first: np.ndarray, centre: np.ndarray, lower: np.ndarray,
                   upper: np.ndarray) -> np.ndarray:
    """The `ratios` (q,) of inputs (d,), as near to 1 as inputs within `lower`, `upper` (d,) bring them.

    Of those at the `centre` (d,), the `first`, negative ones and those near 1 stay. Each other one is tried with one
    input at a bound, for all inputs and bounds, and with every input at its better bound; it is 1 if it passes 1.
    """
    nearest = first.copy()
    far = [column for column, ratio in enumerate(first) if ratio >= 0 and not is_near(ratio)]
    if not far or not len(centre):
        return nearest
    ends = np.array([[ratios(np.where(np.arange(len(centre)) == row, bound, centre)) for bound in (lower, upper)]
                     for row in range(len(centre))])
    for column in far:
        side = np.sign(np.log(first[column]))
        distances = side * np.log(np.abs(ends[:, :, column]))
        together = ratios(np.where(distances[:, 0] < distances[:, 1], lower, upper))[column]
        nearest[column] = np.exp(side * max(0.0, np.nanmin([*distances.flat, side * np.log(abs(together))])))
    return nearest


def _signals(recordings: Recordings) -> tuple[str, ...]:
    return () if recordings.signals is None else recordings.signals.names


def _medians(ratios: np.ndarray) -> np.ndarray:
    """Medians (q,) of rows (q, n) without NaN; NaN where a row has nothing else."""
    return np.array([np.median(row[~np.isnan(row)]) if np.any(~np.isnan(row)) else np.nan for row in ratios])


def _ratios(recordings: Recordings, model: Model) -> np.ndarray:
    """Recorded over simulated shifting time, 0 for an engagement that never locks, and levels of signals: (q, n)."""
    signals = recordings.signals
    if signals is None:
        response = ensemble.signals(model, recordings.conditions, np.empty(0))
    else:
        response = ensemble.signals(model, recordings.conditions, signals.time[signals.time >= 0])
    rows = [recordings.measured_time / np.nan_to_num(response.shifting_time[0], nan=np.inf)]
    if signals is not None:
        rows += [_signed_ratios(signals[name][:, signals.time >= 0], getattr(response, name)[0])
                 for name in signals.names]
    return np.array(rows)


def _signed_ratios(recorded: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Ratios (n,) of the RMS of signals (n, k), negative where their product is so in the mean."""
    size = np.sqrt(np.sum(recorded**2, axis=1, dtype=float) / np.sum(simulated**2, axis=1))
    return np.asarray(np.where(np.sum(recorded * simulated, axis=1) < 0, -size, size))


def times(ratio: float) -> str:
    """A ratio in words."""
    return f"{ratio:.3g} times" if ratio < 1e6 else "more than a million times"


def _level(name: str, ratios: np.ndarray, nearest: float) -> Mismatch:
    """The mismatch of a level with `ratios` (n,), whose median comes `nearest` to 1 within the bounds."""
    words, n, middle = name.replace("_", " "), len(ratios), float(_medians(ratios[None])[0])
    if name == "shifting_time" and middle == 0:
        return Mismatch(f"In the simulation {np.sum(ratios == 0)} of the {n} recorded engagements never lock",
                        f"Check {_CONDITIONS}, or give the bench of these recordings")
    if nearest < 0:
        return Mismatch(f"The {words} of the recordings has the opposite sign of that of the simulation, in "
                        f"{np.sum(ratios < 0)} of {n} engagements",
                        "If its sensor counts the other way round, change its sign (sign = -1 in the mapping). If not, "
                        f"check {_CONDITIONS}")
    return Mismatch(f"The {words} of the recordings is {times(middle)} that of the simulation in the median of {n} "
                    f"engagements, and still {times(nearest)} that at the bounds of the uncertain parameters",
                    f"Check the unit of the {words} and {_CONDITIONS}, or give the bench of these recordings")


def _gear(recordings: Recordings, gear: float) -> list[Mismatch]:
    """Speeds after lock-up whose ratio is not that of the teeth, even with the largest gain error of a sensor."""
    signals = recordings.signals
    if signals is None or not {"input_speed", "output_speed"} <= set(signals.names):
        return []
    ratios, locked = [], signals.time >= recordings.measured_time[:, None]
    for first, second, after in zip(signals["input_speed"], signals["output_speed"], locked, strict=True):
        shown = np.abs(first[after] / second[after])
        if len(shown):
            ratios.append(shown[np.argsort(np.abs(np.log(shown / gear)))[int(_SETTLED * len(shown))]])
    ratio, gain = float(_medians(np.array([ratios]))[0]), effects.find("output_speed_sensor_gain")
    error = gain.coefficients[0].upper
    if not (ratio / gear < 1 - error or ratio / gear > 1 / (1 - error)):
        return []
    return [Mismatch(f"After lock-up the input speed is {ratio:.3g} times the output speed in the median of "
                     f"{len(ratios)} engagements, and the gear ratio of the bench is {gear:g}",
                     "Give the bench of these recordings, or check the channels and units of both speeds")]


def _load(recordings: Recordings, vector: np.ndarray) -> list[Mismatch]:
    """A torque, speed and inertia of the load that contradict its equation of motion."""
    signals = recordings.signals
    if signals is None or not {"output_torque", "output_speed"} <= set(signals.names):
        return []
    predicted = Load.of(recordings).predict(np.tile(vector, (len(recordings), 1)))
    ratio = abs(_medians(_signed_ratios(signals["output_speed"], predicted)[None])[0])
    if is_near(ratio):
        return []
    return [Mismatch(f"The output speed of the recordings is {times(ratio)} that to which their output torque "
                     f"accelerates their load inertia, in the median of {len(recordings)} engagements",
                     "Check the units of load_inertia, brake_torque, output torque and output speed")]
