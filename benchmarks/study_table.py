"""The rates in study_blind.csv, from the answers that `benchmarks.study_blind` has collected."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from scipy.stats import beta

from benchmarks.results import write
from benchmarks.study_signatures import signatures
from slipstick.clutch import effects
from slipstick.study import confidence
from slipstick.study.confidence import KINDS
from tests.validation.hidden import EFFECTS

SAME = {
    "friction_falls_with_slip": "stribeck_friction", "friction_rises_with_slip": "stribeck_friction",
    "friction_falls_with_pressure": "pressure_dependent_friction", "thermal_fade": "thermal_fade",
    "friction_build_up": "friction_buildup_lag", "oil_temperature_piston": "temperature_drift",
    "oil_temperature_film": "viscosity_drift", "centrifugal_head": "centrifugal_pressure",
    "supply_droop": "supply_droop", "flow_limited_fill": "flow_limited_fill", "entrained_air": "entrained_air",
    "valve_hysteresis": "valve_hysteresis", "valve_deadband": "valve_deadband", "seal_friction": "seal_friction",
    "spring_stiffening": "return_spring", "quadratic_load_drag": "quadratic_load_drag",
    "load_friction_falls": "falling_load_friction", "shaft_compliance": "shaft_compliance",
    "converter_lag": "converter_lag", "wear": "clearance_drift",
    **{name: name for sensor in ("pressure", "input_speed", "output_speed", "output_torque")
       for name in (f"{sensor}_sensor_lag", f"{sensor}_sensor_offset", f"{sensor}_sensor_gain")},
}
"""Hidden effect -> the catalogue's name for it."""
HEADER = ("cases", "what", "value", "lower", "upper", "of", "target", "met")
_TYPICAL = "effect, strength 1, noise 0.01"
TARGETS: dict[tuple[str, str], tuple[str, float]] = {
    (_TYPICAL, "right first"): (">=", 0.95), (_TYPICAL, "right class"): (">=", 0.98),
    (_TYPICAL, "error of quantity"): ("<=", 0.05), (_TYPICAL, "90 % interval holds it"): (">=", 0.85),
    (_TYPICAL, "closure of signal"): (">=", 0.9), (_TYPICAL, "control of signal"): ("<=", 0.2),
    (_TYPICAL, "closure of shifting time"): (">=", 0.9), (_TYPICAL, "its control"): ("<=", 0.2),
    ("effect, all", "90 % interval holds it"): (">=", 0.85), ("null", "false alarm"): ("<=", 1 / 60),
    ("outside", "right block"): (">=", 0.9), ("outside", "false name"): ("<=", 0.1),
    ("pair", "both named"): (">=", 0.7)}
"""(Cases, what) -> what it was to be, set before anything was measured."""
VISIBLE = 0.5
"""Noise levels that an effect must leave at typical strength to count as one that recordings show."""
SAME_FORM = ("_sensor_lag", "_sensor_offset", "shaft_compliance")
"""Endings of hidden effects whose strength is a coefficient of the catalogue's form."""
Row = dict[str, Any]
Judge = Callable[[Row], bool]


def named(row: Row) -> list[str]:
    """The effects named, in their order; an unlisted term is no name."""
    answer = row.get("answer", {"kind": "failed"})
    return list(answer["effects"]) if answer["kind"] in ("effect", "tie", "several") else []


def wanted(row: Row) -> set[str]:
    """The catalogue's names of what is hidden."""
    return {SAME[name] for name in row["hidden"] if name in SAME}


def right(row: Row) -> bool:
    """Is the first effect named a hidden one, and not tied with another?"""
    return bool(named(row)) and named(row)[0] in wanted(row) and len(row["answer"]["tied"][0]) == 1


def right_class(row: Row) -> bool:
    """Does the first effect named, or one tied with it, act on the hidden one's quantity, or is it the hidden one?"""
    if not named(row):
        return False
    quantities = {effects.find(name).quantity for name in wanted(row)}
    group = row["answer"]["tied"][0]
    return bool(wanted(row) & set(group)) or effects.find(group[0]).quantity in quantities


def right_block(row: Row) -> bool:
    """Is the block right in which the first effect is said to act, named or unlisted?"""
    block = row.get("answer", {}).get("block")
    return block is not None and block in {EFFECTS[name].block for name in row["hidden"]}


def alarm(row: Row) -> bool:
    """Is anything said to be missing?"""
    return row.get("answer", {"kind": "failed"})["kind"] != "none"


def regressed(row: Row) -> bool:
    """Does the one-shot regression name a hidden effect?"""
    return row.get("regression", {}).get("effect") in wanted(row)


def both(row: Row) -> bool:
    """Are all hidden effects named?"""
    return wanted(row) <= set(named(row))


def more(row: Row) -> bool:
    """Is an effect named that is not hidden?"""
    return bool(set(named(row)) - wanted(row))


def visible(row: Row) -> bool:
    """Do all hidden effects leave something that recordings show, at typical strength?"""
    return all(signatures().get(name, 0.0) >= VISIBLE for name in row["hidden"])


JUDGES: dict[str, dict[str, Judge]] = {
    "effect": {"right first": right, "right class": right_class, "right block": right_block,
               "one named that is not hidden": more, "regression right": regressed},
    "null": {"false alarm": alarm, "regression names": lambda row: bool(row.get("regression", {}).get("effect"))},
    "pair": {"both named": both, "one of them first": right, "right class first": right_class,
             "one named that is not hidden": more},
    "outside": {"right block": right_block, "false name": lambda row: bool(named(row)), "nothing missing":
                lambda row: not alarm(row)},
}


def summarise(path: Path) -> None:
    """Write rates of all cases in the file with Clopper-Pearson intervals of 90 %, and medians with quartiles."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    groups: dict[str, list[Row]] = {}
    for row in rows:
        kind, what, *rest = row["case"].split("/")
        if kind == "effect":
            names = ["effect, all", f"effect, strength {rest[0]}, noise {rest[1]}"]
        elif kind.startswith("effect-"):
            names = [f"effect, {kind.removeprefix('effect-')}"]
        else:
            names = [kind, f"null, {what}"] if kind == "null" else [kind]
        for name in names + [f"{name}, visible" for name in names if row["hidden"] and visible(row)]:
            groups.setdefault(name, []).append(row)
    table = []
    for name, some in sorted(groups.items()):
        kind = name.split(",")[0]
        table += [[name, what, *share(sum(map(judge, some)), len(some))] for what, judge in JUDGES[kind].items()]
        if kind == "effect":
            table += [[name, what, *spread(values)] for what, values in _measured(some).items() if len(values) > 2]
            inside = [one for row in some if (one := _covered(row)) is not None]
            if inside:
                table.append([name, "90 % interval holds it", *share(sum(inside), len(inside))])
        table.append([name, "seconds", *spread([row["seconds"] for row in some if "seconds" in row])])
    write("study_blind", HEADER, [_judged(row) for row in table], "python -m benchmarks.study_blind")
    calibrate(rows)


def _judged(row: list[Any]) -> list[object]:
    """A row of the table with its target, if it has one, and whether that is met."""
    name, what, value, *_ = row
    sign, target = TARGETS.get((name, what), ("", 0.0))
    met = value >= target if sign == ">=" else value <= target
    return [*row, *((f"{sign} {target:.3g}", "yes" if met else "no") if sign else ("", ""))]


def calibrate(rows: list[Row]) -> None:
    """Write the shares that `slipstick.study.confidence` states, and how they come out in two halves of the cases."""
    table, stated = [], {}
    for kind in KINDS:
        halves: tuple[list[bool], list[bool]] = ([], [])
        for row in rows:
            if named(row) and row["answer"]["evidence"] == kind:
                halves[crc32(row["case"].encode()) % 2].append(bool(wanted(row) & set(row["answer"]["tied"][0])))
        both = [*halves[0], *halves[1]]
        # One more of each: a share of none or all is not known from a few.
        stated[kind] = round((sum(both) + 1) / (len(both) + 2), 2)
        table.append([kind, stated[kind], *share(sum(both), len(both)),
                      *(entry for half in halves for entry in (sum(half), len(half)))])
    header = ("evidence", "stated", "share", "lower", "upper", "of", "in one half", "of it", "in the other", "of it")
    write("study_confidence", header, table, "python -m benchmarks.study_blind")
    Path(confidence.__file__).with_name("confidence.json").write_text(json.dumps(stated) + "\n")


def _measured(rows: list[Row]) -> dict[str, list[float]]:
    """Where the effect is named: closures, also of the signal that showed it most, controls', and the law's error."""
    found: dict[str, list[float]] = {"closure of shifting time": [], "its control": [], "closure of signal": [],
                                     "control of signal": [], "error of quantity": []}
    for row in rows:
        if not named(row) or named(row)[0] not in wanted(row):
            continue
        gap, control = row["gap"]["closures"], row["gap"]["control"]
        most = max(gap, key=lambda one: (one != "shifting_time") * gap[one]["rms_before"] / gap[one]["rms_expected"])
        values = (*(its and its[one]["closure"] for one in ("shifting_time", most)
                    for its in (gap, control and control["closures"])), next(iter(row["quantity"].values()), None))
        for what, value in zip(found, values, strict=True):
            if value is not None:
                found[what].append(value)
    return found


def _covered(row: Row) -> bool | None:
    """Is the hidden strength in the interval of the named effect's first coefficient, where that is the same thing?"""
    (hidden, strength), *more = row["hidden"].items()
    if more or not hidden.endswith(SAME_FORM) or SAME[hidden] not in named(row):
        return None
    one = next(one for one in row["answer"]["coefficients"] if one["effect"] == SAME[hidden])
    return bool(one["lower"] <= strength <= one["upper"])


def share(count: int, of: int) -> list[object]:
    """A rate with its Clopper-Pearson interval of 90 %."""
    lower = float(beta.ppf(0.05, count, of - count + 1)) if count else 0.0
    upper = float(beta.ppf(0.95, count + 1, of - count)) if count < of else 1.0
    return [count / of if of else None, lower, upper, of]


def spread(values: list[float]) -> list[object]:
    """Median and quartiles."""
    return [*(float(one) for one in np.quantile(values, (0.5, 0.25, 0.75))), len(values)]
