"""A finished naming as JSON, so that a durable job keeps it."""

from typing import Any

import numpy as np

from slipstick.bench.converter import Converter
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.study import Naming


def to_json(naming: Naming) -> dict[str, Any]:
    """The naming as JSON."""
    return {
        "findings": [{"blocks": list(finding.blocks), "pair": list(finding.pair), "gain": finding.gain.tolist(),
                      "rivals": [_list_rival(rival) for rival in finding.rivals],
                      "next_best": finding.next_best and _list_rival(finding.next_best),
                      "expected": None if finding.expected is None else finding.expected.tolist(),
                      "agreement": finding.agreement, "rare": finding.rare}
                     for finding in naming.findings],
        "set_aside": list(naming.set_aside), "unexplained": list(naming.unexplained),
        "outlying": {key: list(rows) for key, rows in naming.outlying.items()}, "chi_square": naming.chi_square,
        "measured": [law.to_dict() for law in naming.measured.values()],
        "parameters": {name: values.tolist() for name, values in naming.parameters.items()},
        "clocks": naming.clocks, "converter": naming.converter.spec(),
        "beyond": {name: list(change) for name, change in naming.beyond.items()},
        "noise": {name: list(noise) for name, noise in naming.noise.items()}, "seconds": naming.seconds,
        "is_complete": naming.is_complete}


def from_json(values: dict[str, Any]) -> Naming:
    """The naming of `to_json`."""
    findings = tuple(
        Finding(tuple(entry["blocks"]), tuple(entry["pair"]), np.array(entry["gain"]),
                tuple(_read_rival(rival) for rival in entry["rivals"]),
                _read_rival(entry["next_best"]) if entry.get("next_best") else None,
                None if entry.get("expected") is None else np.array(entry["expected"]), entry.get("agreement", 0.0),
                entry.get("rare", False))
        for entry in values["findings"])
    laws = [LawPoints.from_dict(law) for law in values["measured"]]
    return Naming(findings, tuple(values["set_aside"]), tuple(values["unexplained"]),
                  {key: tuple(rows) for key, rows in values.get("outlying", {}).items()}, values["chi_square"],
                  {law.pair: law for law in laws},
                  {name: np.array(column) for name, column in values["parameters"].items()}, values["clocks"],
                  Converter.from_spec(values["converter"]),
                  {name: (change, error) for name, (change, error) in values.get("beyond", {}).items()},
                  {name: (std, rho) for name, (std, rho) in values["noise"].items()}, values["seconds"],
                  values.get("is_complete", True))


def _list_rival(rival: Rival) -> list[Any]:
    return [list(rival.pair), rival.nats, rival.behind]


def _read_rival(values: list[Any]) -> Rival:
    pair, nats, behind = values
    return Rival(tuple(pair), nats, behind)
