"""What a study of this method can and cannot tell, in general."""

from collections.abc import Mapping

import numpy as np

from slipstick.pictures.theme import in_words
from slipstick.report.study.parts import Entries
from slipstick.report.words import listed, signed

_ORDERED, _CHANCE = 0.3, 2.6
"""Correlation with the run order above which a drift is hard to tell from a condition, and the standard normal deviate
that one random order in a hundred exceeds: of 24 runs in random order, 15 % have such a correlation."""
_ALWAYS: Entries = [
    ("A name is a pair and a shape:", "the blocks measure which quantity changes with what. The catalogue gives the "
     "name if it has an effect of that pair whose law has that shape. Another cause with the same pair and shape would "
     "get the same name, and a pair for which no block tests a law cannot be found."),
    ("Errors that compensate:", "a gain error of the pressure sensor is taken up by the valve's gain, the friction "
     "coefficient, the pressure bias and the piston, which are calibrated. A lag of the friction and a lag of the "
     "torque sensor differ only in the blocks that the torque drives, and are often tied."),
    ("The piston position is not measured:", "what happens while the plates close is inferred from the torque. Weak "
     "laws of the piston rate are missed, those over rate, pressure and position are not always told apart, and their "
     "intervals are those of a linear model. A weak law of the piston is missed beside a strong one of full contact."),
    ("A second cause may be missed:", "of two effects on simulated benches that leave residuals as large as the noise, "
     "both were reported in 1 of 19 recordings. Signs of a second one are findings that are too uncertain to be "
     "reported, and blocks that are not explained."),
    ("Effects outside the catalogue:", "on simulated benches, 5 of 39 of them were given the name of an effect that "
     "resembles them. The measured law is that of the named pair."),
    ("“Nothing” has a limit:", "what is missing by less than about a fifth of the noise variance in a block is not "
     "reported as unexplained, and a pair that gains less than the settings require is not named."),
    ("Parameters are trusted near their nominal values:", "one that is not calibrated may be off by 3 %, stated "
     "conditions by 2 %, and the torque of the converter by 5 %. A larger error of one of them may appear as a "
     "finding."),
    ("Engagements are counted, not samples:", "each engagement is one observation. A small effect needs more "
     "engagements, not a higher sampling rate."),
    ("Intervals are conditional on the name:", "they cover noise and scatter from run to run, but not an error in the "
     "formula, nor that the same recordings selected the name."),
]


def limits(conditions: Mapping[str, list[float] | None]) -> Entries:
    """The limitations, the first about the order of these runs."""
    return [*_order(conditions), *_ALWAYS]


def _order(conditions: Mapping[str, list[float] | None]) -> Entries:
    """Whether the run order tells a drift from the conditions."""
    order = conditions["run_order"]
    if order is None:
        return [("The recordings have no run order:", "drifts of oil temperature or wear cannot be detected.")]
    correlated = [f"{in_words(name)} (correlation {signed(value)})" for name, column in conditions.items()
                  if name != "run_order" and column and (value := _correlate(order, column))]
    if correlated:
        return [("The runs are not in random order:", f"the run order follows {listed(correlated)}, so that a drift "
                 "cannot be distinguished from an effect of the conditions. Randomise the run order.")]
    return [("No condition follows the run order:", "drifts of oil temperature or wear can therefore be "
             "distinguished from effects of the conditions.")]


def _correlate(order: list[float], column: list[float]) -> float:
    """The correlation of a condition with the run order, or 0 if it is small or may be chance (Fisher's transform)."""
    if not (np.ptp(order) and np.ptp(column)):
        return 0.0
    value = float(np.clip(np.corrcoef(order, column)[0, 1], -0.9999, 0.9999))
    deviate = np.arctanh(abs(value)) * np.sqrt(max(len(order) - 3, 0))
    return value if abs(value) > _ORDERED and deviate > _CHANCE else 0.0
