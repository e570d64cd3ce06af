"""Data for the figures of a fit: the likelihood around the optimum, the predictions, and one engagement."""

from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.black_box import BlackBoxDescription, Measurements
from slipstick.clutch.ensemble import signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.table.subject import Subject, columns
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.fit import Estimate, FitSettings, SearchState
from slipstick.uncertainty.fit.intervals import combinations
from slipstick.uncertainty.fit.refine import local_problem
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, Unknowns, by_expansion, lines
from slipstick.uncertainty.likelihood.likelihood import integration_lines, times_on_lines

_SURFACE = 21  # points per axis of the likelihood surface
_DENSITY = 41  # points of each density
_STDS = 4.5  # half width of the time axis of a density, in stds
_SAMPLES = 512  # samples for the moments of the predicted times
_TIME_STEP = 0.005  # s, sampling interval of the simulated engagement if the recordings have no signals


def figure_data(settings: FitSettings, problem: InferenceProblem, state: SearchState, estimate: Estimate,
                model: Subject, recordings: Recordings | Measurements) -> dict[str, Any]:
    """The data of all figures as JSON, for the final `state` of the search and the `estimate` of a fit of `model`.

    Another machine has no engagement.
    """
    space = search_space(settings, problem)
    vector = np.array(estimate["vector"])
    candidate = space.candidate(vector)
    return {"surface": surface(settings, problem, space, vector), "prediction": prediction(problem, candidate),
            "search": search(space, state, estimate),
            "engagement": None if isinstance(model, BlackBoxDescription) or isinstance(recordings, Measurements) else
            engagement(model, problem, candidate.inputs, recordings),
            "conditions": columns(recordings.conditions),
            "output": {"name": recordings.output.name, "unit": recordings.output.unit}
            if isinstance(recordings, Measurements) else None}


def search(space: Unknowns, state: SearchState, estimate: Estimate) -> dict[str, Any]:
    """The unknowns (k,) on natural scale along the search and along each profile likelihood, its trace."""
    k = len(space.names)
    return {"unknowns": list(space.names), "estimate": _row(space.to_natural(np.array(estimate["vector"]))),
            "path": [_row(space.to_natural(np.array(vector))) for vector in state["path"]],
            "traces": [_rows(np.array(interval["unknowns"])) for interval in estimate["intervals"][:k]]}


def surface(settings: FitSettings, problem: InferenceProblem, space: Unknowns,
            vector: np.ndarray) -> dict[str, Any] | None:
    """log10 likelihood by expansion (g1, g2) over the two least identified means; None for one input.

    For a model without knots, the surface covers the region in which the local expansion is valid.
    """
    d = len(space.axes)
    if d == 1:
        return None
    local, region = local_problem(problem, space, vector)
    least_identified = combinations(local, space, vector)[-1]
    pair = sorted(np.argsort(-np.abs(least_identified.weights[:d]), kind="stable")[:2].tolist())
    grids = [np.linspace(region.lower[axis], region.upper[axis], _SURFACE) for axis in pair]
    candidates = []
    for first in grids[0]:
        for second in grids[1]:
            moved = vector.copy()
            moved[pair] = first, second
            candidates.append(space.candidate(moved))
    likelihood = by_expansion(local, candidates, settings.expansion(d)).sum(axis=1)
    return {"axes": [space.axes[axis] for axis in pair], "first": grids[0].tolist(), "second": grids[1].tolist(),
            "log10_likelihood": _rows(likelihood.reshape(_SURFACE, _SURFACE))}


def prediction(problem: InferenceProblem, candidate: Candidate) -> dict[str, Any]:
    """Measured times, nominal times, and the predicted mean, std and density of the time of each condition, per ms."""
    inputs, noise, times = candidate.inputs, candidate.output_std, problem.measured_time
    normals = standard_normals(inputs.dimension, _SAMPLES, 1)
    predicted = np.ma.masked_invalid(problem.model(inputs.points(normals), problem.conditions))
    mean, std = predicted.mean(axis=0).filled(np.nan), np.hypot(predicted.std(axis=0).filled(np.nan), noise)
    low, high = np.minimum(mean - _STDS * std, times - std), np.maximum(mean + _STDS * std, times + std)
    grid = low + np.linspace(0, 1, _DENSITY)[:, None] * (high - low)
    quadrature = integration_lines(problem, candidate)
    line_times = times_on_lines(problem, inputs, quadrature)
    density = np.array([10.0 ** lines.log10_density(quadrature, line_times, row, noise) for row in grid])
    before = problem.model(np.clip(np.ones((1, inputs.dimension)), problem.lower, problem.upper), problem.conditions)[0]
    return {"condition": list(range(len(times))), "measured": times.tolist(), "before": _row(before),
            "mean": _row(mean), "std": _row(std), "density_time": _rows(grid.T), "density": _rows(density.T)}


def engagement(model: Model, problem: InferenceProblem, inputs: Inputs, recordings: Recordings) -> dict[str, Any]:
    """The engagement with the median shifting time, measured, and simulated at the fitted means."""
    condition = int(np.argsort(recordings.measured_time, kind="stable")[len(recordings) // 2])
    conditions = recordings.conditions.take([condition])
    measured = recordings.signals
    profile = conditions.current_profile[0]
    breakpoints, current = conditions.profile_time[profile], conditions.profile_current[profile]
    time = np.arange(0.0, breakpoints[-1], _TIME_STEP) if measured is None else measured.time
    means = np.clip(inputs.mean, problem.lower, problem.upper)
    response = signals(model, conditions, time, problem.axes, means[None])
    values = dict(zip(parameters.NAMES, model.parameters, strict=True))
    values.update({axis: values[axis] * mean for axis, mean in zip(problem.axes, means, strict=True)})
    position = response.piston_position[0, 0]
    touching = position > (1 - values["ramp_share"]) * values["contact_position"]
    lock = float(response.shifting_time[0, 0])
    names = (*SIGNAL_UNITS, "piston_position")
    return {"condition": condition, "time": time.tolist(),
            "touch": float(time[np.argmax(touching)]) if touching.any() else None,
            "lock": lock if np.isfinite(lock) else None,
            "current": np.interp(time, breakpoints, current).tolist(),
            "measured": None if measured is None else {name: _row(measured[name][condition])
                                                       for name in measured.names},
            "simulated": {name: _row(getattr(response, name)[0, 0]) for name in names},
            "gear_ratio": values["gear_ratio"]}


def _rows(table: np.ndarray) -> list[list[float | None]]:
    return [_row(row) for row in table]


def _row(values: np.ndarray) -> list[float | None]:
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
