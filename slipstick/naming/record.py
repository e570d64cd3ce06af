"""A finished naming as JSON, so that a durable job keeps it."""

from typing import Any

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.study import Naming


def to_json(found: Naming) -> dict[str, Any]:
    """The naming as JSON."""
    return {
        "findings": [{"blocks": list(one.blocks), "pair": list(one.pair), "gain": one.gain.tolist(),
                      "rivals": [_values(rival) for rival in one.rivals],
                      "next_best": one.next_best and _values(one.next_best),
                      "expected": None if one.expected is None else one.expected.tolist(),
                      "agreement": one.agreement, "rare": one.rare}
                     for one in found.findings],
        "set_aside": list(found.set_aside), "unexplained": list(found.unexplained),
        "outlying": {key: list(rows) for key, rows in found.outlying.items()}, "chi_square": found.chi_square,
        "measured": [law.to_dict() for law in found.measured.values()],
        "parameters": {name: values.tolist() for name, values in found.parameters.items()},
        "clocks": found.clocks, "converter": found.converter.spec(),
        "noise": {name: list(its) for name, its in found.noise.items()}, "seconds": found.seconds,
        "is_complete": found.is_complete}


def from_json(values: dict[str, Any]) -> Naming:
    """The naming of `to_json`."""
    findings = tuple(
        Finding(tuple(one["blocks"]), tuple(one["pair"]), np.array(one["gain"]),
                tuple(_rival(rival) for rival in one["rivals"]),
                _rival(one["next_best"]) if one.get("next_best") else None,
                None if one.get("expected") is None else np.array(one["expected"]), one.get("agreement", 0.0),
                one.get("rare", False))
        for one in values["findings"])
    laws = [LawPoints.from_dict(law) for law in values["measured"]]
    return Naming(findings, tuple(values["set_aside"]), tuple(values["unexplained"]),
                  {key: tuple(rows) for key, rows in values.get("outlying", {}).items()}, values["chi_square"],
                  {law.pair: law for law in laws},
                  {name: np.array(column) for name, column in values["parameters"].items()}, values["clocks"],
                  Converter.from_spec(values["converter"]),
                  {name: (std, rho) for name, (std, rho) in values["noise"].items()}, values["seconds"],
                  values.get("is_complete", True))


def _values(rival: Rival) -> list[Any]:
    return [list(rival.pair), rival.nats, rival.behind]


def _rival(values: list[Any]) -> Rival:
    pair, nats, behind = values
    return Rival(tuple(pair), nats, behind)
