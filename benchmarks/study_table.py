"""The rates in study_blind.csv from the answers of `benchmarks.study_blind`, with Clopper-Pearson intervals."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scipy.stats import beta

from benchmarks.results import write
from slipstick.clutch import effects

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
HEADER = ("cases", "what", "share", "lower", "upper", "right", "of")
Rows = list[dict[str, Any]]


def first(row: dict[str, Any]) -> str | None:
    """The effect named first, if any."""
    named = row.get("answer", {}).get("effects", [])
    return str(named[0]) if named else None


def named_right(row: dict[str, Any]) -> bool:
    """Is the first effect named the hidden one?"""
    return first(row) in {SAME.get(name) for name in row["hidden"]}


def class_right(row: dict[str, Any]) -> bool:
    """Does the first effect named, or one tied with it, act on the same block, or is it the hidden one?"""
    wanted = {SAME[name] for name in row["hidden"] if name in SAME}
    tied = row.get("answer", {}).get("tied", [])
    if not tied:
        return False
    blocks = {effects.find(name).block for name in wanted}
    return bool(wanted & set(tied[0])) or effects.find(tied[0][0]).block in blocks


def both_right(row: dict[str, Any]) -> bool:
    """Are all hidden effects named?"""
    return {SAME[name] for name in row["hidden"]} <= set(row.get("answer", {}).get("effects", []))


def something(row: dict[str, Any]) -> bool:
    """Is anything said to be missing?"""
    return first(row) is not None


def summarise(path: Path) -> None:
    """Write the rates of all cases in the file."""
    rows: Rows = [json.loads(line) for line in path.read_text().splitlines()]
    groups: dict[str, Rows] = {}
    for row in rows:
        kind, *rest = row["case"].split("/")
        groups.setdefault("/".join([kind, *rest[1:]]) if kind.startswith("effect") else kind, []).append(row)
    table = []
    for name, some in sorted(groups.items()):
        judges: dict[str, Callable[[dict[str, Any]], bool]] = (
            {"false alarm": something} if name == "null" else {"both named": both_right, "one first": named_right}
            if name == "pair" else {"something found": something} if name == "outside"
            else {"right first": named_right, "right class": class_right})
        for what, judge in judges.items():
            table.append([name, what, *_share(sum(map(judge, some)), len(some))])
    write("study_blind", HEADER, table, "python -m benchmarks.study_blind")


def _share(right: int, of: int) -> list[object]:
    lower = float(beta.ppf(0.05, right, of - right + 1)) if right else 0.0
    upper = float(beta.ppf(0.95, right + 1, of - right)) if right < of else 1.0
    return [right / of, lower, upper, right, of]
