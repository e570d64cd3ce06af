"""Families of random shapes that hidden effects of a simulated test bench may have.

Every form is drawn from a numpy Generator: first the family, all families being equally likely, then its parameters.
The same state of the generator gives the same form. All forms can be pickled.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator
from scipy.interpolate import BSpline, CubicSpline, PchipInterpolator, make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

GRID = np.linspace(0.0, 1.0, 401)
"""Points (401,) on which curves are normalised."""

_NODES = np.linspace(0.0, 1.0, 2001)
_SMOOTH_NODES = np.linspace(-0.5, 1.5, 401)
_STEEPEST = 200.0  # largest slope of any curve; a step of width 0.01 has 150
_SHARPEST = 1500.0  # largest second derivative of a smooth curve; a Gaussian bump 0.06 wide at half height has 1540


@dataclass(frozen=True, eq=False)
class Curve:
    """Dimensionless law over an abscissa that is scaled so that [0, 1] is visited.

    `values` (n,) at `nodes` (n,), joined by a spline with two continuous derivatives everywhere if `smooth`, else by a
    shape-preserving one with one; constant beyond the nodes.
    """

    family: str
    nodes: np.ndarray
    values: np.ndarray
    smooth: bool = False

    @cached_property
    def _spline(self) -> BSpline | PchipInterpolator:
        if self.smooth:
            level = [(1, 0.0), (2, 0.0)]
            return make_interp_spline(self.nodes, self.values, k=5, bc_type=(level, level))
        return PchipInterpolator(self.nodes, self.values)

    def __call__(self, u: np.ndarray) -> np.ndarray:
        """Return the values of the law, of the shape of `u`."""
        return self._spline(np.clip(u, self.nodes[0], self.nodes[-1]))

    @property
    def trend(self) -> str:
        """"falling", "rising" or "neither": monotone over [0, 1] to within 10 % of the peak-to-peak change."""
        values = self(GRID)
        allowed = 0.1 * np.ptp(values)
        if allowed > 0 and np.max(np.maximum.accumulate(values) - values) <= allowed:
            return "rising"
        if allowed > 0 and np.max(values - np.minimum.accumulate(values)) <= allowed:
            return "falling"
        return "neither"


Draw = Callable[[Generator, np.ndarray], np.ndarray]


def _draw_log(random: Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _rise(u: np.ndarray, start: float, width: float) -> np.ndarray:
    part = np.clip((u - start) / width, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def _draw_places(random: Generator, count: int, apart: float = 0.06) -> np.ndarray:
    """Return `count` sorted random places in [0.03, 0.93] that are at least `apart` apart."""
    free = 0.9 - apart * (count - 1)
    return 0.03 + np.sort(random.uniform(0.0, free, count)) + apart * np.arange(count)


def _draw_spline(random: Generator, u: np.ndarray) -> np.ndarray:
    count = int(random.integers(4, 8))
    knots = np.linspace(0.0, 1.0, count)
    knots[1:-1] += random.uniform(-0.35, 0.35, count - 2) / (count - 1)
    values = random.normal(size=count)
    if random.random() < 0.3:
        values = np.sort(values)
    return (CubicSpline if random.random() < 0.6 else PchipInterpolator)(knots, values)(u)


def _draw_rough(random: Generator, u: np.ndarray) -> np.ndarray:
    waves = random.normal(size=(2, 12)) * np.exp(-np.arange(1, 13) / _draw_log(random, 1.5, 8.0))
    angles = 2.0 * np.pi * np.outer(np.arange(1, 13) * random.uniform(0.5, 0.95), u)
    return waves[0] @ np.sin(angles) + waves[1] @ np.cos(angles)


def _draw_broken_line(random: Generator, u: np.ndarray) -> np.ndarray:
    places = _draw_places(random, int(random.integers(1, 5)), 0.08)
    return np.interp(u, np.r_[0.0, places, 1.0], random.uniform(0.0, 1.0, places.size + 2))


def _draw_step(random: Generator, u: np.ndarray) -> np.ndarray:
    return _rise(u, random.uniform(0.03, 0.93), random.uniform(0.01, 0.05))


def _draw_several_steps(random: Generator, u: np.ndarray) -> np.ndarray:
    places = _draw_places(random, int(random.integers(2, 6)))
    heights = random.uniform(0.2, 1.0, places.size)
    if random.random() < 0.5:
        heights *= random.choice([-1.0, 1.0], places.size)
    return heights @ np.array([_rise(u, place, random.uniform(0.01, 0.05)) for place in places])


def _draw_staircase(random: Generator, u: np.ndarray) -> np.ndarray:
    count, width = int(random.integers(3, 9)), random.uniform(0.01, 0.05)
    first, slope = random.uniform(-0.9, 0.0) / count, random.choice([0.0, 0.5]) * random.uniform() * count
    return slope * u + np.sum([_rise(u, first + step / count, width) for step in range(count + 2)], axis=0)


def _draw_window(random: Generator, u: np.ndarray) -> np.ndarray:
    length = _draw_log(random, 0.05, 0.6)
    start, edges = random.uniform(0.0, 0.95 - length), random.uniform(0.01, 0.05, 2)
    return _rise(u, start, edges[0]) - random.uniform(0.5, 1.0) * _rise(u, start + length, edges[1])


def _draw_bump(random: Generator, u: np.ndarray) -> np.ndarray:
    size = np.abs(u - random.uniform(-0.05, 1.05)) / _draw_log(random, 0.02, 0.4)
    return (np.exp(-0.5 * size**2), 1 / (1 + size**2), np.maximum(1 - size / 2, 0), np.exp(-((size / 1.5) ** 4)))[
        random.integers(4)
    ]


def _draw_lopsided_bump(random: Generator, u: np.ndarray) -> np.ndarray:
    offset = np.maximum(u - random.uniform(-0.1, 0.6), 0.0) / _draw_log(random, 0.03, 0.4)
    return offset ** random.uniform(1.0, 3.0) * np.exp(-offset)


def _draw_dispersion(random: Generator, u: np.ndarray) -> np.ndarray:
    offset = (u - random.uniform(0.1, 0.9)) / _draw_log(random, 0.04, 0.4)
    return offset * np.exp(-0.5 * offset**2) if random.random() < 0.5 else offset / (1.0 + offset**2)


def _draw_resonance(random: Generator, u: np.ndarray) -> np.ndarray:
    ratio = u / random.uniform(0.2, 0.9)
    return ratio ** random.integers(0, 3) / np.hypot(1.0 - ratio**2, 2.0 * _draw_log(random, 0.05, 0.5) * ratio)


def _draw_power(random: Generator, u: np.ndarray) -> np.ndarray:
    return (u + 0.003) ** _draw_log(random, 0.3, 4.0)


def _draw_root(random: Generator, u: np.ndarray) -> np.ndarray:
    offset, least = u - random.uniform(0.15, 0.85), _draw_log(random, 0.003, 0.1)
    return offset / (offset**2 + least**2) ** random.uniform(0.2, 0.4)


def _draw_saturation(random: Generator, u: np.ndarray) -> np.ndarray:
    scaled = u / _draw_log(random, 0.03, 0.6)
    return (scaled / (1.0 + scaled), -np.expm1(-scaled), np.tanh(scaled), np.minimum(scaled, 1.0))[random.integers(4)]


def _draw_clamp(random: Generator, u: np.ndarray) -> np.ndarray:
    low = random.uniform(0.0, 0.7)
    return np.clip(u, low, random.uniform(low + 0.08, 1.0))


def _draw_threshold(random: Generator, u: np.ndarray) -> np.ndarray:
    return (np.maximum(u - random.uniform(0.08, 0.88), 0.0) + 0.003) ** _draw_log(random, 0.4, 3.5)


def _draw_dead_zone(random: Generator, u: np.ndarray) -> np.ndarray:
    low, length = random.uniform(0.05, 0.6), random.uniform(0.08, 0.35)
    return np.minimum(u - low, 0.0) + random.uniform(-1.5, 1.5) * np.maximum(u - low - length, 0.0)


def _draw_exponential(random: Generator, u: np.ndarray) -> np.ndarray:
    rate = _draw_log(random, 0.5, 15.0)
    return np.exp(rate * (u - 1.0)) if random.random() < 0.7 else np.exp(np.exp(0.3 * rate * (u - 1.0)))


def _draw_valley_with_tilt(random: Generator, u: np.ndarray) -> np.ndarray:
    offset = (u - random.uniform(0.1, 0.9)) / _draw_log(random, 0.04, 0.25)
    return random.uniform(-1.5, 1.5) * u - np.exp(-0.5 * offset**2)


def _draw_stribeck(random: Generator, u: np.ndarray) -> np.ndarray:
    drop = np.exp(-((u / _draw_log(random, 0.03, 0.5)) ** random.uniform(0.7, 2.0)))
    return drop + random.uniform(0.0, 1.2) * u


def _draw_comb(random: Generator, u: np.ndarray) -> np.ndarray:
    count = random.uniform(2.0, 6.0)
    turns, fall = count * u + random.uniform(), count * random.uniform(0.01, 0.05)
    part = np.mod(turns, 1.0)
    wave = (
        np.cos(2.0 * np.pi * turns),
        np.minimum(part / (1.0 - fall), (1.0 - part) / fall) - 0.5,
        np.abs(np.sin(np.pi * turns)) - 0.64,
        np.exp(random.uniform(1.0, 5.0) * (np.cos(2.0 * np.pi * turns) - 1.0)),
    )[random.integers(4)]
    return wave * np.exp(random.uniform(-2.0, 2.0) * random.integers(0, 2) * u)


def _draw_ramp_and_drop(random: Generator, u: np.ndarray) -> np.ndarray:
    place, drop = random.uniform(0.15, 0.9), random.uniform(0.3, 1.2)
    return u ** random.uniform(1.0, 2.5) - drop * place * _rise(u, place, random.uniform(0.01, 0.05))


_SIMPLE: dict[str, Draw] = {
    "line": lambda random, u: u,
    "polynomial": lambda random, u: np.prod([u - root for root in random.uniform(-0.5, 1.5, random.integers(2, 5))], 0),
    "spline": _draw_spline,
    "rough": _draw_rough,
    "broken_line": _draw_broken_line,
    "step": _draw_step,
    "several_steps": _draw_several_steps,
    "staircase": _draw_staircase,
    "window": _draw_window,
    "bump": _draw_bump,
    "two_bumps": lambda random, u: _draw_bump(random, u) + random.uniform(-1.0, 1.0) * _draw_bump(random, u),
    "lopsided_bump": _draw_lopsided_bump,
    "dispersion": _draw_dispersion,
    "resonance": _draw_resonance,
    "power": _draw_power,
    "root": _draw_root,
    "saturation": _draw_saturation,
    "clamp": _draw_clamp,
    "threshold": _draw_threshold,
    "dead_zone": _draw_dead_zone,
    "exponential": _draw_exponential,
    "hyperbola": lambda random, u: (u + _draw_log(random, 0.02, 1.0)) ** -random.uniform(0.5, 2.0),
    "logarithm": lambda random, u: np.log(u + _draw_log(random, 0.003, 0.5)),
    "logistic": lambda random, u: np.tanh((u - random.uniform(0.1, 0.9)) / _draw_log(random, 0.03, 0.5)),
    "valley_with_tilt": _draw_valley_with_tilt,
    "stribeck": _draw_stribeck,
    "comb": _draw_comb,
    "chirp": lambda random, u: np.cos(random.uniform(9, 32) * u ** random.uniform(0.6, 2) + random.uniform(0, 6.3)),
    "beat": lambda random, u: random.uniform(0.3, 1.0, 2) @ np.cos(
        np.outer(random.uniform(6.0, 38.0, 2), u) + random.uniform(0.0, 6.3, (2, 1))
    ),
    "ramp_and_drop": _draw_ramp_and_drop,
}


def _draw_any(random: Generator, u: np.ndarray) -> np.ndarray:
    values = _SIMPLE[str(random.choice(list(_SIMPLE)))](random, u if random.random() < 0.5 else 1.0 - u)
    return values / max(float(np.ptp(values)), 1e-9)


def _draw_sum(random: Generator, u: np.ndarray) -> np.ndarray:
    return _draw_any(random, u) + random.choice([-1.0, 1.0]) * random.uniform(0.2, 1.0) * _draw_any(random, u)


def _draw_product(random: Generator, u: np.ndarray) -> np.ndarray:
    return _draw_any(random, u) * _draw_any(random, u)


def _draw_two_regimes(random: Generator, u: np.ndarray) -> np.ndarray:
    share = _rise(u, random.uniform(0.1, 0.8), _draw_log(random, 0.03, 0.3))
    return _draw_any(random, u) * (1.0 - share) + random.choice([-1.0, 1.0]) * _draw_any(random, u) * share


_CURVES: dict[str, Draw] = _SIMPLE | {"sum": _draw_sum, "product": _draw_product, "two_regimes": _draw_two_regimes}
CURVES: tuple[str, ...] = tuple(_CURVES)


def _draw_sessions(random: Generator, u: np.ndarray, anew: bool) -> np.ndarray:
    """Return a drift that starts again at every session; from the same level if `anew`, else from random levels."""
    starts = np.r_[0.0, _draw_places(random, int(random.integers(1, 6)), 0.1)]
    pace, width, kind = _draw_log(random, 0.02, 0.4), random.uniform(0.01, 0.03), random.integers(3 if anew else 4)
    total = np.zeros_like(u)
    for start, end in zip(starts, np.r_[starts[1:], 2.0], strict=True):
        since = np.maximum(u - start, 0.0) / pace
        course = (-np.expm1(-since), since * pace, np.log1p(since), np.zeros_like(u))[kind]
        course = course * random.uniform(0.7, 1.3) + (0.0 if anew else random.normal(scale=0.7))
        begun = _rise(u, start, width) if start > 0 else 1.0
        total += course * (begun - _rise(u, end, width))
    return total


def _draw_walk(random: Generator, u: np.ndarray) -> np.ndarray:
    walk = gaussian_filter1d(np.cumsum(random.normal(size=81)), _draw_log(random, 1.5, 8.0))
    return CubicSpline(np.linspace(0.0, 1.0, 81), walk)(u)


def _draw_reversal(random: Generator, u: np.ndarray) -> np.ndarray:
    turn, sharp = random.uniform(0.15, 0.85), random.uniform(0.01, 0.3)
    back = random.uniform(0.5, 2.0)
    return u - (1.0 + back) * sharp * np.logaddexp(0.0, (u - turn) / sharp)


def _draw_failure(random: Generator, u: np.ndarray) -> np.ndarray:
    place = random.uniform(0.05, 0.85)
    recovery = np.exp(-np.maximum(u - place, 0.0) / _draw_log(random, 0.05, 1.0))
    return _rise(u, place, random.uniform(0.01, 0.05)) * recovery


_DRIFTS: dict[str, Draw] = {
    "line": lambda random, u: u,
    "warming": lambda random, u: -np.expm1(-u / _draw_log(random, 0.04, 1.0)),
    "running_in": lambda random, u: np.log1p(u * _draw_log(random, 3.0, 200.0)),
    "wear": lambda random, u: u ** random.uniform(1.0, 5.0),
    "relaxation": lambda random, u: np.exp(-u / _draw_log(random, 0.02, 0.1)) + random.uniform(0, 2) * np.exp(-2 * u),
    "sudden_change": lambda random, u: _draw_step(random, u) + random.choice([0.0, 0.5]) * random.normal() * u,
    "sudden_changes": _draw_several_steps,
    "failure_and_recovery": _draw_failure,
    "sessions": lambda random, u: _draw_sessions(random, u, anew=True),
    "session_levels": lambda random, u: _draw_sessions(random, u, anew=False),
    "random_walk": _draw_walk,
    "spline": _draw_spline,
    "reversal": _draw_reversal,
    "hump": _draw_lopsided_bump,
    "late_onset": _draw_threshold,
    "until_a_limit": _draw_clamp,
    "cycle": lambda random, u: random.uniform(-2, 2) * u + np.cos(random.uniform(5, 28) * u + random.uniform(0, 6.3)),
    "service": _draw_ramp_and_drop,
}
DRIFTS: tuple[str, ...] = tuple(_DRIFTS)

_FRICTIONS: dict[str, Draw | None] = {
    "constant": None,
    "stribeck": _draw_stribeck,
    "growing": _draw_power,
    "saturating": _draw_saturation,
    "threshold": _draw_threshold,
    "stepping_up": _draw_step,
    "stepping_down": lambda random, u: -_draw_step(random, u),
    "falling": lambda random, u: -_draw_saturation(random, u),
    "hump": _draw_bump,
    "valley": lambda random, u: -_draw_bump(random, u),
    "spline": _draw_spline,
}
FRICTIONS: tuple[str, ...] = tuple(_FRICTIONS)


def _build_curve(
    random: Generator, family: str, draw: Draw, smooth: bool = False, turn: bool = True, spill: float = 2.0
) -> Curve:
    """Return a curve with values 0 to 1 over [0, 1] and at most `spill` beyond them outside.

    The sign and the end from which the family starts are random if `turn`.
    """
    for _ in range(1000):
        if smooth:
            margin = random.uniform(0.08, 0.2)
            nodes, place = _SMOOTH_NODES, np.clip((_SMOOTH_NODES + margin) / (1.0 + 2.0 * margin), 0.0, 1.0)
        else:
            nodes = place = _NODES
        sign = random.choice([-1.0, 1.0]) if turn else 1.0
        mirrored = turn and random.random() < 0.5
        raw = sign * draw(random, 1.0 - place if mirrored else place)
        if smooth:
            raw = gaussian_filter1d(raw, random.uniform(0.03, 0.045) / 0.005, mode="nearest", truncate=5.0)
        visited = Curve(family, nodes, raw, smooth)(GRID) if smooth else raw[::5]
        if np.ptp(visited) <= 1e-3 * np.ptp(raw):
            continue
        values = (raw - visited.min()) / np.ptp(visited)
        values = values if smooth else np.round(values, 12)  # level parts are level, without denormal slopes
        steps, pitch = np.diff(values), nodes[1] - nodes[0]
        jump, limit = (np.diff(steps), _SHARPEST * pitch**2) if smooth else (steps, _STEEPEST * pitch)
        if np.abs(jump).max() <= limit and values.min() >= -spill and values.max() <= 1.0 + spill:
            return Curve(family, nodes, values, smooth)
    raise RuntimeError(f"no admissible curve of family {family}")


def _lift_curve(curve: Curve, floor: float) -> Curve:
    """Return the curve with its values 0 to 1 mapped to `floor` to 1."""
    values = curve.values if curve.smooth else np.clip(curve.values, 0.0, 1.0)
    return Curve(curve.family, curve.nodes, floor + (1.0 - floor) * values, curve.smooth)


def draw_curve(random: Generator, smooth: bool = False) -> Curve:
    """Return a law of a random family of `CURVES`, from 0 to 1 over the visited range [0, 1].

    If `smooth` it has two continuous derivatives everywhere and no feature narrower than 0.06.
    """
    family = str(random.choice(CURVES))
    return _build_curve(random, family, _CURVES[family], smooth)


def draw_drift(random: Generator) -> Curve:
    """Return a drift of a random family of `DRIFTS` over the order of the runs (0 first, 1 last), from 0 to 1."""
    family, sign = str(random.choice(DRIFTS)), random.choice([-1.0, 1.0])
    return _build_curve(random, family, lambda source, u: sign * _DRIFTS[family](source, u), turn=False)


def draw_friction(random: Generator) -> Curve:
    """Return the relative size, 0.2 to 1 with maximum 1, of a dry friction over the relative driving force [0, 1]."""
    family = str(random.choice(FRICTIONS))
    draw = _FRICTIONS[family]
    if draw is None:
        return Curve(family, np.array([0.0, 1.0]), np.ones(2))
    return _lift_curve(_build_curve(random, family, draw, turn=False), random.uniform(0.2, 0.9))


def draw_size(random: Generator, smooth: bool = False) -> Curve:
    """Return a positive law of a random family of `CURVES`: 0.25 to 1, maximum 1 over [0, 1], at least 0.1 outside."""
    family = str(random.choice(CURVES))
    return _lift_curve(_build_curve(random, family, _CURVES[family], smooth, spill=0.2), random.uniform(0.25, 0.9))


def _weigh_pole(period: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the weights of new input, old input and old output of a pole with `time` (s) for input linear in time."""
    time = np.asarray(time)
    time = np.where(np.abs(time) < 1e-9 * period, 1e-9 * period, time)
    kept = np.exp(-period / time)
    mean = time / period * (1.0 - kept)
    return 1.0 - mean, mean - kept, kept


def _filter_pole(signal: np.ndarray, period: float, time: complex) -> np.ndarray:
    """Return the response, which is at rest before the first sample, of a pole to a signal that starts from 0."""
    new, old, kept = _weigh_pole(period, time)
    return lfilter([new, old], [1.0, -kept], signal, axis=-1)


def _look_back(signal: np.ndarray, period: float, times: np.ndarray) -> np.ndarray:
    """Return the signal at `times` (k,) in s, linear between samples and constant before the first."""
    place = np.clip(times / period, 0.0, signal.shape[1] - 1.0)
    index = np.minimum(place.astype(int), max(signal.shape[1] - 2, 0))
    part = place - index
    return signal[:, index] * (1.0 - part) + signal[:, np.minimum(index + 1, signal.shape[1] - 1)] * part


def _average(signal: np.ndarray, period: float, window: float) -> np.ndarray:
    """Return the mean over the last `window` (s) of a signal that starts from 0 and is linear between samples."""
    window = max(window, 1e-4 * period)
    segments = 0.5 * period * (signal[:, 1:] + signal[:, :-1])
    area = np.concatenate([np.zeros((signal.shape[0], 1)), np.cumsum(segments, axis=1)], axis=1)
    start = np.arange(signal.shape[1]) * period - window
    index = np.clip(np.floor(start / period).astype(int), 0, None)
    first = np.maximum(start - index * period, 0.0)
    before = area[:, index] + 0.5 * first * (signal[:, index] + _look_back(signal, period, np.maximum(start, 0.0)))
    return (area - before) / window


def _respond_linearly(
    family: str, traits: Mapping[str, float], signal: np.ndarray, period: float, delay: float
) -> np.ndarray:
    time = np.arange(signal.shape[1]) * period
    if family in ("cascade", "diffusion"):
        for name in sorted(traits):
            signal = _filter_pole(signal, period, traits[name] * delay)
        return signal
    if family == "dead_time":
        return _look_back(signal, period, time - delay)
    if family == "dead_time_and_pole":
        late = _look_back(signal, period, time - traits["dead"] * delay)
        return _filter_pole(late, period, (1.0 - traits["dead"]) * delay)
    if family == "moving_average":
        for _ in range(int(traits["passes"])):
            signal = _average(signal, period, 2.0 * delay / traits["passes"])
        return signal
    if family == "underdamped":
        damping = traits["damping"]
        root = complex(-damping, np.sqrt(1.0 - damping**2))
        share = -root.conjugate() / (root - root.conjugate())
        return 2.0 * np.real(share * _filter_pole(signal, period, -delay / (2.0 * damping * root)))
    if family in ("quick_and_slow", "overshoot"):
        share, ratio = traits["share"], traits["ratio"]
        quick = delay / (1.0 - share + share * ratio)
        slow = _filter_pole(signal, period, ratio * quick)
        return (1.0 - share) * _filter_pole(signal, period, quick) + share * slow
    if family == "echo":
        back = traits["reflection"]
        travel = delay * (1.0 - back) / (1.0 + back)
        waves = sum(back**turn * _look_back(signal, period, time - (2 * turn + 1) * travel) for turn in range(12))
        return waves * (1.0 - back) / (1.0 - back**12)
    spacing = delay if family == "linear_hold" else 2.0 * delay
    turns = np.floor(time / spacing - traits["phase"])
    held = _look_back(signal, period, (turns + traits["phase"]) * spacing)
    if family == "sample_and_hold":
        return held
    part = time / spacing - traits["phase"] - turns
    return part * held + (1.0 - part) * _look_back(signal, period, (turns - 1.0 + traits["phase"]) * spacing)


def _respond_nonlinearly(
    family: str, traits: Mapping[str, float], signal: np.ndarray, period: float, delay: float
) -> np.ndarray:
    """Step through the samples; sizes are relative to the range that a row has covered up to then."""
    count = signal.shape[1]
    covered = np.maximum.accumulate(signal, axis=1) - np.minimum.accumulate(signal, axis=1)
    covered = np.maximum(covered, 1e-300)
    reach = min(max(1, round(delay / period)), count)
    back = np.concatenate([np.repeat(signal[:, :1], reach, axis=1), signal[:, : count - reach]], axis=1)
    share = traits.get("band", 0.0) * min(delay / (reach * period), 1.0)  # of the largest change within a delay so far
    band = share * np.maximum.accumulate(np.abs(signal - back), axis=1)
    output = signal.copy()
    driven, moving = signal[:, 0].copy(), np.zeros(signal.shape[0], dtype=bool)
    for index in range(1, count):
        last, new = output[:, index - 1], signal[:, index]
        previous = signal[:, index - 1]
        factor = np.ones_like(new)
        if family == "rise_and_fall":
            factor = np.where(new + previous > 2.0 * last, traits["ratio"] ** 0.5, traits["ratio"] ** -0.5)
        elif family == "size_dependent":
            level = np.minimum(np.abs(last - signal[:, 0]) / covered[:, index], 1.0)
            factor = np.exp(traits["growth"] * (level - 0.5))
        elif family == "speed_dependent":
            factor = 1.0 / (1.0 + traits["thinning"] * np.abs(new - last) / covered[:, index])
        elif family == "warming_lag":
            factor += traits["growth"] * np.exp(-index * period / (traits["pace"] * delay))
        elif family == "wavering_lag":
            factor += traits["growth"] * np.sin(index * period / (traits["pace"] * delay) + traits["phase"])
        elif family in ("deadband", "stiction"):
            factor *= 1.0 - traits["band"]
            width, previous = band[:, index], driven
            if family == "deadband":
                new = np.clip(driven, new - width, new + width)
            else:
                gap = np.abs(new - last)
                moving = np.where(moving, gap > 0.1 * width, gap > width)
                new, previous = np.where(moving, new, last), np.where(moving, driven, last)
            driven = new
        fresh, old, kept = _weigh_pole(period, factor * delay)
        result = fresh * new + old * previous + kept * last
        if family == "slew_limited":
            most = traits["rate"] * covered[:, index] * period / delay
            result = np.clip(result, last - most, last + most)
        output[:, index] = result
    return output


_LAGS: dict[str, Callable[[Generator], dict[str, float]]] = {
    "cascade": lambda random: dict(zip("abc", random.dirichlet(np.full(random.integers(1, 4), 3.0)), strict=False)),
    "diffusion": lambda random: {str(pole): 0.8123 / (2 * pole + 1) ** 2 for pole in range(random.integers(6, 9))},
    "dead_time": lambda random: {},
    "dead_time_and_pole": lambda random: {"dead": random.uniform(0.1, 0.9)},
    "moving_average": lambda random: {"passes": random.integers(1, 4)},
    "underdamped": lambda random: {"damping": random.uniform(0.3, 0.9)},
    "quick_and_slow": lambda random: {"share": random.uniform(0.05, 0.4), "ratio": _draw_log(random, 3.0, 15.0)},
    "overshoot": lambda random: {"share": -random.uniform(0.05, 0.3), "ratio": random.uniform(1.5, 2.8)},
    "echo": lambda random: {"reflection": random.uniform(-0.4, 0.5)},
    "sample_and_hold": lambda random: {"phase": random.uniform()},
    "linear_hold": lambda random: {"phase": random.uniform()},
    "rise_and_fall": lambda random: {"ratio": _draw_log(random, 0.2, 5.0)},
    "slew_limited": lambda random: {"rate": _draw_log(random, 0.2, 1.5)},
    "size_dependent": lambda random: {"growth": random.uniform(-1.5, 1.5)},
    "speed_dependent": lambda random: {"thinning": _draw_log(random, 0.5, 8.0)},
    "warming_lag": lambda random: {"growth": random.uniform(-0.7, 1.5), "pace": _draw_log(random, 3.0, 100.0)},
    "wavering_lag": lambda random: {
        "growth": random.uniform(0.1, 0.6), "pace": _draw_log(random, 1.0, 30.0), "phase": random.uniform(0.0, 6.3)
    },
    "deadband": lambda random: {"band": random.uniform(0.05, 0.35)},
    "stiction": lambda random: {"band": random.uniform(0.05, 0.35)},
}
LAGS: tuple[str, ...] = tuple(_LAGS)
LINEAR_LAGS: tuple[str, ...] = LAGS[: LAGS.index("rise_and_fall")]


@dataclass(frozen=True)
class Lag:
    """Response of a slow sensor or line; `traits` are dimensionless parameters of the family."""

    family: str
    traits: Mapping[str, float]

    def __call__(self, signal: np.ndarray, period: float, delay: float) -> np.ndarray:
        """Return the response (n, k) to `signal` (n, k), whose rows are sampled every `period` (s).

        A slow ramp is late by about `delay` (s) in the end. Before its first sample a signal is constant.
        """
        signal = np.asarray(signal, dtype=float)
        if delay <= 1e-9 * period or signal.size == 0:
            return signal.copy()
        first = signal[:, :1]  # the responses are at rest there and start from 0
        respond = _respond_linearly if self.family in LINEAR_LAGS else _respond_nonlinearly
        return first + respond(self.family, self.traits, signal - first, period, delay)


def draw_lag(random: Generator) -> Lag:
    """Return the response of a random family of `LAGS`."""
    family = str(random.choice(LAGS))
    return Lag(family, {name: float(value) for name, value in _LAGS[family](random).items()})


@dataclass(frozen=True, eq=False)
class Memory:
    """Hysteresis as plays (backlash elements) in parallel.

    `widths` (m,) are relative to the mean width: their mean weighted by `weights` (m,), which sum to 1, is 1.
    `asymmetry` in [-0.3, 0.3] shifts the plays to one side, relative to their width.
    """

    widths: np.ndarray
    weights: np.ndarray
    asymmetry: float


def draw_memory(random: Generator) -> Memory:
    """Return one play, few plays or a broad distribution of 4 to 7 plays with equal probability."""
    count = int((1, random.integers(2, 4), random.integers(4, 8))[random.integers(3)])
    spread = _draw_log(random, 1.5, 15.0)
    widths = np.sort(spread ** random.uniform(-0.5, 0.5, count))
    weights = random.dirichlet(np.full(count, 2.0))
    weights = weights / weights.sum()
    return Memory(widths / (weights @ widths), weights, float(random.uniform(-0.3, 0.3)))
