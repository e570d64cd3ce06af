"""What a study found, in sentences and numbers: plain text, which the page then marks up."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures.study.words import BLOCKS, phrase, title
from slipstick.pictures.theme import plain
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.words import listed, signed

Result = Mapping[str, Any]
FigureData = Mapping[str, Any]

_CHANNELS = {name: (unit, 1.0) for name, unit in SIGNAL_UNITS.items()} | {"shifting_time": ("ms", 1e3)}
"""Each compared channel -> the unit it is told in, and that over the unit of the result."""
_UNITS = {"current_profile": "", "motor_speed": " rad/s", "load_inertia": " kg m²", "brake_torque": " N m"}
_DECADE = 2.302585  # natural units of log-likelihood
_CHANCE = 0.05  # p-value beyond which nothing is asked for
_LEAST_P = 1e-3  # that replicates can show


def lead(result: Result, figure_data: FigureData) -> str:
    """How sure the answer is, and what it is worth, in two or three sentences."""
    first, n, added = result["rounds"][0], result["experiments"], result["answer"]["effects"]
    if result["answer"]["kind"] == "not converged":
        return "The fit without any effect did not come to an end, so that nothing can be read from what it leaves."
    if not added and result["answer"]["kind"] == "unlisted":
        return (f"Something is left unexplained ({_p(first['p_value'])}), and every effect of the catalogue leaves too "
                f"much of it to be named. {_best(first)}")
    quiet = first["p_value"] > _CHANCE
    if not added and (quiet or not first["ranking"]):
        return (f"What {n} experiments leave unexplained asks for no effect of the catalogue more than chance would "
                f"({_p(first['p_value'])}), or for one too small to matter.")
    if not added:
        return (f"Something is left unexplained ({_p(first['p_value'])}), but no effect of the catalogue surely "
                f"predicts experiments better that its fit has not seen. {_best(first)}")
    one = _placed(first, added[0])
    if one is None:
        return (f"No effect of the catalogue explains enough of what is missing; a bare term in the "
                f"{figure_data['effects'][added[0]]['quantity']} stands for it. The term describes what is missing and "
                f"does not name it. {_closed(result)}")
    return (f"With {phrase(figure_data, added[:1])} added, the model predicts conditions that its fit has not seen better "
            f"than the best fit without it, by {one['sure']:.0f} standard errors over {n} experiments; it is the best "
            f"candidate in {_share(one)} of bootstrap samples. {_closed(result)} {_often(result)}")


def _often(result: Result) -> str:
    """How often such a name was right."""
    right, kind = result["answer"]["confidence"], result["answer"]["evidence"]
    meant = {"clear": "no effect that is not tied with it comes near", "a rival near": "another effect comes near",
             "something left over": "something is left over that nothing explains"}[kind]
    return f"Where effects were hidden on purpose, {100 * right:.0f} % of such names were right: {meant}."


def rounds(result: Result, figure_data: FigureData) -> list[tuple[str, str]]:
    """Of each added effect what it is and how sure, and why the study ended; nothing where nothing was added."""
    said: list[tuple[str, str]] = []
    answer = result["answer"]
    for group, one in zip(answer["tied"], result["rounds"], strict=False):
        name = group[0]
        what, placed = figure_data["effects"][name], _placed(one, name)
        said.append((f"{what['title']}:", f"the {what['quantity']} is {what['law']} ({what['source']}). Its mark: "
                                          f"{what['signature']}."))
        if placed is None:
            chosen = (f"{each['form']} in the {each['quantity']} in {100 * each['share']:.0f} %"
                      for each in answer["forms"])
            said += [("Its form:", "before any term is fitted, random halves of the experiments choose "
                                   f"{listed(list(chosen))}."),
                     ("Against the catalogue:", _best(one))]
        else:
            asked = "asked for beyond chance" if one["p_value"] <= _CHANCE else "hidden by scatter, which it narrows"
            said.append(("How sure:", f"{asked} ({_p(one['p_value'])}); {placed['sure']:.1f} standard errors better on "
                                      "held-out experiments than the fit without it; the best in "
                                      f"{_share(placed)} of bootstrap samples. "
                                      f"{_rivals(one, group, answer['effects'])}"))
    return [*said, ("Then:", _end(result))] if said else []


def coefficients(result: Result, figure_data: FigureData) -> Iterator[tuple[str, str, str]]:
    """Rows of: coefficient, estimate, interval."""
    for one in result["answer"]["coefficients"]:
        unit = "" if one["unit"] == "1" else f" [{one['unit']}]"
        name = f"{title(figure_data, one['effect'])}: {plain(one['coefficient'])}{unit}"
        yield name, _number(one["value"]), _interval(one)


def where(figure_data: FigureData) -> list[tuple[str, str]]:
    """The block and phase that disagree most, and how that depends on the conditions; nothing without signals."""
    shown = figure_data["where"]
    if shown is None:
        return []
    worst = shown["worst"]
    cell = f"the mean square of what is left is {_times(worst['chi_square'])} times what noise would leave, the most"
    after = shown["after"]["chi_square"][worst["block"]][worst["phase"]] if "after" in shown else None
    cell += "." if after is None else f"; with what was added {_times(after)} times."
    said = [(f"In the block “{BLOCKS[worst['block']]}”, {worst['phase']} phase,", cell)]
    for column, groups in shown["before"]["by_condition"].items():
        known = [(one["chi_square"], one["value"]) for one in groups if one["chi_square"] is not None]
        if len(known) > 1:
            low, high = (f"{_times(square)} ({_at(column, value)})" for square, value in (min(known), max(known)))
            said.append((f"By {plain(column)}:", f"from {low} to {high}."))
    return said


def gap(result: Result) -> Iterator[tuple[str, ...]]:
    """Rows of: channel, error before, after, of a right model, closed, closed by the control if there is one."""
    control = result["gap"]["control"]
    for name, one in result["gap"]["closures"].items():
        unit, scale = _CHANNELS[name]
        errors = (f"{scale * one[f'rms_{when}']:.3g}" for when in ("before", "after", "expected"))
        yield (f"{plain(name)} [{unit}]", *errors, _closure(one),
               *([_closure(control["closures"][name])] if control else []))


def ranking(one: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Rows of: candidate, block, gain in decades, standard errors ahead of none, behind the best, share, BIC."""
    for place, each in enumerate(one["ranking"]):
        behind = "" if place == 0 else f"{each['behind']:.1f}" + (" (tied)" if each["tied"] else "")
        yield (each["title"] + ("" if each["converged"] else " (not converged)"), each["block"],
               signed(each["held_out_gain"] / _DECADE), signed(each["sure"], 1), behind, _share(each),
               signed(each["bic"], 0))


def fits(result: Result) -> Iterator[tuple[str, ...]]:
    """Rows of: parameter, scatter or noise, and its value in the first and, if there is another, in the last fit."""
    first, *_ = fitted = result["rounds"][:1] + result["rounds"][1:][-1:]
    for name in first["parameters"]:
        yield f"{plain(name)} [multiple of nominal]", *(f"{one['parameters'][name]:.4f}" for one in fitted)
    for name in first["scatter"]:
        yield (f"run-to-run std of {plain(name)} [multiple of nominal]",
               *(f"{one['scatter'][name]:.4f}" for one in fitted))
    for place, name in enumerate(channels(first)):
        yield f"noise of the {plain(name)} [its sensor's]", *(f"{one['noise'][place]:.2f}" for one in fitted)


def channels(one: Mapping[str, Any]) -> list[str]:
    """Those of the noise of a round: without signals the shifting time alone."""
    return list(_CHANNELS)[-len(one["noise"]):]


def _interval(one: Mapping[str, Any]) -> str:
    if one["lower"] == one["upper"]:
        return "one of a few forms"
    return "at the bound of the search" if one["at_bound"] else f"{_number(one['lower'])} to {_number(one['upper'])}"


def _placed(one: Mapping[str, Any], effect: str) -> Mapping[str, Any] | None:
    """An effect in the ranking of a round; None for a term that is not in the catalogue."""
    return next((each for each in one["ranking"] if each["effect"] == effect), None)


def _best(one: Mapping[str, Any]) -> str:
    if not one["ranking"]:
        return "None of its effects was asked for."
    best = one["ranking"][0]
    if best["sure"] <= 0:
        return f"{best['title']}, the best of its effects, predicts no better than the fit without it."
    return (f"{best['title']}, the best of its effects, is {signed(best['sure'], 1)} standard errors ahead of the fit "
            "without it.")


def _rivals(one: Mapping[str, Any], group: list[str], added: list[str]) -> str:
    """What is tied with the first of a group, and else what comes next of all that was not added."""
    tied = [each["title"] for each in one["ranking"] if each["effect"] in group[1:]]
    if tied:
        return f"These recordings do not tell it apart from {listed(tied)}."
    places = [each["effect"] for each in one["ranking"]]
    others = [each for each in one["ranking"][places.index(group[0]):] if each["effect"] not in added]
    if not others:
        return ""
    beside = ", and is told from it by what was added beside it" if others[0]["tied"] else ""
    return f"The next, {others[0]['title']}, trails the best by {others[0]['behind']:.1f} standard errors{beside}."


def _closed(result: Result) -> str:
    one = result["gap"]["closures"]["shifting_time"]
    before, after, expected = (f"{1e3 * one[f'rms_{when}']:.3g}" for when in ("before", "after", "expected"))
    text = (f"The shifting-time error on such conditions goes from {before} to {after} ms; a right model would leave "
            f"{expected} ms.")
    if one["closure"] is None:
        return f"{text} That leaves no gap to close in the shifting time."
    added = "It closes" if len(result["answer"]["effects"]) == 1 else "All that was added closes"
    return f"{text} {added} {_closure(one)} of that gap."


def _closure(one: Mapping[str, Any]) -> str:
    """The share of a gap that is closed, with its interval."""
    if one["closure"] is None:
        return "no gap"
    if one["closure"] < 0:
        return "none, the error grows"
    return f"{100 * one['closure']:.0f} % ({signed(100 * one['lower'], 0)} to {signed(100 * one['upper'], 0)})"


def _end(result: Result) -> str:
    last = result["rounds"][-1]
    if last["p_value"] is None:
        return "no more was tried. What is left may ask for more."
    if last["ranking"]:
        best = last["ranking"][0]
        return (f"{best['title']} would come next, {signed(best['sure'], 1)} standard errors better, but explains too "
                "little of what is left to be added beside the rest.")
    return f"what is left asks for no further effect ({_p(last['p_value'])}), or for one too small to matter."


def _at(column: str, value: float) -> str:
    if column == "run_order":
        return ("first third", "middle third", "last third")[int(value)]
    return f"{value:.3g}{_UNITS[column]}"


def _share(one: Mapping[str, Any]) -> str:
    return f"{100 * one['bootstrap_share']:.0f} %"


def _p(value: float) -> str:
    return f"p\u00a0=\u00a0{value:.2g}" if value > _LEAST_P else f"p\u00a0≤\u00a0{_LEAST_P:g}"


def _times(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")
