"""Caveats of the answer of a study, and general limitations of such studies."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.pictures.study.words import phrase
from slipstick.pictures.theme import in_words
from slipstick.report.study.words import FigureData, Result, channels
from slipstick.report.words import listed, signed

Items = list[tuple[str, str]]
"""Bold lead-in and text."""

_MISFIT = 1.5  # multiples of the sensor noise above which residuals are more than noise
_CONTROL = 0.5  # share of the closure by the named effect above which the control casts doubt on it
_ORDERED = 0.3  # correlation with the run order above which the order is not random
_CLASS = ("With shifting times only, a name stands for a class of effects:", "without signals, effects that delay or "
          "advance lock-up under the same conditions cannot be distinguished. Record pressure, torque and speeds to "
          "identify one.")
_ALWAYS = (
    ("The named effect is the best supported of the catalogue:", "an effect outside the catalogue is reported under "
     "the name of a similar one, or not at all."),
    ("The piston position is not measured:", "causes that shift the moment of contact (pressure bias, initial "
     "position, clearance, return spring) differ only in how they depend on the conditions."),
    ("The gain error of a pressure sensor is never named:", "gain and bias of the valve, temperature gain, initial "
     "position and friction coefficient compensate for it exactly."),
    ("Wear of the plates and warming of the oil behind the piston are similar:", "both shift the moment of contact "
     "with the run order."),
    ("The test counts experiments:", "each experiment is one observation, regardless of its number of samples. "
     "Detecting a small effect requires more experiments, not a higher sampling rate."),
    ("The intervals are conditional on the form of the effect:", "they cover noise and run-to-run scatter, but not "
     "an error in the formula."),
)


def caveats(result: Result, figure_data: FigureData) -> Items:
    """Return the caveats of this answer."""
    items = _misfits(result)
    if figure_data["where"] is None:
        items.append(_CLASS)
    items += [("These recordings do not distinguish:",
               f"{phrase(figure_data, group)}. Any of them may be the missing effect.")
              for group in result["answer"]["tied"] if len(group) > 1]
    return items + _control(result, figure_data)


def limits(figure_data: FigureData) -> Items:
    """Return the general limitations, and whether drifts can be detected with this run order."""
    return [*_order(figure_data["conditions"]), *_ALWAYS]


def _misfits(result: Result) -> Items:
    """Return the channels in which the residuals of the last fit exceed the noise."""
    last = result["rounds"][-1]
    misfits = [f"{level**2:.3g} in the {in_words(name)}"
               for name, level in zip(channels(last), last["noise"], strict=True) if level > _MISFIT]
    if not misfits:
        return []
    lead, squares = "Part of the misfit is unexplained:", listed(misfits)
    if not result["answer"]["effects"]:
        return [(lead, f"after refitting all parameters, the reduced chi-square is {squares}; 1 corresponds to noise.")]
    return [(lead, f"with all added effects, the reduced chi-square is {squares}; 1 corresponds to noise. The named "
             "effect is therefore only the best of the known ones, and its intervals are too narrow.")]


def _control(result: Result, figure_data: FigureData) -> Items:
    """Return a caveat if an effect on another quantity closes a similar share of the gap."""
    if result["gap"] is None or result["gap"]["control"] is None:
        return []
    control = result["gap"]["control"]
    named, other = (gap["closures"]["shifting_time"]["closure"] for gap in (result["gap"], control))
    if named is None or other < _CONTROL * named:
        return []
    return [("The control also closes much of the gap:", f"{phrase(figure_data, [control['effect']])}, which acts on "
             f"another quantity, closes {100 * other:.0f} % of the gap in the shifting time. The reduction of the gap "
             "therefore does not support the named effect.")]


def _order(conditions: Mapping[str, Any]) -> Items:
    """Return whether the run order allows a drift to be distinguished from the conditions."""
    order = conditions["run_order"]
    if order is None:
        return [("The recordings have no run order:", "drifts of oil temperature or wear cannot be detected.")]
    correlated = [f"{in_words(name)} (correlation {signed(value)})" for name, column in conditions.items()
                  if name != "run_order" and abs(value := _correlation(order, column)) > _ORDERED]
    if correlated:
        return [("The runs are not in random order:", f"the run order follows {listed(correlated)}, so a drift "
                 "cannot be distinguished from an effect of the conditions. Randomise the run order.")]
    return [("No condition follows the run order:", "drifts of oil temperature or wear can therefore be distinguished "
             "from effects of the conditions.")]


def _correlation(x: list[float], y: list[float]) -> float:
    return float(np.corrcoef(x, y)[0, 1]) if np.ptp(x) and np.ptp(y) else 0.0
