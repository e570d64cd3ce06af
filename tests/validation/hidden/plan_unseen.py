"""Draws the list `unseen` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_unseen

Strengths of single effects are 0.5 to 30 times the limits of limits.py, evenly in the logarithm.
"""

from collections.abc import Iterator

import numpy as np

from .case import LAWS
from .limits import read as read_limits
from .pairs import pair
from .plan import BENCHES, MANY, Row, capped, two, write
from .third import THIRD

NULLS = (
    ("heavy", "any", 54), ("heavy", "any", 108), ("compact", "any", 27), ("compact", "any", 90),
    ("heavy", "noise+converter+conditions+sag+clocks", 54), ("heavy", "any+batches", 54),
    ("compact", "any+ambient", 72), ("compact", "any+loud_sensor", 54), ("compact", "any+many_bad_runs", 54),
    ("heavy", "any+thermometer", 54),
)
LISTED_ALONE = (  # on the benches in turn
    "pump_resonates", "valve_holds_on_release", "valve_land_leaks", "centrifugal_oil_spills",
    "oil_warms_in_two_sessions", "plates_are_exchanged", "plates_settle_in_two_stages", "bubbles_collapse",
    "feed_chokes", "return_springs_catch", "friction_falls_in_two_steps", "seal_breaks_loose",
    "friction_rises_from_a_knee", "lining_compresses", "moisture_boils_off", "fade_recovers_in_part",
    "friction_builds_up_when_pressed_lightly", "splines_have_backlash", "converter_fills_slowly",
    "load_drag_has_a_peak", "torque_falls_late", "pressure_falls_late", "input_speed_zero_settles",
    "torque_bridge_changes_its_range",
)
UNLISTED_ALONE = ("spool_moves_in_jumps", "piston_passes_a_port", "plates_judder", "shaft_twists_to_and_fro",
                  "load_winds_up", "motor_torque_ripples")
OVER_A_CHANNEL = ("piston_gain_follows_the_oil", "friction_fades_in_warm_oil")
PAIRS = 6


def unseen(random: np.random.Generator) -> Iterator[Row]:
    """Yield the nulls, single effects, and pairs of those effects that are not alone in a case."""
    limits = read_limits()
    for bench, world, count in NULLS:
        yield bench, world, count, {}
    counts = random.permutation([27] * 3 + [54] * 11 + [72] * 5 + [0] * 5)
    multiples = random.permutation(np.geomspace(0.5, 30, len(LISTED_ALONE)))
    for i, name in enumerate(LISTED_ALONE):
        bench = BENCHES[i % 2]
        strength = capped(LAWS[name], multiples[i] * limits[name, bench])
        yield bench, "any", int(counts[i]) or MANY[bench], {name: strength}
    for names, least in ((UNLISTED_ALONE, 1.5), (OVER_A_CHANNEL, 5.0)):
        multiples = random.permutation(np.geomspace(least, 30, len(names)))
        for i, name in enumerate(names):
            bench = BENCHES[i % 2]
            yield bench, "any", 54, {name: capped(LAWS[name], multiples[i] * limits[name, bench])}
    alone = {*LISTED_ALONE, *UNLISTED_ALONE, *OVER_A_CHANNEL}
    others = [effect for effect in THIRD if effect.name not in alone]
    for i in range(PAIRS):
        bench = BENCHES[i // 3]
        first, second = two(others, same_block=i % 2 == 0, random=random)
        while pair(first) == pair(second):
            first, second = two(others, same_block=i % 2 == 0, random=random)
        others = [effect for effect in others if effect not in (first, second)]
        multiples = np.exp(random.uniform(np.log(2), np.log(30), 2))
        yield bench, "any", (54, 72)[i % 2], {effect.name: capped(effect, multiple * limits[effect.name, bench])
                                              for effect, multiple in zip((first, second), multiples, strict=True)}


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([21, 6])
    write("unseen", unseen(random), random, 6000)


if __name__ == "__main__":
    main()
