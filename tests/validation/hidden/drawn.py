"""Draws the benches `drawn01` to `drawn180`, whose numbers nobody has chosen; run once for each twelve.

    python -m tests.validation.hidden.drawn

Ranges are those that a wet powershift clutch could have, a little wider than the spread of the other benches. What must
fit together is drawn as a ratio: for example the spring as the share of the pressure that it balances at the contact.
Of each bench the first admissible draw is taken: at least 90 % of the nominal engagements lock within the recording,
and in as many the plates slip in contact for at least 30 samples.
"""

import csv
from collections.abc import Iterator

import numpy as np

from .bench import Bench
from .nominal import DRAWN, HEAVY, SYMBOLS, Setup, from_text
from .run import Run, observe

SEEDS = {number: seed for first, seed in ((1, 41), (13, 83), (25, 127), (37, 173), (49, 211), (61, 251), (73, 271),
                                          (85, 293), (97, 331), (109, 373), (121, 421), (133, 461), (145, 503),
                                          (157, 547), (169, 587))
         for number in range(first, first + 12)}
"""Seed of each number of a bench."""
ENGAGEMENTS = range(24, 73)
SHARE = 0.9  # least share of nominal engagements that lock and slip
SLIPPING = 30  # least number of samples of slip in contact
SAMPLES = 2500  # most samples of a recording, for the size of files
UNITS = {"tau": "s", "a": "A", "k": "bar/A", "a2": "m/bar", "b2": "m/(s bar)", "d2": "1/s", "aa": "bar",
         "z_contact": "m", "x30": "m", "beta": "m", "gamma": "N m^2 s", "alpha": "N m/Pa", "Ji": "kg m^2",
         "Tic": "N m", "biv": "N m s", "bov": "N m s"}
Values = dict[str, float]


class Chance:
    """Random numbers to three digits."""

    def __init__(self, seed: list[int]) -> None:
        self.random = np.random.default_rng(seed)

    def even(self, low: float, high: float) -> float:
        return rounded(self.random.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        return rounded(float(np.exp(self.random.uniform(np.log(low), np.log(high)))))

    def count(self, low: int, high: int) -> int:
        return int(self.random.integers(low, high + 1))

    def levels(self, highest: float, lowest: float, count: int) -> list[float]:
        """Return ascending levels, unevenly spaced; `lowest` is a share of the highest, which alone is the only one."""
        between = np.cumsum(self.random.uniform(0.6, 1.4, count - 1))
        inner = lowest + (1 - lowest) * between / between[-1] if count > 1 else []
        return [rounded(highest * share) for share in ([lowest, *inner] if count > 1 else [1.0])]


def rounded(value: float, digits: int = 3) -> float:
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


def text(name: str, chance: Chance) -> tuple[str, int]:
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
    lines = ["# A bench whose numbers were drawn at random (drawn.py).", f'name = "{name}"',
             f'title = "Drawn test bench {name.removeprefix("drawn")}"',
             'source = "Drawn at random from ranges that wet powershift clutches could have; not measured."',
             "", "[parameters]"]
    bounds = dict.fromkeys(HEAVY.uncertain, (0.5, 1.5)) | {"x30": (0.1, 3)}
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


def nominal(setup: Setup) -> Run:
    """Run each condition of a bench once, without deviations."""
    grid = np.arange(len(setup.profile) // setup.repeats)
    values = {symbol: np.full(len(grid), value) for symbol, value in setup.parameters.items()}
    columns = (getattr(setup, name)[grid] for name in ("motor_speed", "load_inertia", "brake_torque"))
    knots = (column[setup.profile[grid]] for column in (setup.profile_time, setup.profile_current))
    return observe(Bench(values, *columns, grid / len(grid), *knots, setup=setup), grid, grid, relative=1e-5)


def admissible(setup: Setup, run: Run) -> bool:
    """Return whether nearly all engagements lock, and slip for long enough."""
    slipping = (run.quantities["friction_torque"] > 0) & (setup.time < run.lock_time[:, None])
    return np.sum(slipping.sum(axis=1) >= SLIPPING) >= SHARE * len(setup.profile) / setup.repeats


def sizes(run: Run) -> Values:
    """Return the sizes of the quantities of a bench: 90th percentiles before lock-up, unless another one is known."""
    before, p = run.bench.setup.time < run.lock_time[:, None], run.bench.setup.parameters
    size = {name: float(np.percentile(np.abs(run.quantities[name][before]), 90)) for name in (
        "current", "current_excess", "pressure", "contact_pressure", "driving_pressure", "free_piston_rate",
        "motor_speed", "input_speed", "output_speed", "slip", "output_torque", "load_torque", "input_drag",
        "contact_time", "energy", "heat", "output_position", "load_point", "pump_angle")}
    torque, time, stroke = size["output_torque"], float(np.median(run.lock_time)), p["z_contact"]
    inertia = 1 / (1 / np.mean(run.bench.load_inertia) + 1 / (p["Ji"] * p["gr"] ** 2))
    size |= dict.fromkeys(("pressure_demand", "chamber_pressure", "pressure_sensor"), size["pressure"])
    size |= dict.fromkeys(("time", "friction_lag", "converter_lag"), time)
    size |= dict.fromkeys(("piston", "piston_position", "clearance"), stroke)
    size |= {f"{name}_sensor": size[name] for name in ("input_speed", "output_speed", "output_torque")}
    return size | {"valve_current": float(np.max(run.bench.knot_current)) - p["a"], "net_pressure":
                   size["driving_pressure"], "piston_rate": size["free_piston_rate"], "piston_feed":
                   stroke / size["pressure"], "shaft_compliance": time / inertia, "twist": torque * time / inertia}


def benches() -> Iterator[tuple[str, str, int, Values]]:
    """Yield name, bench file, engagements per condition, and scale of each bench."""
    of_heavy = sizes(nominal(HEAVY))
    for number, seed in SEEDS.items():
        name, attempt = f"drawn{number:02}", 0
        while True:
            attempt += 1
            content, repeats = text(name, Chance([seed, number, attempt]))
            setup = from_text(content, repeats, {})
            if len(setup.profile) in ENGAGEMENTS and len(setup.time) <= SAMPLES:
                run = nominal(setup)
                if len(run.lock_time) and admissible(setup, run):
                    break
        print(name, attempt, len(setup.profile), len(setup.time))
        yield name, content, repeats, {quantity: rounded(size / of_heavy[quantity])
                                       for quantity, size in sizes(run).items()}


def main() -> None:
    """Draw and write the benches, and their scales."""
    DRAWN.mkdir(exist_ok=True)
    rows = []
    for name, content, repeats, scale in benches():
        (DRAWN / f"{name}.toml").write_text(content)
        rows.append({"bench": name, "repeats": repeats, **scale})
    with (DRAWN / "scales.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
