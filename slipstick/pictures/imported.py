"""What an import understood: the signals of all experiments over each other, and one engagement beside the model."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.pictures import theme
from slipstick.pictures.engagement import Signals, panels
from slipstick.pictures.theme import Spec

CAPTIONS = {
    "engagement": "The engagement with the median shifting time as it was measured, and the nominal model of the bench "
                  "at its conditions. Before a calibration the two need not agree, but fill phase, slopes and signs "
                  "should look alike. A swapped channel, a wrong sign, unit or shift command shows here.",
    "all": "All engagements, or 40 that are evenly spread. One that differs from all others has another channel, unit "
           "or shift command. The input speed is divided by the gear ratio: after lock-up it is the output speed.",
    "runs": "All runs, or 40 that are evenly spread, with their commands. One that differs from all others has another "
            "channel, unit or begin.",
}
_MOST = 40  # experiments drawn
_SAMPLES = 150  # of each
_HEIGHT = 110


def engagement(label: str, time: Sequence[float], measured: Signals, nominal: Signals, measured_lock: float,
               nominal_lock: float | None, gear_ratio: float) -> Spec:
    """One engagement, `measured` and of the `nominal` model, with their shifting times in s."""
    locks = {"nominal": nominal_lock, "measured": measured_lock}
    says = "does not lock in the nominal model" if nominal_lock is None else \
        f"at {theme.milliseconds(nominal_lock)} in the nominal model"
    return theme.picture(f"{label} locks at {theme.milliseconds(measured_lock)}, and {says}",
                         "Shaded: slip and stick as measured. Dashed: shifting times.",
                         panels(time, {"nominal": nominal, "measured": measured}, locks, 0.0, gear_ratio))


def overlay(time: np.ndarray, signals: Mapping[str, np.ndarray], titles: Mapping[str, str], word: str,
            origin: str) -> Spec:
    """All experiments: `signals` maps names to (n, k) at `time` (k,) in s, and `titles` to what their axes say.

    An experiment is called by a `word`, and its t = 0 by `origin`.
    """
    n = len(next(iter(signals.values())))
    rows = np.unique(np.linspace(0, n - 1, min(n, _MOST)).astype(int))
    samples = slice(None, None, math.ceil(len(time) / _SAMPLES))
    # Names may have characters that mean something in the path of a field.
    fields = {name: f"v{place}" for place, name in enumerate(signals)}
    values = [{"t": theme.rounded(t), "e": int(row), **{
        fields[name]: theme.rounded(float(all_values[row, column]), 4) for name, all_values in signals.items()}}
        for row in rows for column, t in list(enumerate(time))[samples]]
    views = [{"width": theme.WIDTH, "height": _HEIGHT, "data": {"name": "samples"},
              "mark": {"type": "line", "strokeWidth": 0.8, "opacity": 0.45, "color": theme.AFTER},
              "encoding": {"x": {"field": "t", "type": "quantitative", "title": f"time since the {origin} [s]",
                                 "axis": {"grid": False}},
                           "y": {"field": fields[name], "type": "quantitative", "title": titles[name]},
                           "detail": {"field": "e", "type": "nominal"}}} for name in signals]
    return theme.picture(f"The signals of {len(rows)} {word}s", f"{len(rows)} of {n} {word}s.",
                         {"vconcat": views, "datasets": {"samples": values}})
