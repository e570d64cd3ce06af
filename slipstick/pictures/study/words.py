"""Names as a reader of the pictures meets them: of the models, the blocks, and the effects."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures import theme

BLOCKS = {"pressure": "current → pressure", "output_torque": "pressure, speeds → torque",
          "output_speed": "torque → output speed", "input_speed": "torque → input speed"}
"""Each block of the model, cut at the signals, by what goes in and what comes out."""


def title(figure_data: Mapping[str, Any], effect: str) -> str:
    """An effect in words."""
    return str(figure_data["effects"][effect]["title"])


def phrase(figure_data: Mapping[str, Any], effects: list[str]) -> str:
    """Effects as they stand inside a sentence."""
    names = [title(figure_data, name) for name in effects]
    return " and ".join(name[0].lower() + name[1:] for name in names)


def chosen(result: Mapping[str, Any]) -> list[str | None]:
    """The effect that each round added; None where it added none."""
    rounds = result["rounds"]
    return [*(after["added"][-1] for after in rounds[1:]), None]


def models(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """`before` and, where there is one, `after` -> what each is called and its colour."""
    added = result["answer"]["effects"]
    if not added:
        return {"before": ("the model", theme.AFTER)}
    after = f"with {phrase(figure_data, added)}" if len(added) == 1 else f"with {len(added)} effects added"
    return {"before": ("best fit without it" if len(added) == 1 else "best fit without them", theme.BEFORE),
            "after": (after, theme.AFTER)}
