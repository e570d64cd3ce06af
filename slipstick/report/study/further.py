"""The experiments that would tell the effects of a tie apart, in sentences and numbers."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures.study.words import phrase
from slipstick.pictures.theme import plain

HEAD = ("current profile", "motor speed [rad/s]", "load inertia [kg m²]", "brake torque [N m]", "recorded",
        "apart [noise levels]", "seen most in", "runs")
NOTE = ("Apart: how far the first of them and the one nearest to it predict apart, RMS over all compared values, after "
        "a refit of what scatters from run to run. Runs: how often to repeat the experiment until the right one is "
        "ahead by five standard errors, with all else refitted. Levels go up to a fifth beyond the recorded range.")


def lead(one: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    """What the table under it is for, of an entry of `further`."""
    tied = phrase(figure_data, one["effects"])
    if not one["experiments"]:
        return f"Models with {tied} lock up under no common condition near these."
    if all(each["repetitions"] is None for each in one["experiments"]):
        return f"No experiment near these would tell {tied} apart. The best there are:"
    return f"To tell {tied} apart, run:"


def rows(one: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """An experiment each, the best first."""
    for each in one["experiments"]:
        yield (str(each["current_profile"]), *(f"{each[name]:.4g}" for name in
                                               ("motor_speed", "load_inertia", "brake_torque")),
               "yes" if each["recorded"] else "no", f"{each['apart']:.2g}", plain(each["signal"]),
               "more than 1000" if each["repetitions"] is None else str(each["repetitions"]))
