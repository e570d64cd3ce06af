"""What makes the answer of a study weaker than it sounds, and what no study of its kind can say."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.pictures.study.words import phrase
from slipstick.pictures.theme import plain
from slipstick.report.study.words import FigureData, Result, channels
from slipstick.report.words import listed, signed

Said = list[tuple[str, str]]

_MISFIT = 1.5  # times a sensor's noise: what is left is more than noise
_CONTROL = 0.5  # share of what the named effect closes from which on the control casts doubt
_ORDERED = 0.3  # correlation with the run order above which runs did not come in random order
_CLASS = ("With shifting times only, a name stands for a class:", "without signals, effects that make lock-up later or "
          "earlier in the same conditions look alike. Record pressure, torque and speeds to name one.")
_ALWAYS = (
    ("A name means best supported among those known:", "an effect that is not in the catalogue is called by the name "
     "of one that acts alike, or by none."),
    ("The piston is never measured:", "what shifts the moment of contact (pressure bias, initial position, clearance, "
     "return spring) is told apart only by how it depends on the conditions."),
    ("The gain of a pressure sensor is never named:", "gain and bias of the valve, temperature gain, initial position "
     "and friction coefficient make up for it exactly."),
    ("Wear of the plates and oil that warms up behind the piston look alike:", "both move the moment of contact with "
     "the run order."),
    ("The test counts experiments:", "each is one observation, however many samples it has. A small effect needs more "
     "experiments, not a faster clock."),
    ("An interval holds for the model with the effect in it:", "it covers noise and scatter from run to run, not a "
     "formula of another form."),
)


def caveats(result: Result, figure_data: FigureData) -> Said:
    """What is to be read beside the answer."""
    said = _misfits(result)
    if figure_data["where"] is None:
        said.append(_CLASS)
    said += [("These recordings do not tell apart:", f"{phrase(figure_data, group)}. Read the first as one of them.")
             for group in result["answer"]["tied"] if len(group) > 1]
    return said + _control(result, figure_data)


def limits(figure_data: FigureData) -> Said:
    """What no such study can say, and whether the order of these runs lets it tell a drift."""
    return [*_order(figure_data["conditions"]), *_ALWAYS]


def _misfits(result: Result) -> Said:
    """The channels in which even the last fit leaves more than noise."""
    last = result["rounds"][-1]
    found = [f"{level**2:.3g} in the {plain(name)}"
             for name, level in zip(channels(last), last["noise"], strict=True) if level > _MISFIT]
    if not found:
        return []
    added = "what was added" if result["answer"]["effects"] else "the best refit of all parameters"
    return [("Not everything is explained:", f"after {added} the reduced chi-square stays at {listed(found)}, where 1 "
             "is noise. Something else differs too: a name is then the best of the known, and its interval too "
             "narrow.")]


def _control(result: Result, figure_data: FigureData) -> Said:
    """Whether an effect that acts on something else closes as much."""
    if result["gap"] is None or result["gap"]["control"] is None:
        return []
    control = result["gap"]["control"]
    named, other = (one["closures"]["shifting_time"]["closure"] for one in (result["gap"], control))
    if named is None or other < _CONTROL * named:
        return []
    return [("The control closes much of the gap too:", f"{100 * other:.0f} % of that in the shifting time, by "
             f"{phrase(figure_data, [control['effect']])}, which acts on another quantity. That the gap shrinks does not "
             "speak for the name.")]


def _order(conditions: Mapping[str, Any]) -> Said:
    """Whether a drift can be told from a condition."""
    order = conditions["run_order"]
    if order is None:
        return [("The recordings do not say in which order they were run:", "drifts of oil temperature or wear could "
                 "not be told from anything else.")]
    follows = [f"{plain(name)} ({signed(share)})" for name, column in conditions.items()
               if name != "run_order" and abs(share := _correlation(order, column)) > _ORDERED]
    if follows:
        return [("The runs did not come in random order:", f"the run order follows {listed(follows)}, so that a drift "
                 "cannot be told from what these do. Shuffle the runs.")]
    return [("Drifts need runs in random order:", "here no condition follows the run order, so that drifts of oil "
             "temperature or wear are told from what the conditions do.")]


def _correlation(one: list[float], other: list[float]) -> float:
    return float(np.corrcoef(one, other)[0, 1]) if np.ptp(one) and np.ptp(other) else 0.0
