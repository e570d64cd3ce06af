"""Experiments that would distinguish tied effects, in sentences and numbers."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures.study.words import phrase
from slipstick.pictures.theme import in_words

HEAD = ("current profile", "motor speed [rad/s]", "load inertia [kg m²]", "brake torque [N m]", "recorded",
        "separation [noise levels]", "largest in", "runs")
NOTE = ("Separation: RMS difference over all compared values between the predictions with the first effect and with "
        "the effect nearest to it, after refitting the run-to-run scatter. Runs: expected number of repetitions until "
        "the correct effect leads by five standard errors, with all parameters refitted. Levels extend up to a fifth "
        "beyond the recorded range.")


def lead(tie: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    """Return the sentence above the table of a tie (an entry of `further`)."""
    effects = phrase(figure_data, tie["effects"])
    if not tie["experiments"]:
        return f"There is no condition near the recorded ones under which the models with {effects} all lock up."
    if all(experiment["repetitions"] is None for experiment in tie["experiments"]):
        return f"No experiment near the recorded conditions would distinguish {effects}. The best ones are:"
    return f"To distinguish {effects}, run:"


def rows(tie: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield one row per experiment, the best first."""
    for experiment in tie["experiments"]:
        yield (str(experiment["current_profile"]),
               *(f"{experiment[name]:.4g}" for name in ("motor_speed", "load_inertia", "brake_torque")),
               "yes" if experiment["recorded"] else "no", f"{experiment['apart']:.2g}", in_words(experiment["signal"]),
               "more than 1000" if experiment["repetitions"] is None else str(experiment["repetitions"]))
