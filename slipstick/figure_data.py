"""What the pictures of a fit show beyond its result: the likelihood around it, its predictions, and one engagement."""

from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.clutch.ensemble import signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.intervals import combinations
from slipstick.uncertainty.fit.refine import local_problem
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns, by_expansion, lines
from slipstick.uncertainty.likelihood.likelihood import integration_lines, times_on_lines

_CONDITION = ("current_profile", "motor_speed", "load_inertia", "brake_torque")
_SURFACE = 21  # points an axis
_DENSITY = 41  # points of each density
_STDS = 4.5  # on either side of the mean
_SAMPLES = 512
_CLOCK = 0.005  # s between the samples of the engagement


def figure_data(settings: FitSettings, problem: InferenceProblem, found: list[float], model: Model,
             recordings: Recordings) -> dict[str, Any]:
    """All of it as JSON for the vector of unknowns `found` (k,) of a fit of `model`."""
    space = search_space(settings, problem)
    vector = np.array(found)
    candidate = space.candidate(vector)
    return {"surface": surface(settings, problem, space, vector), "prediction": prediction(problem, candidate),
            "engagement": engagement(model, problem, candidate.inputs, recordings),
            "conditions": {name: getattr(recordings.conditions, name).tolist() for name in _CONDITION}}


def surface(settings: FitSettings, problem: InferenceProblem, space: Unknowns, vector: np.ndarray) -> dict[str, Any] | None:
    """log10 likelihood by expansion (g1, g2) over the two means that are hardest to tell apart; None for one input.

    Of a model without knots it goes as far as the polynomials about the fit hold.
    """
    d = len(space.axes)
    if d == 1:
        return None
    near, region = local_problem(problem, space, vector)
    open_most = combinations(near, space, vector)[-1]
    pair = sorted(np.argsort(-np.abs(open_most.weights[:d]), kind="stable")[:2].tolist())
    grids = [np.linspace(region.lower[axis], region.upper[axis], _SURFACE) for axis in pair]
    candidates = []
    for first in grids[0]:
        for second in grids[1]:
            moved = vector.copy()
            moved[pair] = first, second
            candidates.append(space.candidate(moved))
    likelihood = by_expansion(near, candidates, settings.expansion(d)).sum(axis=1)
    return {"axes": [space.axes[axis] for axis in pair], "first": grids[0].tolist(), "second": grids[1].tolist(),
            "log10_likelihood": _rows(likelihood.reshape(_SURFACE, _SURFACE))}


def prediction(problem: InferenceProblem, candidate: Candidate) -> dict[str, Any]:
    """Measured times, those of the nominal model, and the predicted density of each condition, per ms."""
    inputs, noise, times = candidate.inputs, candidate.output_std, problem.measured_time
    normals = standard_normals(inputs.dimension, _SAMPLES, 1)
    sampled = np.ma.masked_invalid(problem.model(inputs.points(normals), problem.conditions))
    mean, std = sampled.mean(axis=0).filled(np.nan), np.hypot(sampled.std(axis=0).filled(np.nan), noise)
    low, high = np.minimum(mean - _STDS * std, times - std), np.maximum(mean + _STDS * std, times + std)
    grid = low + np.linspace(0, 1, _DENSITY)[:, None] * (high - low)
    quadrature = integration_lines(problem, candidate)
    at_lines = times_on_lines(problem, inputs, quadrature)
    density = np.array([10.0 ** lines.log10_density(quadrature, at_lines, row, noise) for row in grid])
    before = problem.model(np.clip(np.ones((1, inputs.dimension)), problem.lower, problem.upper), problem.conditions)[0]
    return {"condition": list(range(len(times))), "measured": times.tolist(), "before": _row(before),
            "mean": _row(mean), "std": _row(std), "density_time": _rows(grid.T), "density": _rows(density.T)}


def engagement(model: Model, problem: InferenceProblem, inputs: Inputs, recordings: Recordings) -> dict[str, Any]:
    """The engagement whose shifting time is the median one, measured and simulated at the fitted means."""
    condition = int(np.argsort(recordings.measured_time, kind="stable")[len(recordings) // 2])
    conditions = recordings.conditions.take([condition])
    measured = recordings.signals
    profile = conditions.current_profile[0]
    breakpoints, current = conditions.profile_time[profile], conditions.profile_current[profile]
    time = np.arange(0.0, breakpoints[-1], _CLOCK) if measured is None else measured.time
    means = np.clip(inputs.mean, problem.lower, problem.upper)
    response = signals(model, conditions, time, problem.axes, means[None])
    where = dict(zip(parameters.NAMES, model.parameters, strict=True))
    where.update({axis: where[axis] * mean for axis, mean in zip(problem.axes, means, strict=True)})
    position = response.piston_position[0, 0]
    touching = position > (1 - where["ramp_share"]) * where["contact_position"]
    lock = float(response.shifting_time[0, 0])
    names = (*SIGNAL_UNITS, "piston_position")
    return {"condition": condition, "time": time.tolist(),
            "touch": float(time[np.argmax(touching)]) if touching.any() else None,
            "lock": lock if np.isfinite(lock) else None,
            "current": np.interp(time, breakpoints, current).tolist(),
            "measured": None if measured is None else {name: _row(getattr(measured, name)[condition])
                                                       for name in SIGNAL_UNITS},
            "simulated": {name: _row(getattr(response, name)[0, 0]) for name in names},
            "gear_ratio": where["gear_ratio"]}


def _rows(table: np.ndarray) -> list[list[float | None]]:
    return [_row(row) for row in table]


def _row(values: np.ndarray) -> list[float | None]:
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
