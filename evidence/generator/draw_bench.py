"""Draws a bench whose numbers nobody has chosen.

Ranges are those that a wet powershift clutch could have. What must fit together is drawn as a ratio: for example the
spring as the share of the pressure that it balances at the contact. The first admissible draw is taken: at least 90 %
of the nominal engagements lock within the recording, and in as many the plates slip in contact for 30 samples or more.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .bench import SENSORS, SYMBOLS, Bench, read_bench
from .engagements import Engagements
from .run import Run, observe

ENGAGEMENTS = range(28, 73)
SHARE = 0.9  # least share of nominal engagements that lock and slip
SLIPPING = 30  # least number of samples of slip in contact
SAMPLES = 2500  # most samples of a recording, for the size of files
UNCERTAIN = ("tau", "a", "k", "aa", "kT", "x30", "alpha")
UNITS = {"tau": "s", "a": "A", "k": "bar/A", "a2": "m/bar", "b2": "m/(s bar)", "d2": "1/s", "aa": "bar",
         "z_contact": "m", "x30": "m", "beta": "m", "gamma": "N m^2 s", "alpha": "N m/Pa", "Ji": "kg m^2",
         "Tic": "N m", "biv": "N m s", "bov": "N m s"}


class Chance:
    """Random numbers to three digits."""

    def __init__(self, seed: list[int]) -> None:
        self.random = np.random.default_rng(seed)

    def even(self, low: float, high: float) -> float:
        """Draw evenly."""
        return rounded(self.random.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        """Draw evenly in the logarithm."""
        return rounded(float(np.exp(self.random.uniform(np.log(low), np.log(high)))))

    def count(self, low: int, high: int) -> int:
        """Draw an integer, `high` included."""
        return int(self.random.integers(low, high + 1))

    def levels(self, highest: float, lowest: float, count: int) -> list[float]:
        """Return ascending levels, unevenly spaced; `lowest` is a share of the highest, which alone is the only one."""
        between = np.cumsum(self.random.uniform(0.6, 1.4, count - 1))
        inner = lowest + (1 - lowest) * between / between[-1] if count > 1 else []
        return [rounded(highest * share) for share in ([lowest, *inner] if count > 1 else [1.0])]


def rounded(value: float, digits: int = 3) -> float:
    """Return the value with so many significant digits."""
    return float(f"{value:.{digits}g}")


def curves(chance: Chance, size: float) -> dict[str, list[float]]:
    """Return the converter: the torque ratio falls until the coupling point, and the capacity rises steeply at 1."""
    ratio = np.sort([0, *chance.levels(0.9, chance.even(0.08, 0.2), chance.count(7, 9)), 0.94, 0.97, 1])
    stall, coupling, bend = chance.even(1.5, 3.4), chance.even(0.78, 0.9), chance.even(0.75, 1.1)
    torque = np.where(ratio < coupling, stall - (stall - 1) * (ratio / coupling) ** bend,
                      1 - chance.even(0.02, 0.05) * (ratio - coupling) / (1 - coupling))
    wave = chance.even(-0.05, 0.05) * np.sin(2 * np.pi * (ratio * chance.even(0.8, 1.6) + chance.even(0, 1)))
    capacity = size * (1 + chance.even(-0.15, 0.4) * ratio + wave) / np.sqrt(1.015 - ratio ** chance.even(3.2, 6))
    return {"speed_ratio": [rounded(x) for x in ratio], "torque_ratio": [rounded(x) for x in torque],
            "capacity_factor": [rounded(x) for x in capacity]}


def profile(chance: Chance, knots: int, full: float, contact: float, fill: float, rise: float,
            end: float) -> list[tuple[float, float]]:
    """Return the knots (time, pressure) of a command: mostly a fill, then steps and ramps up to nearly `full`."""
    points, touch = [(0.0, 0.0)], contact + full * chance.even(-0.05, 0.12)
    ramp = chance.even(0.02, 0.1) * fill
    if chance.even(0, 1) < 0.75:
        high, held = full * chance.even(0.55, 0.95), ramp + fill * chance.even(0.3, 1.1)
        points += [(ramp, high), (held, high), (held + ramp, touch)]
    else:
        points += [(ramp + fill * chance.even(0, 0.8), touch)]
    left = knots - len(points) - 1
    gaps = np.array([chance.log(0.05, 1) for _ in range(left)])
    rises = np.array([chance.even(0, 1) * (-0.5 if chance.even(0, 1) < 0.15 else 1) for _ in range(left)])
    levels = touch + (full * chance.even(0.8, 1) - touch) * np.cumsum(rises) / max(rises.sum(), rises[-1], 0.5)
    times = points[-1][0] + rise * np.cumsum(gaps) / gaps.sum()
    return [*points, *zip(times, levels, strict=True), (end, levels[-1])]


def write_bench(name: str, chance: Chance) -> tuple[str, int]:
    """Draw a bench, and return its bench file and the number of engagements per condition."""
    pace, full, speed = chance.log(0.5, 2.4), chance.even(8, 20), chance.even(1100, 2900)
    fill, load_time = pace * chance.even(0.08, 0.4), pace * chance.even(0.3, 0.9)
    fastest = speed * np.pi / 30
    pump, gear = chance.log(30, 950), chance.log(0.6, 5)
    stroke, piston_inertia = chance.log(6e-4, 8e-3), chance.even(0.7, 1.8)
    converter = curves(chance, fastest / np.sqrt(pump))
    turbine = pump * converter["torque_ratio"][0]
    bias, spring = full * chance.even(0.08, 0.18), full * chance.even(0.06, 0.2)
    friction, output_speed, span = turbine * chance.even(0.55, 2), fastest / gear, chance.log(0.14, 1.4)
    b2 = stroke * piston_inertia / (fill * 0.35 * full)
    values = {
        "tau": 0.045 * pace * chance.log(0.4, 2), "a": chance.log(0.03, 0.6), "k": full / span,
        "a2": stroke / 10 * chance.even(0.006, 0.03), "b2": b2, "c2": piston_inertia, "d2": spring * b2 / stroke,
        "aa": bias, "kT": 1.0, "z_contact": stroke, "x30": stroke * chance.even(0.1, 0.28),
        "beta": stroke * chance.even(0.008, 0.016),
        "gamma": friction * chance.log(0.004, 0.03) * stroke / output_speed,
        "alpha": friction / (1e5 * full), "gr": gear, "Ji": turbine * chance.log(0.05, 0.18) / fastest,
        "Tic": turbine * chance.even(0.004, 0.016), "biv": turbine * chance.even(0.004, 0.016) / fastest,
        "bov": turbine * gear * chance.even(0.012, 0.05) / output_speed, "eps": chance.even(0.04, 0.16)}
    values = {symbol: rounded(value) for symbol, value in values.items()}
    inertia = turbine * gear * load_time / output_speed
    conditions = {
        "motor_speed": (chance.levels(speed, chance.even(0.45, 0.75), chance.count(2, 6)), "rpm"),
        "load_inertia": (chance.levels(inertia, chance.even(0.4, 0.7), chance.count(1, 3)), "kg m^2"),
        "brake_torque": (chance.levels(turbine * gear * chance.even(0.04, 0.16), chance.even(0.15, 0.5),
                                       chance.count(1, 3)), "N m")}
    rise, period, knots = pace * chance.even(0.5, 1.6), round(chance.log(1, 10.4)) / 1000, chance.count(8, 14)
    end = rounded(fill + rise + load_time * chance.even(1, 2))
    current = [[(rounded(time, 4), rounded(values["a"] + max(pressure, 0) / values["k"], 4)) for time, pressure in
                profile(chance, knots, full, bias + spring, fill, rise, end)] for _ in range(chance.count(2, 6))]
    noise = {"pressure": (full, "bar"), "input_speed": (0.8 * fastest, "rad/s"),
             "output_speed": (0.7 * output_speed, "rad/s"), "output_torque": (0.7 * gear * friction, "N m")}
    lines = ["# A bench whose numbers were drawn at random (draw_bench.py).", f'name = "{name}"',
             'title = "Bench with drawn numbers"',
             'source = "Drawn at random from ranges that wet powershift clutches could have; not measured."',
             "", "[parameters]"]
    bounds = dict.fromkeys(UNCERTAIN, (0.5, 1.5)) | {"x30": (0.1, 3)}
    for full_name, symbol in SYMBOLS.items():
        value = f'"{values[symbol]:g} {UNITS[symbol]}"' if symbol in UNITS else f"{values[symbol]:g}"
        if symbol in bounds:
            lower, upper = bounds[symbol]
            value = f"{{ value = {value}, uncertain = true, lower = {lower:g}, upper = {upper:g} }}"
        lines.append(f"{full_name} = {value}")
    capacity = converter.pop("capacity_factor")
    lines += ["", "[converter]", *(f"{curve} = {column}" for curve, column in converter.items()),
              f'capacity_factor = {{ values = {capacity}, unit = "rad/s/(N m)^0.5" }}', "", "[sensors]",
              f'sample_time = "{period:g} s"']
    lines += [f'{sensor} = {{ noise = "{rounded(size * chance.log(0.002, 0.012)):g} {unit}" }}'
              for sensor, (size, unit) in noise.items()]
    lines += [f'shifting_time = {{ noise = "{chance.log(1, 5):g} ms" }}', "", "[conditions]"]
    lines += [f'{column} = {{ values = {levels}, unit = "{unit}" }}' for column, (levels, unit) in conditions.items()]
    for points in current:
        times, amperes = (list(column) for column in zip(*points, strict=True))
        lines += ["", "[[profiles]]", f'time = {{ values = {times}, unit = "s" }}',
                  f'current = {{ values = {amperes}, unit = "A" }}']
    return "\n".join(lines) + "\n", chance.count(1, 4)


def draw_bench(key: Sequence[int]) -> tuple[Bench, Run]:
    """Draw a bench from a key of integers, with a run of each of its conditions without deviations."""
    attempt = 0
    while True:
        attempt += 1
        text, repeats = write_bench(f"drawn-{'-'.join(map(str, key))}", Chance([*key, attempt]))
        bench = read_bench(text, repeats)
        if len(bench.profile) in ENGAGEMENTS and len(bench.time) <= SAMPLES:
            run = run_nominal(bench)
            if is_admissible(run):
                return run.engagements.bench, run


def run_nominal(bench: Bench) -> Run:
    """Run each condition of a bench once, without deviations; the bench of the result has its pace and ranges."""
    values = {symbol: np.full(len(bench.grid), value) for symbol, value in bench.parameters.items()}
    columns = (getattr(bench, name)[bench.grid] for name in ("motor_speed", "load_inertia", "brake_torque"))
    knots = (column[bench.profile[bench.grid]] for column in (bench.profile_time, bench.profile_current))
    sequence = bench.grid / len(bench.grid)
    run = observe(Engagements(bench, values, *columns, sequence, *knots), bench.grid, bench.grid, 1e-5, False)
    pace = float(np.median(run.lock_time)) if np.isfinite(np.median(run.lock_time)) else bench.horizon
    known = replace(bench, pace=pace, ranges={name: float(np.ptp(run.readings[name])) for name in SENSORS})
    return replace(run, engagements=replace(run.engagements, bench=known))


def is_admissible(run: Run) -> bool:
    """Return whether nearly all engagements lock, and slip for long enough."""
    time = run.engagements.bench.time
    slipping = (run.quantities["friction_torque"] > 0) & (time < run.lock_time[:, None])
    locks = np.isfinite(run.lock_time)
    return bool(np.mean(locks & (slipping.sum(axis=1) >= SLIPPING)) >= SHARE)
