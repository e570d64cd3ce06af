"""Residuals of the shifting times, grouped by current profile and motor speed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import scipy

from slipstick.pictures import theme
from slipstick.pictures.conditions import described
from slipstick.pictures.theme import Spec

CAPTION = ("Measured minus predicted mean shifting time, one panel for each current profile, with its motor speeds "
           "side by side. Dots: engagements. Bars: mean of each group with its 90 % interval, from the predicted "
           "scatter. Where the model is right, nine bars in ten contain zero. Means that follow the speed or the "
           "profile are what the model lacks: scatter of the inputs cannot cause them.")

_LEVEL = 0.9
_CHANCE = 0.01
_HEIGHT = 170
_COLUMNS = 3
_WIDTH = 196
_MEAN, _OFF, _ENGAGEMENT = "mean, interval contains zero", "mean, interval does not contain zero", "engagement"


@dataclass(frozen=True)
class _Group:
    """Engagements of one current profile and motor speed: residuals in ms, and predicted std of their mean in ms."""

    profile: float
    speed: float
    places: list[int]
    residuals: list[float]
    error: float

    @property
    def mean(self) -> float:
        return sum(self.residuals) / len(self.residuals)

    @property
    def half(self) -> float:
        """Half width of the interval of the mean in ms."""
        return float(scipy.special.ndtri((1 + _LEVEL) / 2)) * self.error

    @property
    def is_off(self) -> bool:
        """Whether the interval of the mean does not contain zero."""
        return abs(self.mean) > self.half


def groups_off(data: Mapping[str, Any]) -> tuple[int, int, bool]:
    """How many groups have a mean other than zero, of how many, and whether chance gives so many once in 100 cases."""
    groups = _groups(data["prediction"], data["conditions"])
    off = sum(group.is_off for group in groups)
    return off, len(groups), bool(scipy.special.bdtrc(off - 1, len(groups), 1 - _LEVEL) < _CHANCE)


def draw(output: Mapping[str, Any]) -> Spec | None:
    """Return a panel for each current profile; None without predictions, and for another machine."""
    data = output["figure_data"]
    groups = _groups(data["prediction"], data["conditions"])
    if not groups:
        return None
    off = sum(group.is_off for group in groups)
    worst = max(groups, key=lambda group: abs(group.mean) / max(group.error, 1e-9))
    panels = [_panel(profile, [group for group in groups if group.profile == profile], data["conditions"], place)
              for place, profile in enumerate(sorted({group.profile for group in groups}))]
    omitted = sum(mean is None for mean in data["prediction"]["mean"])
    return theme.picture(
        f"The mean residual differs from zero in {off} of {len(groups)} groups of profile and motor speed; "
        f"{(1 - _LEVEL) * len(groups):.1f} are expected",
        f"The furthest is {worst.mean:+.1f} ms, {abs(worst.mean) / max(worst.error, 1e-9):.1f} standard errors, at "
        f"profile {worst.profile:.0f} and {worst.speed:.0f} rad/s.".replace("-", "−")
        + (f" Not drawn: {omitted} that may never lock." if omitted else ""),
        {"columns": _COLUMNS, "spacing": {"row": 26, "column": 30}, "concat": panels,
         "resolve": {"scale": {"y": "shared"}}})


def _groups(prediction: Mapping[str, Any], conditions: Mapping[str, Any]) -> list[_Group]:
    if "motor_speed" not in conditions:  # of another machine
        return []
    places: dict[tuple[float, float], list[int]] = {}
    for place, mean in enumerate(prediction["mean"]):
        if mean is not None:
            key = (conditions["current_profile"][place], conditions["motor_speed"][place])
            places.setdefault(key, []).append(place)
    return [_Group(*key, members,
                   [1e3 * (prediction["measured"][place] - prediction["mean"][place]) for place in members],
                   1e3 * math.sqrt(sum(prediction["std"][place] ** 2 for place in members)) / len(members))
            for key, members in sorted(places.items())]


def _panel(profile: float, groups: list[_Group], conditions: Mapping[str, Any], place: int) -> Spec:
    x: Spec = {"field": "speed", "type": "ordinal", "title": "motor speed [rad/s]",
               "axis": {"labelAngle": 0, "grid": False}}
    y: Spec = {"field": "y", "type": "quantitative", "axis": {"tickCount": 5},
               "title": "measured − predicted [ms]" if place % _COLUMNS == 0 else None}
    colour = {**theme.series_colour({_ENGAGEMENT: theme.FAINT, _MEAN: theme.AFTER, _OFF: theme.ALARM}),
              "field": "series"}
    dots = [{"speed": round(group.speed), "y": theme.rounded(residual, 4), "series": _ENGAGEMENT,
             "conditions": described(conditions, index), "engagement": index}
            for group in groups for index, residual in zip(group.places, group.residuals, strict=True)]
    means = [{"speed": round(group.speed), "y": theme.rounded(group.mean, 4),
              "low": theme.rounded(group.mean - group.half, 4), "high": theme.rounded(group.mean + group.half, 4),
              "series": _OFF if group.is_off else _MEAN, "engagements": len(group.places)}
             for group in groups]
    return {"width": _WIDTH, "height": _HEIGHT,
            "title": {"text": f"profile {profile:.0f}", "fontSize": 12, "fontWeight": "normal", "offset": 4},
            "layer": [
                {"data": {"values": [{}]}, "mark": {"type": "rule", "color": theme.FAINT},
                 "encoding": {"y": {"datum": 0}}},
                {"data": {"values": dots}, "mark": {"type": "point", "filled": True, "size": 12, "opacity": 0.6,
                                                    "xOffset": -7},
                 "encoding": {"x": x, "y": y, "color": colour, "tooltip": [
                     {"field": "engagement", "type": "quantitative"}, {"field": "conditions", "type": "nominal"}]}},
                {"data": {"values": means}, "mark": {"type": "rule", "strokeWidth": 2.5, "xOffset": 6},
                 "encoding": {"x": x, "y": {**y, "field": "low"}, "y2": {"field": "high"}, "color": colour}},
                {"data": {"values": means}, "mark": {"type": "point", "filled": True, "size": 50, "opacity": 1,
                                                     "xOffset": 6},
                 "encoding": {"x": x, "y": y, "color": colour, "tooltip": [
                     {"field": "y", "type": "quantitative", "title": "mean [ms]"},
                     {"field": "engagements", "type": "quantitative"}]}}]}
