"""What the pictures of a study show beyond its result, as JSON.

    conditions   columns `current_profile`, `motor_speed`, `load_inertia`, `brake_torque`, and `run_order` or null
    effects      name -> `title`, `block`, `quantity`, `law`, `signature` and `source` of every effect that was tried
    prediction   shifting times `measured` in s; of each model its held-out `mean` and `std` in s
    law          `cloud` of plate `slip` in rad/s and `friction` in N m/Pa, measured `bins` of them, and those of each
                 `model`; or null
    where        of each model the chi-square per value that it leaves, in units of what noise would leave there, as
                 `locate.located` tells it, all by condition in the cell that is `worst` before; or null
    residual     one an added effect's `block`: the `phase` it shows in most, the `driver` it follows most there, and
                 bins of that driver with what each model leaves, in noise levels; empty without signals
    signals      experiments that the model before describes worst: `time` and `lock` in s, averages `measured` and of
                 each model, in SI units and bar; empty without signals

Bins are lists: the mean place `at`, and `low`, `median` and `high`, from a tenth below to a tenth above. A model is
`before`, without any added effect, or `after`, with all; there is no `after` where nothing is missing.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.clutch import effects
from slipstick.recordings import Recordings
from slipstick.recordings.processing import block_means
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.study import gap, locate, rounds, study
from slipstick.study.answer import BLOCKS
from slipstick.study.comparison import WIDTH, Comparison
from slipstick.study.cut import Cut, cut
from slipstick.study.mixed import MixedFit
from slipstick.study.settings import StudySettings

_CONDITION = ("current_profile", "motor_speed", "load_inertia", "brake_torque", "run_order")
_SAID = ("title", "block", "quantity", "law", "signature", "source")
_SHOWN_IN = {block: signal for signal, block in BLOCKS.items()}
"""Block of an effect -> the block of the cut that it shows in."""
_CLOUD = 1500  # points
_BINS = 40
_FEWEST = 12  # values that make a bin
_FILLED = 40  # values that a bin of a driver holds at least
_CLEAR = 5.0  # noise levels: more says no better where an effect shows
_ALIKE = 0.95  # share of the most that is explained from which on the first is good enough
_WORST = 3  # experiments whose signals are shown, each of another current profile


def evidence(settings: StudySettings, comparison: Comparison, state: study.State) -> dict[str, Any]:
    """All of it, for the state of a finished study."""
    comparison = study.observed(comparison, state)
    first, last = state["rounds"][0], state["rounds"][-1]
    ends = {"before": first, "after": last} if last["added"] else {"before": first}
    fits = {who: rounds.restore(settings, comparison, one) for who, one in ends.items()}
    cuts = {who: seen for who, found in fits.items() if (seen := cut(comparison, found, settings.seed)) is not None}
    conditions = comparison.recordings.conditions
    shown: dict[str, Any] = {
        "conditions": {name: None if (column := getattr(conditions, name)) is None else column.tolist()
                       for name in _CONDITION},
        "effects": {name: {what: getattr(effects.find(name), what) for what in _SAID}
                    for name in dict.fromkeys((*settings.catalogue, *last["added"]))},
        "prediction": {"measured": _row(comparison.recordings.measured_time),
                       **{who: _prediction(settings, comparison, found) for who, found in fits.items()}},
        "law": None, "where": None, "residual": [], "signals": [],
    }
    if cuts:
        shown |= {"law": _law(cuts), "where": _where(comparison, cuts),
                  "signals": _signals(comparison.recordings, fits["before"], cuts)}
    if "after" in cuts:
        shown["residual"] = _residual(settings, comparison, fits["after"], cuts, last["added"])
    return shown


def _prediction(settings: StudySettings, comparison: Comparison, found: MixedFit) -> dict[str, Any]:
    """Held-out shifting times, with the noise that the fit itself asks for."""
    predicted = gap.predict(comparison, found, settings.seed)
    more = comparison.noise["shifting_time"] ** 2 * (found.state.noise[-1] - 1)
    return {"mean": _row(predicted.time), "std": _row(np.sqrt(predicted.variance[:, -1] + more))}


def _law(cuts: dict[str, Cut]) -> dict[str, Any] | None:
    """The friction that torque over pressure shows, over the plates' slip, and that of the models."""
    *_, seen = cuts.values()
    slip, friction = seen.measured.slip, seen.measured.friction
    known = np.flatnonzero(np.isfinite(friction))
    if not len(known):
        return None
    some, edges = known[::-(-len(known) // _CLOUD)], np.linspace(0.0, slip.flat[known].max(), _BINS + 1)
    return {"cloud": {"slip": _row(slip.flat[some]), "friction": _row(friction.flat[some])},
            "bins": _binned(slip, friction, edges),
            "model": {who: _binned(its.modelled.slip, its.modelled.friction, edges) for who, its in cuts.items()}}


def _where(comparison: Comparison, cuts: dict[str, Cut]) -> dict[str, Any]:
    """Chi-square by block and phase, and by condition in the cell that is worst before."""
    found = {who: locate.located(comparison, seen.left) for who, seen in cuts.items()}
    worst = found["before"]["worst"]
    for who, seen in cuts.items():
        left = seen.left
        inside = left.phase == locate.PHASES.index(worst["phase"])
        cell = replace(left, residual={worst["block"]: np.where(inside, left.residual[worst["block"]], np.nan)})
        found[who]["by_condition"] = locate.located(comparison, cell)["by_condition"]
    return {"worst": worst, **{who: {name: one[name] for name in ("chi_square", "by_condition")}
                               for who, one in found.items()}}


def _residual(settings: StudySettings, comparison: Comparison, after: MixedFit, cuts: dict[str, Cut],
              added: list[str]) -> list[dict[str, Any]]:
    """What the models leave in each block that an added effect acts in, where and over what it shows most."""
    d = len(after.design.parameters)
    without = cut(comparison, replace(after, design=replace(after.design, added=()),
                                      state=replace(after.state, theta=after.state.theta[:d])), settings.seed)
    assert without is not None
    drivers, found = _drivers(comparison.recordings, without), []
    for block in dict.fromkeys(_SHOWN_IN[effects.find(name).block] for name in added):
        acting = without.left.residual[block] - cuts["after"].left.residual[block]
        # Torque that sets in at another time is off by hundreds of noise levels for an instant, whatever the effect.
        clear = np.clip(acting, -_CLEAR, _CLEAR)
        shows = {(phase, driver): _explained(values, np.where(without.left.phase == phase, clear, np.nan))
                 for driver, values in drivers.items() for phase in range(len(locate.PHASES))}
        # Where two explain about as much, as both speeds do once the plates stick, the first.
        phase, driver = next(place for place, sum_ in shows.items() if sum_ >= _ALIKE * max(shows.values()))
        left = {who: np.where(seen.left.phase == phase, seen.left.residual[block], np.nan)
                for who, seen in cuts.items()}
        edges = _edges(drivers[driver][np.isfinite(left["after"])])
        found.append({"block": block, "phase": locate.PHASES[phase], "driver": driver, "models": {
            who: _binned(drivers[driver], values, edges) for who, values in left.items()}})
    return found


def _drivers(recordings: Recordings, seen: Cut) -> dict[str, np.ndarray]:
    """What an effect may depend on, (n, k) each."""
    signals, conditions = recordings.signals, recordings.conditions
    assert signals is not None
    shape, lines = seen.measured.slip.shape, zip(conditions.profile_time, conditions.profile_current, strict=True)
    time = block_means(signals.time, WIDTH)
    current = np.array([np.interp(time, *line) for line in lines])[conditions.current_profile]
    found = {"plate slip [rad/s]": seen.measured.slip, "pressure [bar]": block_means(signals.pressure, WIDTH),
             "valve current [A]": current, "output speed [rad/s]": block_means(signals.output_speed, WIDTH),
             "input speed [rad/s]": block_means(signals.input_speed, WIDTH),
             "motor speed [rad/s]": conditions.motor_speed[:, None], "time since the shift command [s]": time}
    if recordings.run_order is not None:
        found["run order"] = recordings.run_order[:, None].astype(float)
    return {name: np.broadcast_to(values, shape) for name, values in found.items()}


def _explained(driver: np.ndarray, values: np.ndarray) -> float:
    """The sum of squares about their mean of values (n, k) that their means in bins of the driver account for."""
    known = np.isfinite(values)
    if not known.any():
        return 0.0
    x, y = driver[known], values[known] - values[known].mean()
    place = np.searchsorted(_edges(x), x, side="right")
    count, total = np.bincount(place), np.bincount(place, y)
    return float((total**2 / np.maximum(count, 1)).sum())


def _edges(driver: np.ndarray) -> np.ndarray:
    """Of bins that hold about equally many of a driver's values (m,)."""
    bins = int(np.clip(len(driver) // _FILLED, 1, _BINS))
    return np.unique(np.quantile(driver, np.linspace(0.0, 1.0, bins + 1)))


def _binned(x: np.ndarray, y: np.ndarray, edges: np.ndarray) -> dict[str, list[float | None]]:
    """Mean `at` in each bin of x, and median, tenth part below and above of y there; only of well-filled bins."""
    known = np.isfinite(y) & (x >= edges[0]) & (x <= edges[-1])
    x, y = x[known], y[known]
    place = np.searchsorted(edges[:-1], x, side="right")
    filled = [inside for number in np.unique(place) if (inside := place == number).sum() >= _FEWEST]
    low, median, high = np.array([np.quantile(y[inside], (0.1, 0.5, 0.9)) for inside in filled]).reshape(-1, 3).T
    return {"at": _row(np.array([x[inside].mean() for inside in filled])), "low": _row(low), "median": _row(median),
            "high": _row(high)}


def _signals(recordings: Recordings, before: MixedFit, cuts: dict[str, Cut]) -> list[dict[str, Any]]:
    """The experiments that the model before describes worst, averaged as they were compared."""
    signals, found = recordings.signals, []
    assert signals is not None
    squares, profile = before.about.gram[:, :, -1, -1].sum(axis=0), recordings.conditions.current_profile
    order = np.argsort(-squares, kind="stable")
    worst = sorted(np.unique(profile[order], return_index=True)[1])[:_WORST]
    ratio = before.design.base.parameters[parameters.index("gear_ratio")]
    for place in order[worst].tolist():
        who = {"measured": signals, **{who: seen.simulated for who, seen in cuts.items()}}
        found.append({
            "condition": place, "gear_ratio": ratio, "lock": float(recordings.measured_time[place]),
            "time": _row(block_means(signals.time, WIDTH)),
            **{name: {signal: _row(block_means(getattr(its, signal)[place], WIDTH)) for signal in SIGNAL_UNITS}
               for name, its in who.items()}})
    return found


def _row(values: np.ndarray) -> list[float | None]:
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
