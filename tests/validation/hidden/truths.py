"""The truth about a case, which its HDF5 file does not contain."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from .bench import SLIP, STICK
from .case import Case, bad_runs_of, simulate
from .effect import Effect
from .limits import read as read_limits
from .pairs import listed, pair
from .run import Run

_PARAMETERS = {"friction_coefficient": "alpha", "pressure_gain": "k", "film_coefficient": "gamma",
               "clearance": "z_contact", "oil_temperature_gain": "kT", "spring_rate": "d2", "piston_feed": "a2"}
_OF_PISTON = ("oil_temperature_gain", "clearance", "spring_rate", "piston_feed", "net_pressure", "piston_rate",
              "film_coefficient")
"""Quantities that change nothing once the plates are pressed together."""


def truth(case: Case, relative: float = 1e-8) -> dict[str, Any]:
    """Return the truth that `write` does not store, ready for JSON: effects, world, bad runs, parameters and more.

    `hidden` gives the name, pair (pairs.py) and strength of each effect, and rough `limit` from which it is visible.
    An entry of `changed` tabulates an effect between the 1 % and the 99 % quantile of its abscissa over the runs: the
    `grid`, the `change` at its points (of `kind` ratio or difference), the fraction of `visits` to each point and, if
    the quantity is a parameter, its `base` (mean over the runs), to which a ratio applies.
    """
    run, limits = simulate(case, relative), read_limits()
    means = {name: float(np.mean(values)) for name, values in run.bench.values.items()}
    changed = [_changed(effect, strength, run, means) for effect, strength in run.bench.effects]
    hidden = [{"name": effect.name, "pair": pair(effect), "listed": listed(effect), "block": effect.block,
               "strength": strength, "typical": effect.typical, "limit": limits.get((effect.name, case.bench))}
              for effect, strength in run.bench.effects]
    return {"hidden": hidden, "bench": case.bench, "count": case.count, "world": asdict(case.drawn_world),
            "bad_runs": [asdict(bad) for bad in bad_runs_of(case, run.conditions)], "runs": len(run.conditions),
            "effects": dict(case.effects), "seed": case.seed, "noise": case.noise, "shift": case.shift,
            "scatter": case.scatter, "drifting": case.drifting, "parameters": means,
            "scattered": {name: run.bench.values[name].tolist() for name in ("aa", "x30")},
            "lock_time": run.lock_time.tolist(), "changed": changed}


def write_truth(path: Path, case: Case) -> None:
    """Write `truth` as JSON."""
    path.write_text(json.dumps(truth(case), indent=1))


def _changed(effect: Effect, strength: float, run: Run, means: dict[str, float]) -> dict[str, Any]:
    visited = _visited(effect, run)
    grid = np.linspace(*np.quantile(visited, (0.01, 0.99)), 41)
    edges = np.concatenate([[-np.inf], (grid[1:] + grid[:-1]) / 2, [np.inf]])
    visits = np.histogram(visited, edges)[0] / visited.size
    table = {"grid": grid, "change": run.bench.change(effect, strength, grid), "visits": visits}
    return {"effect": effect.name, "block": effect.block, "strength": strength, "unit": effect.unit,
            "quantity": effect.quantity, "abscissa": effect.abscissa, "kind": effect.kind,
            "base": means.get(_PARAMETERS.get(effect.quantity, "")),
            **{name: np.broadcast_to(column, grid.shape).tolist() for name, column in table.items()}}


def _visited(effect: Effect, run: Run) -> np.ndarray:
    """Return the abscissa where the effect acts: friction while touching plates slip, the piston until full contact."""
    if effect.quantity == "valve_play":
        return np.repeat([-1.0, 1.0], 50)  # falling, rising
    if effect.quantity == "valve_plays":
        return np.linspace(0, 1, 100)  # fraction of the plays
    abscissa, mode = run.quantities[effect.abscissa], run.phase[1]
    if effect.quantity in ("friction_coefficient", "friction_lag"):
        return abscissa[(mode == SLIP) & (run.quantities["friction_torque"] > 0)]
    if effect.quantity in _OF_PISTON:
        return abscissa[(mode != STICK) & (run.quantities["piston_position"] < run.quantities["clearance"])]
    if effect.block == "torque" and not effect.quantity.startswith(("output_torque_sensor", "shaft")):
        return abscissa[mode != STICK]
    return abscissa
