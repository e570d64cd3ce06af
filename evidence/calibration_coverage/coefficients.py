"""Coefficients: 90 % intervals of the amplitude of an effect that a whole study names and fits.

Recordings of 54 runs of the bench `heavy`, with the scatter of the bench and one effect at twice its typical amplitude,
are studied. An interval counts where the study gives a formula to be simulated.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import ndtri

from evidence.calibration_coverage.sets import BENCHES
from evidence.calibration_coverage.table import Row
from slipstick.clutch import effects
from slipstick.clutch.model import Model
from slipstick.recordings.simulated import simulated_recordings
from slipstick.studies import StudySettings, conclude, examine

SETS = 3
"""Simulated sets of each effect."""
EFFECTS = ("stribeck_friction", "quadratic_load_drag", "supply_droop", "temperature_drift", "viscosity_drift",
           "pressure_dependent_friction")
RUNS, MULTIPLE = 54, 2.0


def list_jobs(sets: int) -> list[tuple[str, int]]:
    """Return effect and seed of each study."""
    return [(name, seed) for seed in range(sets) for name in EFFECTS]


def run_job(name: str, seed: int) -> dict[str, Any]:
    """Return the true amplitude, and lower end, estimate and upper end of its interval, or None without a formula."""
    bench, settings = BENCHES["heavy"], StudySettings()
    coefficients = effects.find(name).on(bench.scales).coefficients
    values = {each.name: each.typical if each.shape else each.neutral + MULTIPLE * (each.typical - each.neutral)
              for each in coefficients}
    amplitude = next(each.name for each in coefficients if not each.shape)
    conditions = bench.conditions.take(np.linspace(0, len(bench.conditions) - 1, RUNS).astype(int))
    recordings = simulated_recordings(bench, Model(bench.physics).with_effect(name, values), conditions, seed=seed)
    result, _ = conclude(settings, bench, recordings, examine(settings, bench, recordings))
    intervals = [(each.lower, each.value, each.upper) for finding in result.findings if finding.effect == name
                 for each in finding.confirmation.coefficients if each.name == amplitude]
    return {"effect": name, "named": name in result.effects, "true": values[amplitude],
            "interval": intervals[0] if intervals else None}


def make_rows(results: Sequence[dict[str, Any]]) -> list[Row]:
    """Return the row of each effect, and one of all of them."""
    rows = [_rate_effect(name, [result for result in results if result["effect"] == name]) for name in EFFECTS]
    return [*rows, _rate_effect("all", results)]


def _rate_effect(label: str, results: Sequence[dict[str, Any]]) -> Row:
    width = 2 * ndtri((1 + StudySettings().level) / 2)  # of an interval in standard errors
    known = np.array([(result["true"], *result["interval"]) for result in results if result["interval"]])
    true, lower, value, upper = known.reshape(-1, 4).T
    notes = [f"named in {sum(result['named'] for result in results)} of {len(results)} studies"]
    if len(known):
        notes += [f"median |error| / standard error {np.median(np.abs(value - true) * width / (upper - lower)):.3g}",
                  f"median relative error {np.median((value - true) / true):.2g}"]
    return Row(label, len(results), len(known), int(((lower <= true) & (true <= upper)).sum()), "; ".join(notes))
