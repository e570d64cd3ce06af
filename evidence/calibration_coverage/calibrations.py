"""Calibrations: 90 % intervals of the means of all uncertain parameters, with all signals and without one of them.

Each set has true means, scatter and autocorrelation of its own. The width of an interval and the error of a mean are
compared with the Cramer-Rao bound of the mixed model whose scatter and noise are known, at the true parameters of each
run. Without a signal, the intervals of parameters count apart that the calibration says not to be determined.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import norm

from evidence.calibration_coverage.sets import BENCHES, SetTruth, draw_set
from evidence.calibration_coverage.table import Row
from slipstick.bench import Bench, parameters
from slipstick.calibration import calibrate, random_effects
from slipstick.calibration.calibrate import LEVEL
from slipstick.calibration.linearised import linearise
from slipstick.calibration.mixed import engagements
from slipstick.calibration.modes import axes
from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings

SETS = 60
MISSING = ("pressure", "output_torque", "input_speed")
"""Signals without which the first third of the sets of `heavy` is calibrated as well."""


def list_jobs(sets: int) -> list[tuple[str, str, int]]:
    """Return bench, missing signal and seed of each calibration."""
    return [(bench, "", seed) for seed in range(sets) for bench in BENCHES] + [
        ("heavy", missing, seed) for seed in range(sets // 3) for missing in MISSING]


def run_job(name: str, missing: str, seed: int) -> dict[str, Any]:
    """Return interval, error and bound of each parameter, as multiples of nominal values, and its scatter."""
    bench = BENCHES[name]
    recordings, truth = draw_set(bench, seed)
    bound = None if missing else compute_bound(bench, recordings, truth).tolist()
    if missing:
        assert recordings.signals is not None
        recordings = replace(recordings, signals=replace(recordings.signals, **{missing: None}))
    start = time.perf_counter()
    calibration = calibrate(recordings, bench)
    seconds = time.perf_counter() - start
    places = [parameters.index(name) for name in calibration.free]
    nominal = np.array(bench.physics.nominal)[places]
    lower, upper = (calibration.interval / nominal[:, None]).T
    return {"bench": name, "missing": missing, "free": calibration.free, "converged": calibration.converged,
            "determined": [name not in calibration.undetermined for name in calibration.free],
            "covered": ((lower <= truth.mean) & (truth.mean <= upper)).tolist(), "width": (upper - lower).tolist(),
            "error": (np.array(calibration.model.parameters)[places] / nominal - truth.mean).tolist(), "bound": bound,
            "scatter": (calibration.scatter / nominal / truth.scatter).tolist(), "seconds": seconds}


def compute_bound(bench: Bench, recordings: Recordings, truth: SetTruth) -> np.ndarray:
    """Return the Cramer-Rao bound (d,) of the standard errors: the means unknown, scatter and noise known."""
    model = Model(bench.physics)
    assert recordings.signals is not None
    observations = Observations(recordings, recordings.signals, bench, bench.uncertain, np.array(model.parameters),
                                model.coefficients(), model.laws)
    noise = Noise(np.array([bench.sensors[name].noise for name in observations.channels]),
                  np.array([*[truth.correlation] * len(recordings.signals.names), 0.0]))
    n, d = truth.points.shape
    posterior = np.tile(1e-6 * np.eye(d), (n, 1, 1))
    for _ in range(3):  # the differences span the posterior of a run, which they determine
        linear = linearise(observations, truth.points, axes(posterior), noise.std[-1])
        effects = random_effects.predicted(engagements(linear, noise, observations, np.zeros((d, 0))), truth.scatter**2)
        posterior = effects.posterior
    return effects.standard_error


def make_rows(results: Sequence[dict[str, Any]]) -> list[Row]:
    """Return the rows of each bench, by parameter and pooled, and those without a signal, pooled."""
    rows = []
    for bench in BENCHES:
        chosen = [result for result in results if result["bench"] == bench and not result["missing"]]
        names = chosen[0]["free"]
        rows += [_rate_parameters(f"{bench}: {name}", chosen, [place]) for place, name in enumerate(names)]
        rows.append(_rate_parameters(f"{bench}: all", chosen, [*range(len(names))]))
    for missing in dict.fromkeys(result["missing"] for result in results if result["missing"]):
        chosen = [result for result in results if result["missing"] == missing]
        covered, determined = (np.array([result[key] for result in chosen]) for key in ("covered", "determined"))
        for which, counted in (("determined", determined), ("not determined", ~determined)):
            names = [name for place, name in enumerate(chosen[0]["free"]) if counted[:, place].any()]
            if names:
                note = "all" if len(names) == covered.shape[1] else ", ".join(names)
                rows.append(Row(f"heavy without {missing}: {which}", len(chosen), int(counted.sum()),
                                int((counted & covered).sum()), f"{note}; {_describe_convergence(chosen)}"))
    return rows


def _rate_parameters(label: str, results: Sequence[dict[str, Any]], places: list[int]) -> Row:
    """Return the row of the parameters at some places, and how they compare with the Cramer-Rao bound."""
    covered, width, error, bound, scatter = (np.array([result[key] for result in results])[:, places]
                                             for key in ("covered", "width", "error", "bound", "scatter"))
    notes = [f"median width / Cramer-Rao {np.median(width / (2 * norm.ppf(0.5 + LEVEL / 2) * bound)):.3f}",
             f"error / Cramer-Rao: mean {(error / bound).mean():.3f}, std {(error / bound).std():.3f}",
             f"median scatter / true {np.median(scatter):.3f}"]
    if len(places) > 1:
        seconds = np.median([result["seconds"] for result in results])
        notes += [_describe_convergence(results), f"median {seconds:.1f} s"]
    return Row(label, len(results), covered.size, int(covered.sum()), "; ".join(notes))


def _describe_convergence(results: Sequence[dict[str, Any]]) -> str:
    return f"{sum(result['converged'] for result in results)} of {len(results)} converged"
