"""What the pictures of a study show beyond its result, as typed values."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from slipstick.bench import Conditions
from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.gap import Prediction
from slipstick.recordings import Recordings
from slipstick.recordings.processing import block_means

_CONDITIONS = ("current_profile", "motor_speed", "load_inertia", "brake_torque", "run_order")
_WIDTH = 8
"""Samples averaged to a point of a curve: 16 ms at 500 Hz, finer than a picture resolves."""
_WORST = 3
"""Engagements whose signals are shown, each of another current profile."""


@dataclass(frozen=True)
class Times:
    """Held-out shifting times in s: `mean` and `std` of each engagement."""

    mean: list[float]
    std: list[float]


@dataclass(frozen=True)
class Engagement:
    """Signals of an engagement: averages of what was `measured`, and of each of the `models`, at `time` in s.

    `condition` is its place among the engagements that count, `lock` its measured shifting time in s.
    """

    condition: int
    gear_ratio: float
    lock: float
    time: list[float]
    measured: dict[str, list[float]]
    models: dict[str, dict[str, list[float]]]


@dataclass(frozen=True)
class Figures:
    """Data of pictures. Models are `before` and, where something was added, `after`.

    `conditions` has the columns of the conditions of the engagements that count (run order may be None), `measured`
    their shifting times in s, `predicted` those of each model on held-out conditions, and `engagements` those that the
    model before describes worst, simulated with the parameters that each fit estimates for that engagement. `aside` has
    the conditions of the engagements that were set aside.
    """

    conditions: dict[str, list[float] | None]
    measured: list[float]
    predicted: dict[str, Times]
    engagements: list[Engagement]
    aside: dict[str, list[float] | None] = field(default_factory=dict)


def figures(before: SimulationFit, after: SimulationFit | None, predictions: dict[str, Prediction],
            aside: Conditions) -> Figures:
    """All of it, from the fits and their held-out predictions, and the conditions of what was set `aside`."""
    scene = before.block.scene
    predicted = {who: Times(rounded(prediction.time), rounded(np.sqrt(prediction.variance[:, -1])))
                 for who, prediction in predictions.items()}
    models = {"before": before} | ({} if after is None else {"after": after})
    return Figures(_columns(scene.recordings.conditions), rounded(scene.recordings.measured_time), predicted,
                   _engagements(models), _columns(aside))


def figures_without_fits(recordings: Recordings, aside: Conditions) -> Figures:
    """What there is without the simulation: conditions and shifting times of the `recordings` that count."""
    return Figures(_columns(recordings.conditions), rounded(recordings.measured_time), {}, [], _columns(aside))


def _columns(conditions: Conditions) -> dict[str, list[float] | None]:
    return {name: None if (column := getattr(conditions, name)) is None else rounded(column) for name in _CONDITIONS}


def _engagements(models: dict[str, SimulationFit]) -> list[Engagement]:
    block, fitted = models["before"].block, models["before"].fitted
    scene = block.scene
    if not block.traces.signals:
        return []
    left = (block.measured - fitted.predicted) * block.counted
    order = np.argsort(-(left**2).sum(axis=1), kind="stable")
    profiles = scene.recordings.conditions.current_profile[order]
    worst = order[sorted(np.unique(profiles, return_index=True)[1])[:_WORST]]
    simulated = {who: fit.block.respond(fit.fitted.points, fit.fitted.shared) for who, fit in models.items()}

    def curves(source: object, place: int) -> dict[str, list[float]]:
        return {name: rounded(block_means(np.asarray(getattr(source, name))[place], _WIDTH))
                for name in block.traces.signals}

    return [Engagement(int(place), scene.gear, float(scene.recordings.measured_time[place]),
                       rounded(block_means(scene.time, _WIDTH)), curves(scene.signals, place),
                       {who: curves(response, place) for who, response in simulated.items()}) for place in worst]


def rounded(values: Sequence[float] | np.ndarray) -> list[float]:
    """Return values with as many digits as a picture needs, and 0 for undefined ones."""
    return [float(f"{value:.6g}") for value in np.nan_to_num(values)]
