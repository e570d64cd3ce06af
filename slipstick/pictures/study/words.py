"""Names of models, blocks and effects in pictures and reports."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme

BLOCKS = {"pressure": "current → pressure", "output_torque": "pressure, speeds → torque",
          "output_speed": "torque → output speed", "input_speed": "torque → input speed"}
"""Block of the model, cut at the measured signals -> its inputs and output."""


def title(figure_data: Mapping[str, Any], effect: str) -> str:
    """Return the title of an effect."""
    return str(figure_data["effects"][effect]["title"])


def phrase(figure_data: Mapping[str, Any], effects: list[str]) -> str:
    """Return the titles of effects for use within a sentence."""
    names = [title(figure_data, name) for name in effects]
    return " and ".join(name[0].lower() + name[1:] for name in names)


def added_effects(result: Mapping[str, Any]) -> list[str | None]:
    """Return the effect added by each round, None for the last."""
    return [*(following["added"][-1] for following in result["rounds"][1:]), None]


def model_series(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return `before` and, if effects were added, `after` -> label and colour of that model."""
    added = result["answer"]["effects"]
    if not added:
        return {"before": ("model", theme.AFTER)}
    after = f"with {phrase(figure_data, added)}" if len(added) == 1 else f"with {len(added)} effects added"
    before = "best fit without the effect" if len(added) == 1 else "best fit without the effects"
    return {"before": (before, theme.BEFORE), "after": (after, theme.AFTER)}
