"""The results of a fit in sentences and numbers, as plain text."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import combinations as pairs
from typing import Any

from slipstick.pictures import units
from slipstick.pictures.output import SHIFTING_TIME, Output
from slipstick.pictures.theme import in_words
from slipstick.time_budget import Partial

Result = Mapping[str, Any]

_SMALLEST_WEIGHT = 0.2  # of the largest: unknowns with smaller weights are not listed
_TERMS = 3  # unknowns listed per combination
_SIDES = ("lower", "upper")
OUTSIDE = {"clip": "the value at its nearest edge", "nan": "no value", "error": "refused"}
"""What a table gives outside of its axes, by its policy."""


def measured(result: Result, output: Output) -> str:
    """Return how many engagements, or measurements of another machine, a fit is to."""
    return f"{len(result['log10_likelihood_per_condition'])} {output.measured}"


def headline(result: Result, recordings: str, output: Output) -> str:
    """Return the title of the report: the inputs, the recordings they were fitted to, and what is at a bound."""
    inputs = listed([in_words(axis) for axis in result["axes"]])
    title = f"{inputs[0].upper()}{inputs[1:]} fitted to {measured(result, output)} of “{recordings}”"
    bound = [in_words(remark["unknown"]) for remark in result["remarks"] if remark.get("at_bound")]
    return f"{title}, with {listed(bound)} at {'its bound' if len(bound) == 1 else 'their bounds'}" if bound else title


def improvement(result: Result, output: Output) -> str:
    """Return the log10 likelihood before and after the fit, and the difference."""
    before, after = result["before"]["log10_likelihood"], result["log10_likelihood"]
    nominal = "the nominal model" if all(mean == 1 for mean in result["before"]["mean"]) else \
        "the model whose inputs are as near to nominal as their bounds allow"
    if after is None:
        return f"With the fitted inputs, at least one of the {output.measured} has zero likelihood."
    if before is None:
        return (f"log10 likelihood {signed(after)} after the fit. With {nominal}, at least one of the "
                f"{output.measured} has zero likelihood.")
    return (f"log10 likelihood {signed(before)} before the fit, {signed(after)} after it: the recordings are "
            f"{after - before:.1f} decades (factors of ten) more likely with the fitted inputs than with {nominal}, "
            "whose output noise is matched to its residuals.")


def fitted(physical: Iterable[Mapping[str, Any]]) -> str:
    """Return the mean of each input in its unit, and its scatter between runs."""
    values = []
    for estimate in physical:
        unit, factor = units.scale(estimate["unit"], estimate["mean"])
        mean, std = (units.number(factor * estimate[name]) for name in ("mean", "std"))
        values.append(f"{in_words(estimate['name'])} {units.with_unit(mean, unit)} with a scatter of "
                      f"{units.with_unit(std, unit)}")
    return listed(values)


def identified(result: Result) -> list[tuple[str, str]]:
    """Return which unknowns the recordings limit, and on which side."""
    intervals = result["intervals"]
    closed = [in_words(interval["unknown"]) for interval in intervals if not _open_sides(interval)]
    level = f"{100 * intervals[0]['level']:.0f} %" if intervals else ""
    items = [(f"Limited on both sides ({level}):", listed(closed) + ".")] if closed else []
    for lead, sides in (("Limited above only:", {"lower"}), ("Limited below only:", {"upper"}),
                        ("Not limited on either side:", {"lower", "upper"})):
        unknowns = [in_words(interval["unknown"]) for interval in intervals if _open_sides(interval) == sides]
        if unknowns:
            items.append((lead, listed(unknowns) + "."))
    unsettled = [in_words(interval["unknown"]) for interval in intervals if interval["unsettled"]]
    return [*items, ("End of the interval not found:", listed(unsettled) + ".")] if unsettled else items


def warnings(result: Result) -> list[tuple[str, str]]:
    """Return what a partial result lacks, and (causes, remedy) of the remarks, those with the same remedy merged."""
    partial = result.get("partial")  # results of earlier versions do not have it
    causes: dict[str, list[str]] = {}
    for remark in result["remarks"]:
        causes.setdefault(remark["remedy"], []).append(f"{in_words(remark['cause'])}.")
    return [*([Partial(**partial).warning] if partial else []),
            *((" ".join(sentences), f"{remedy}.") for remedy, sentences in causes.items())]


def combinations(result: Result) -> list[tuple[str, str]]:
    """Return the combinations of unknowns with their uncertainty, the best identified first."""
    return [("Identified:" if combination["identified"] else "Not identified:",
             f"{_weighted_sum(combination['weights'])}, {_uncertainty(combination)}.")
            for combination in result["combinations"]]


def numbers(result: Result, physical: Sequence[Mapping[str, Any]],
            output: Output = SHIFTING_TIME) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Yield rows of unknown, value before the fit, fitted value, that value in its unit, and the interval in both.

    `physical` has unit, nominal value, mean and std of each input.
    """
    intervals, before = {interval["unknown"]: interval for interval in result["intervals"]}, result["before"]
    for kind in ("mean", "std"):
        for index, (axis, family) in enumerate(zip(result["axes"], result["families"], strict=True)):
            yield (in_words(f"{kind} of {axis}") + (f" ({family})" if kind == "mean" else ""),
                   number(before[kind][index]), number(result[kind][index]),
                   *_physical(physical[index], kind, intervals.get(f"{kind} of {axis}")))
    noise = intervals.get("output std")
    unit, factor = output.small, output.factor
    yield (f"output noise [{unit}]", number(before["output_std"], factor), number(result["output_std"], factor),
           units.with_unit(number(result["output_std"], factor), unit), _interval(noise, factor),
           _interval(noise, factor, unit))
    for first, second in pairs(range(len(result["axes"])), 2) if result["correlation"] else ():
        name = f"correlation of {result['axes'][first]} and {result['axes'][second]}"
        yield in_words(name), "0", number(result["correlation"][first][second]), "", _interval(intervals.get(name)), ""
    for name, interval in intervals.items():
        if name.startswith("partial"):
            yield in_words(name), "0", number(interval["estimate"]), "", _interval(interval), ""


def settings_of(settings: Mapping[str, Any], axes: Sequence[str], unit: str = "s") -> str:
    """Return the settings of a fit in words; those that are not given are left out."""
    parts = []
    if "families" in settings:
        parts.append(f"distributions of the inputs: {_each(settings['families'], axes)}")
    for name, what in (("mean_bounds", "mean"), ("std_bounds", "scatter")):
        if name in settings:
            ranges = [f"{low:g} to {high:g}" for low, high in settings[name]]
            parts.append(f"{what} searched from {_each(ranges, axes)} multiples of nominal")
    if settings.get("output_std_bounds"):
        low, high = settings["output_std_bounds"]
        parts.append(units.with_unit(f"output noise searched from {low:.3g} to {high:.3g}", unit))
    if settings.get("correlated"):
        parts.append("inputs may be correlated")
    if settings.get("method") == "classic":
        parts.append(f"classic search on a grid of {settings.get('grid', '?')} values for each unknown")
    elif "method" in settings:
        most, candidates, waits, least = (
            settings.get(name, "?") for name in ("generations", "population", "patience", "tolerance"))
        parts.append(f"genetic search of at most {most} generations with {candidates} candidates, which ends when "
                     f"{waits} of them gain no more than {least} decades (factors of ten) of likelihood")
    if "refine" in settings:
        parts.append("the best candidate refined on the exact likelihood" if settings["refine"] else "no refinement")
    if "intervals" in settings:
        parts.append(f"profile-likelihood intervals of {100 * settings.get('level', 0.9):g} %" if settings["intervals"]
                     else "no intervals")
    if "seed" in settings:
        parts.append(f"random numbers from seed {settings['seed']}")
    return "; ".join(parts)


def _each(values: Sequence[str], axes: Sequence[str]) -> str:
    """Return the one value of all inputs, or that of each."""
    return values[0] if len(set(values)) == 1 else listed(
        [f"{value} ({in_words(axis)})" for axis, value in zip(axes, values, strict=True)])


def listed(names: list[str]) -> str:
    """Join names with commas and "and"; empty without names."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def probability(share: float) -> str:
    """Return a probability in %; one below 0.01 % is not told from the rounding errors of its computation."""
    return "below 0.01 %" if share < 1e-4 else f"{100 * share:.3g} %"


def duration(seconds: float) -> str:
    """Return a time in s, min or h, to three significant digits."""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 3600 else f"{seconds / 3600:.3g} h"


def signed(value: float, digits: int = 2) -> str:
    """Return a number with fixed decimals and a true minus sign; a rounded zero has no sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def number(value: float | None, scale: float = 1.0) -> str:
    """Return `scale * value` to four significant digits; empty for None."""
    return "" if value is None else f"{scale * value:.4g}".replace("-", "−")


def _open_sides(interval: Mapping[str, Any]) -> set[str]:
    """Return the sides without an end."""
    return {side for side in _SIDES if interval[side] is None}


def _uncertainty(combination: Mapping[str, Any]) -> str:
    """Return the interval relative to the estimate, or else the standard error, as a share of the range."""
    interval = combination["interval"]
    if interval is not None:
        low, high = ("" if interval[side] is None else
                     f"{sign}{signed(100 * abs(interval[side] - interval['estimate']), 1)}\u00a0%"
                     for side, sign in (("lower", "−"), ("upper", "+")))
        ends = _ends(low, high, interval["unsettled"])
        return f"{100 * interval['level']:.0f}\u00a0% interval as a share of the range: {ends}"
    if combination["std_error"] >= 1:
        return "standard error larger than the range"
    return f"standard error {100 * combination['std_error']:.2g}\u00a0% of the range"


def _weighted_sum(weights: Mapping[str, float]) -> str:
    ordered = sorted(weights.items(), key=lambda entry: -abs(entry[1]))
    kept = [(name, weight) for name, weight in ordered if abs(weight) > _SMALLEST_WEIGHT * abs(ordered[0][1])]
    if len(kept) == 1:
        return in_words(kept[0][0])
    text = " ".join(f"{'−' if weight < 0 else '+'} {abs(weight):.2f} × {in_words(name)}"
                    for name, weight in kept[:_TERMS])
    return text.removeprefix("+ ") + (" …" if len(kept) > _TERMS else "")


def _interval(interval: Mapping[str, Any] | None, scale: float = 1.0, unit: str = "") -> str:
    if interval is None:
        return ""
    low, high = (number(interval[side], scale) for side in _SIDES)
    if low and high:
        return units.with_unit(f"{low} to {high}", unit)
    low, high = (end and units.with_unit(end, unit) for end in (low, high))
    return _ends(low, high, interval["unsettled"])


def _physical(entry: Mapping[str, Any], kind: str, interval: Mapping[str, Any] | None) -> tuple[str, str, str]:
    """Return a mean or std in its unit, its interval in multiples, and that interval in its unit."""
    unit, factor = units.scale(entry["unit"], entry[kind])
    return (units.with_unit(number(factor * entry[kind]), unit), _interval(interval),
            _interval(interval, factor * entry["nominal"], unit))


def _ends(low: str, high: str, unsettled: Collection[str]) -> str:
    """Return the ends of an interval, of which one or both may be empty: open, or not found if `unsettled` names it."""
    if low and high:
        return f"{low} to {high}"
    below, above = ("end not found" if side in unsettled else "open" for side in _SIDES)
    if low:
        return f"from {low} ({above} above)"
    if high:
        return f"up to {high} ({below} below)"
    return below if below == above else f"{below} below, {above} above"
