"""The results of a study in sentences and numbers, as plain text."""

from collections.abc import Iterator, Mapping
from typing import Any

from slipstick.pictures.study.words import BLOCKS, phrase, title
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.words import listed, signed

Result = Mapping[str, Any]
FigureData = Mapping[str, Any]

_CHANNELS = {name: (unit, 1.0) for name, unit in SIGNAL_UNITS.items()} | {"shifting_time": ("ms", 1e3)}
"""Compared channel -> displayed unit, and the factor from the unit of the result to it."""
_UNITS = {"current_profile": "", "motor_speed": " rad/s", "load_inertia": " kg m²", "brake_torque": " N m"}
_DECADE = 2.302585  # nats per decade
_SIGNIFICANCE = 0.05  # largest significant p-value
_LEAST_P = 1e-3  # smallest p-value that the number of replicates can resolve


def lead(result: Result, figure_data: FigureData) -> str:
    """Return the support of the answer, and how it improves the predictions, in two or three sentences."""
    first, n, added = result["rounds"][0], result["experiments"], result["answer"]["effects"]
    if result["answer"]["kind"] == "not converged":
        return "The fit without any effect did not converge, so its residuals cannot be interpreted."
    if not added and result["answer"]["kind"] == "unlisted":
        return (f"A misfit remains ({_p(first['p_value'])}), and every effect of the catalogue leaves too much "
                f"of it unexplained to be named. {_best(first)}")
    significant = first["p_value"] <= _SIGNIFICANCE
    if not added and not (significant and first["ranking"]):
        return (f"In {n} experiments, no effect of the catalogue is both significant and large enough to matter "
                f"({_p(first['p_value'])}).")
    if not added:
        return (f"A significant misfit remains ({_p(first['p_value'])}), but no effect of the catalogue significantly "
                f"improves the prediction of held-out experiments. {_best(first)}")
    candidate = _candidate(first, added[0])
    if candidate is None:
        return ("No effect of the catalogue explains enough of the misfit; an open term in the "
                f"{figure_data['effects'][added[0]]['quantity']} represents it. The term describes the missing effect "
                f"but does not identify it. {_closed(result)}")
    return (f"With {phrase(figure_data, added[:1])} added, the model predicts held-out conditions better than the "
            f"best fit without it, by {candidate['sure']:.0f} standard errors over {n} experiments. The effect is the "
            f"best candidate in {_share(candidate)} of bootstrap samples. {_closed(result)} {_reliability(result)}")


def _reliability(result: Result) -> str:
    """Return how often names with comparable support were correct in blind tests."""
    correct, kind = result["answer"]["confidence"], result["answer"]["evidence"]
    support = {"clear": "no untied effect comes close",
               "a rival near": "another effect comes close",
               "something left over": "part of the misfit remains unexplained"}[kind]
    return (f"In blind tests with hidden effects, {100 * correct:.0f} % of the names with comparable support were "
            f"correct; here, {support}.")


def rounds(result: Result, figure_data: FigureData) -> list[tuple[str, str]]:
    """Return the description and support of each added effect, and why the study ended; empty if none was added."""
    items: list[tuple[str, str]] = []
    answer = result["answer"]
    for group, entry in zip(answer["tied"], result["rounds"], strict=False):
        name = group[0]
        effect, candidate = figure_data["effects"][name], _candidate(entry, name)
        items.append((f"{effect['title']}:", f"the {effect['quantity']} is {effect['law']} ({effect['source']}). "
                                             f"Signature: {effect['signature']}."))
        if candidate is None:
            forms = [f"{form['form']} in the {form['quantity']} ({100 * form['share']:.0f} %)"
                     for form in answer["forms"]]
            items += [("Form:", "share of random halves of the experiments that select each form before any term is "
                                f"fitted: {listed(forms)}."),
                      ("Comparison with the catalogue:", _best(entry))]
        else:
            screening = "significant in the screening" if entry["p_value"] <= _SIGNIFICANCE else \
                "masked by the scatter in the screening, and reduces the scatter when fitted"
            items.append(("Support:", f"{screening} ({_p(entry['p_value'])}); {candidate['sure']:.1f} standard errors "
                                      "better than the fit without it on held-out experiments; the best candidate in "
                                      f"{_share(candidate)} of bootstrap samples. "
                                      f"{_rivals(entry, group, answer['effects'])}"))
    return [*items, ("End of the study:", _end(result))] if items else []


def coefficients(result: Result, figure_data: FigureData) -> Iterator[tuple[str, str, str]]:
    """Yield rows of coefficient, estimate and interval."""
    for coefficient in result["answer"]["coefficients"]:
        unit = "" if coefficient["unit"] == "1" else f" [{coefficient['unit']}]"
        name = f"{title(figure_data, coefficient['effect'])}: {in_words(coefficient['coefficient'])}{unit}"
        yield name, _number(coefficient["value"]), _interval(coefficient)


def where(figure_data: FigureData) -> list[tuple[str, str]]:
    """Return the block and phase with the largest misfit, and how it depends on conditions; empty without signals."""
    misfit = figure_data["where"]
    if misfit is None:
        return []
    worst = misfit["worst"]
    cell = f"the mean squared residual is largest, at {_times(worst['chi_square'])} times that of noise alone"
    after = misfit["after"]["chi_square"][worst["block"]][worst["phase"]] if "after" in misfit else None
    cell += "." if after is None else f"; with all added effects, it is {_times(after)} times that of noise."
    items = [(f"In the block “{BLOCKS[worst['block']]}”, {worst['phase']} phase,", cell)]
    for column, groups in misfit["before"]["by_condition"].items():
        values = [(group["chi_square"], group["value"]) for group in groups if group["chi_square"] is not None]
        if len(values) > 1:
            low, high = (f"{_times(square)} times {_level(column, value)}"
                         for square, value in (min(values), max(values)))
            items.append((f"By {in_words(column)}:", f"from {low} to {high}."))
    return items


def gap(result: Result) -> Iterator[tuple[str, ...]]:
    """Yield rows of channel, RMS error before, after and of a correct model, and shares closed (also by a control)."""
    control = result["gap"]["control"]
    for name, closure in result["gap"]["closures"].items():
        unit, scale = _CHANNELS[name]
        errors = (f"{scale * closure[f'rms_{model}']:.3g}" for model in ("before", "after", "expected"))
        yield (f"{in_words(name)} [{unit}]", *errors, _closure(closure),
               *([_closure(control["closures"][name])] if control else []))


def ranking(entry: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield rows of a round: candidate, block, improvement in decades, ahead and behind in s.e., share, BIC."""
    for rank, candidate in enumerate(entry["ranking"]):
        behind = "" if rank == 0 else f"{candidate['behind']:.1f}" + (" (tied)" if candidate["tied"] else "")
        yield (candidate["title"] + ("" if candidate["converged"] else " (not converged)"), candidate["block"],
               signed(candidate["held_out_gain"] / _DECADE), signed(candidate["sure"], 1), behind, _share(candidate),
               signed(candidate["bic"], 0))


def fits(result: Result) -> Iterator[tuple[str, ...]]:
    """Yield rows of parameter, scatter or noise, with its value in the first fit and, if there is one, in the last."""
    first, *_ = fitted = result["rounds"][:1] + result["rounds"][1:][-1:]
    for name in first["parameters"]:
        yield f"{in_words(name)} [multiple of nominal]", *(f"{fit['parameters'][name]:.4f}" for fit in fitted)
    for name in first["scatter"]:
        yield (f"run-to-run std of {in_words(name)} [multiple of nominal]",
               *(f"{fit['scatter'][name]:.4f}" for fit in fitted))
    for index, name in enumerate(channels(first)):
        yield (f"noise of the {in_words(name)} [multiple of sensor noise]",
               *(f"{fit['noise'][index]:.2f}" for fit in fitted))


def channels(entry: Mapping[str, Any]) -> list[str]:
    """Return the channels of the noise of a round; without signals, the shifting time alone."""
    return list(_CHANNELS)[-len(entry["noise"]):]


def _interval(coefficient: Mapping[str, Any]) -> str:
    if coefficient["lower"] == coefficient["upper"]:
        return "selected from discrete values"
    if coefficient["at_bound"]:
        return "at a bound of the search"
    return f"{_number(coefficient['lower'])} to {_number(coefficient['upper'])}"


def _candidate(entry: Mapping[str, Any], effect: str) -> Mapping[str, Any] | None:
    """Return an effect in the ranking of a round; None for an open term, which is not in the catalogue."""
    return next((candidate for candidate in entry["ranking"] if candidate["effect"] == effect), None)


def _best(entry: Mapping[str, Any]) -> str:
    """Return a sentence on the best effect of the catalogue in a round."""
    if not entry["ranking"]:
        return "No effect of the catalogue passed the screening."
    best = entry["ranking"][0]
    if best["sure"] <= 0:
        return (f"{best['title']}, the best effect of the catalogue, does not improve the prediction of held-out "
                "experiments.")
    return (f"{best['title']}, the best effect of the catalogue, improves the prediction of held-out experiments by "
            f"{signed(best['sure'], 1)} standard errors.")


def _rivals(entry: Mapping[str, Any], group: list[str], added: list[str]) -> str:
    """Return the effects tied with the first of a group, or else the next effect that was not added."""
    tied = [candidate["title"] for candidate in entry["ranking"] if candidate["effect"] in group[1:]]
    if tied:
        return f"These recordings do not distinguish it from {listed(tied)}."
    rank = [candidate["effect"] for candidate in entry["ranking"]].index(group[0])
    others = [candidate for candidate in entry["ranking"][rank:] if candidate["effect"] not in added]
    if not others:
        return ""
    reason = "; the other added effects distinguish the two" if others[0]["tied"] else ""
    return (f"The next candidate, {others[0]['title']}, trails the best by {others[0]['behind']:.1f} standard errors"
            f"{reason}.")


def _closed(result: Result) -> str:
    """Return the held-out shifting-time error before and after, and the share of the gap that is closed."""
    closure = result["gap"]["closures"]["shifting_time"]
    before, after, expected = (f"{1e3 * closure[f'rms_{model}']:.3g}" for model in ("before", "after", "expected"))
    text = (f"The shifting-time error on held-out conditions goes from {before} to {after} ms; a correct model would "
            f"leave {expected} ms.")
    if closure["closure"] is None:
        return f"{text} There is no significant gap in the shifting time to close."
    if closure["closure"] < 0:
        return f"{text} The gap is not closed: the error grows."
    closes = "The effect closes" if len(result["answer"]["effects"]) == 1 else "Together, the added effects close"
    return f"{text} {closes} {_closure(closure)} of the gap."


def _closure(closure: Mapping[str, Any]) -> str:
    """Return the closed share of a gap, with its interval."""
    if closure["closure"] is None:
        return "no significant gap"
    if closure["closure"] < 0:
        return "none, the error grows"
    lower, upper = (signed(100 * closure[side], 0) for side in ("lower", "upper"))
    return f"{100 * closure['closure']:.0f} % ({lower} to {upper})"


def _end(result: Result) -> str:
    """Return why the study ended."""
    last = result["rounds"][-1]
    if last["p_value"] is None:
        return "no further effect was tested. The remaining misfit may contain another one."
    if last["ranking"]:
        best = last["ranking"][0]
        return (f"{best['title']} would be next, {signed(best['sure'], 1)} standard errors better, but explains too "
                "little of the remaining misfit to be added.")
    return f"no further effect is both significant and large enough to matter ({_p(last['p_value'])})."


def _level(column: str, value: float) -> str:
    if column == "run_order":
        return ("in the first third", "in the middle third", "in the last third")[int(value)]
    return f"{'with profile' if column == 'current_profile' else 'at'} {value:.3g}{_UNITS[column]}"


def _share(candidate: Mapping[str, Any]) -> str:
    return f"{100 * candidate['bootstrap_share']:.0f} %"


def _p(value: float) -> str:
    return f"p\u00a0=\u00a0{value:.2g}" if value > _LEAST_P else f"p\u00a0≤\u00a0{_LEAST_P:g}"


def _times(value: float) -> str:
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")
