"""What an import understood: the signals of all engagements over each other, and one engagement beside the model."""

import math
from collections.abc import Sequence

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
}
_MOST = 40  # engagements drawn
_SAMPLES = 150  # of each
_HEIGHTS = {"pressure": 110, "input_speed": 110, "output_speed": 110, "output_torque": 110}


def engagement(label: str, time: Sequence[float], measured: Signals, nominal: Signals, measured_lock: float,
               nominal_lock: float | None, gear_ratio: float) -> Spec:
    """One engagement, `measured` and of the `nominal` model, with their shifting times in s."""
    locks = {"nominal": nominal_lock, "measured": measured_lock}
    says = "does not lock in the nominal model" if nominal_lock is None else \
        f"at {theme.milliseconds(nominal_lock)} in the nominal model"
    return theme.picture(f"{label} locks at {theme.milliseconds(measured_lock)}, and {says}",
                         "Shaded: slip and stick as measured. Dashed: shifting times.",
                         panels(time, {"nominal": nominal, "measured": measured}, locks, 0.0, gear_ratio))


def overlay(time: np.ndarray, signals: dict[str, np.ndarray], units: dict[str, str], gear_ratio: float) -> Spec:
    """All engagements: `signals` maps names to (n, k) at `time` (k,) in s."""
    n = len(next(iter(signals.values())))
    rows = np.unique(np.linspace(0, n - 1, min(n, _MOST)).astype(int))
    samples = slice(None, None, math.ceil(len(time) / _SAMPLES))
    values = [{"t": theme.rounded(t), "e": int(row), **{
        name: theme.rounded(float(all_values[row, column]) / (gear_ratio if name == "input_speed" else 1.0), 4)
        for name, all_values in signals.items()}}
        for row in rows for column, t in list(enumerate(time))[samples]]
    views = [{"width": theme.WIDTH, "height": _HEIGHTS[name], "data": {"name": "samples"},
              "mark": {"type": "line", "strokeWidth": 0.8, "opacity": 0.45, "color": theme.AFTER},
              "encoding": {"x": {"field": "t", "type": "quantitative", "title": "time since the shift command [s]",
                                 "axis": {"grid": False}},
                           "y": {"field": name, "type": "quantitative",
                                 "title": f"{theme.in_words(name)}{' ÷ gear ratio' if name == 'input_speed' else ''} "
                                          f"[{units[name]}]"},
                           "detail": {"field": "e", "type": "nominal"}}} for name in signals]
    return theme.picture(f"The signals of {len(rows)} engagements", f"{len(rows)} of {n} engagements.",
                         {"vconcat": views, "datasets": {"samples": values}})
