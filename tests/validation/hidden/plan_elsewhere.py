"""Draws the list `elsewhere` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_elsewhere

All cases are on the bench `brisk`. Strengths of single effects are evenly spaced in the logarithm of their multiple of
the limits of limits.py: 0.5 to 30 for listed pairs, 1.5 to 30 for others, 5 to 30 over a further channel.
"""

from collections.abc import Iterator

import numpy as np

from .case import LAWS
from .fourth import FOURTH
from .limits import read as read_limits
from .nominal import BRISK
from .pairs import pair
from .plan import Row, capped, two, write

BENCH = BRISK.name
ALL = len(BRISK.profile)
NULLS = (
    *(("any", count) for count in (27, 27, 54, 54, 54, ALL, ALL)),
    ("any+batches", 54), ("any+ambient", ALL), ("any+loud_sensor", 54), ("any+many_bad_runs", 54),
    ("any+thermometer", 54),
)
LISTED_ALONE = (
    "pump_is_best_in_a_band", "valve_hangs_when_opening", "magnet_relaxes_after_small_changes",
    "magnet_pole_has_flats", "rotating_oil_fills_a_groove", "oil_is_renewed", "plates_warp_for_a_while",
    "housing_bends", "feed_is_starved_by_and_by", "bubbles_burst", "disc_spring_presses", "seal_rubs_softly",
    "friction_is_flat_then_falls", "resin_softens", "plates_dry_then_glow", "friction_needs_its_time_at_speed",
    "film_oil_is_sheared_down", "coupling_has_three_stages", "converter_turns_over_slowly",
    "load_bearing_has_a_minimum", "pressure_rises_late", "input_speed_is_averaged", "torque_rises_late",
    "pressure_zero_is_shocked", "input_speed_scale_is_curved", "torque_bridge_is_stiff_at_first",
)
COUNTS = (27,) * 4 + (54,) * 16 + (ALL,) * 6  # of the runs of these cases, in a drawn order
UNLISTED_ALONE = ("plates_are_spread_by_rotation", "film_is_thick_under_pressure",
                  "friction_fails_as_the_shaft_starts", "torque_bridge_feels_the_motor", "pilot_bearing_drags")
OVER_A_CHANNEL = ("pump_leaks_when_warm", "grease_is_stiff_when_cold")
PAIRS = 3


def elsewhere(random: np.random.Generator) -> Iterator[Row]:
    """Yield the nulls, single effects, and pairs of those effects that are not alone in a case."""
    limits = {name: limit for (name, bench), limit in read_limits().items() if bench == BENCH}
    for world, count in NULLS:
        yield BENCH, world, count, {}
    for names, least, counts in ((LISTED_ALONE, 0.5, random.permutation(COUNTS)),
                                 (UNLISTED_ALONE, 1.5, (54,) * len(UNLISTED_ALONE)),
                                 (OVER_A_CHANNEL, 5.0, (54,) * len(OVER_A_CHANNEL))):
        multiples = random.permutation(np.geomspace(least, 30, len(names)))
        for name, multiple, count in zip(names, multiples, counts, strict=True):
            yield BENCH, "any", int(count), {name: capped(LAWS[name], multiple * limits[name])}
    alone = {*LISTED_ALONE, *UNLISTED_ALONE, *OVER_A_CHANNEL}
    others = [effect for effect in FOURTH if effect.name not in alone]
    for i in range(PAIRS):
        first, second = two(others, same_block=i % 2 == 0, random=random)
        while pair(first) == pair(second):
            first, second = two(others, same_block=i % 2 == 0, random=random)
        others = [effect for effect in others if effect not in (first, second)]
        multiples = np.exp(random.uniform(np.log(2), np.log(30), 2))
        yield BENCH, "any", (54, ALL)[i % 2], {effect.name: capped(effect, multiple * limits[effect.name])
                                               for effect, multiple in zip((first, second), multiples, strict=True)}


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([22, 9])
    write("elsewhere", elsewhere(random), random, 7000)


if __name__ == "__main__":
    main()
