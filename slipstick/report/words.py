"""What a fit found, in sentences and numbers: plain text, which the page then marks up."""

from collections.abc import Iterator, Mapping
from itertools import combinations as pairs
from typing import Any

from slipstick.pictures.theme import plain

Result = Mapping[str, Any]

_SLIGHT = 0.2  # of the largest weight: smaller ones are left out of a combination in words
_TERMS = 3  # of a combination in words


def headline(result: Result, conditions: int, recordings: str) -> str:
    """What was fitted to what."""
    inputs = listed([plain(axis) for axis in result["axes"]])
    return f"{inputs[0].upper()}{inputs[1:]} fitted to {conditions} engagements of “{recordings}”"


def gain(result: Result) -> str:
    """The log10 likelihood before and after, and how far apart they are."""
    before, after = result["before"]["log10_likelihood"], result["log10_likelihood"]
    if after is None:
        return "The fitted inputs leave at least one engagement without any likelihood."
    if before is None:
        return f"log10 likelihood {signed(after)}; the nominal model leaves at least one engagement without any."
    return (f"log10 likelihood {signed(before)} before, {signed(after)} after: the fit makes the recordings "
            f"{after - before:.1f} decades (factors of ten) more likely than the nominal model does, given the noise "
            "that suits it.")


def identified(result: Result) -> list[tuple[str, str]]:
    """Which unknowns the recordings limit, and which they leave open."""
    intervals = result["intervals"]
    closed = [plain(one["unknown"]) for one in intervals if None not in (one["lower"], one["upper"])]
    level = f"{100 * intervals[0]['level']:.0f} %" if intervals else ""
    found = [(f"Limited on both sides ({level}):", listed(closed) + ".")] if closed else []
    for sides, missing in (("above only", {"lower"}), ("below only", {"upper"}), ("on neither side",
                                                                                 {"lower", "upper"})):
        some = [plain(one["unknown"]) for one in intervals
                if {side for side in ("lower", "upper") if one[side] is None} == missing]
        if some:
            found.append((f"Limited {sides}:", listed(some) + "."))
    unsettled = [plain(one["unknown"]) for one in intervals if one["unsettled"]]
    return [*found, ("An end was not found:", listed(unsettled) + ".")] if unsettled else found


def remarks(result: Result) -> list[tuple[str, str]]:
    """What is the case, and what helps; what the same helps against is said together."""
    causes: dict[str, list[str]] = {}
    for one in result["remarks"]:
        causes.setdefault(one["remedy"], []).append(f"{one['cause']}.")
    return [(" ".join(said), f"{remedy}.") for remedy, said in causes.items()]


def combinations(result: Result) -> list[tuple[str, str]]:
    """The combinations of unknowns, the best known first."""
    return [("Identified:" if one["identified"] else "Not identified:",
             f"{_weighed(one['weights'])}, {_known(one)}.") for one in result["combinations"]]


def numbers(result: Result) -> Iterator[tuple[str, str, str, str]]:
    """Rows of: unknown, before, fitted, interval."""
    intervals, before = {one["unknown"]: one for one in result["intervals"]}, result["before"]
    for kind in ("mean", "std"):
        for place, (axis, family) in enumerate(zip(result["axes"], result["families"], strict=True)):
            yield (f"{kind} of {plain(axis)}" + (f" ({family})" if kind == "mean" else ""),
                   number(before[kind][place]), number(result[kind][place]),
                   _interval(intervals.get(f"{kind} of {axis}")))
    yield ("output std [ms]", number(before["output_std"], 1e3), number(result["output_std"], 1e3),
           _interval(intervals.get("output std"), 1e3))
    for first, second in pairs(range(len(result["axes"])), 2) if result["correlation"] else ():
        name = f"correlation of {result['axes'][first]} and {result['axes'][second]}"
        yield plain(name), "0", number(result["correlation"][first][second]), _interval(intervals.get(name))
    for name, one in intervals.items():
        if name.startswith("partial"):
            yield plain(name), "0", number(one["estimate"]), _interval(one)


def listed(names: list[str]) -> str:
    """Names as they stand in a sentence."""
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def duration(seconds: float) -> str:
    """A time that was spent."""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 3600 else f"{seconds / 3600:.3g} h"


def signed(value: float, digits: int = 2) -> str:
    """A number to so many decimals, with a true minus sign, and none before a zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def number(value: float | None, scale: float = 1.0) -> str:
    """To four digits; nothing where there is none."""
    return "" if value is None else f"{scale * value:.4g}".replace("-", "−")


def _known(combination: Mapping[str, Any]) -> str:
    """How well, as shares of the range."""
    if combination["std_error"] >= 1 and combination["interval"] is None:
        return "not at all within the range"
    interval = combination["interval"]
    if interval is None:
        return f"to ±\u00a0{100 * combination['std_error']:.2g}\u00a0% of the range"
    low, high = ("open" if interval[side] is None else
                 f"{sign}{signed(100 * abs(interval[side] - interval['estimate']), 1)}"
                 for side, sign in (("lower", "−"), ("upper", "+")))
    return f"from {low} to {high}\u00a0% of the range ({100 * interval['level']:.0f}\u00a0%)"


def _weighed(weights: Mapping[str, float]) -> str:
    ordered = sorted(weights.items(), key=lambda entry: -abs(entry[1]))
    kept = [(name, weight) for name, weight in ordered if abs(weight) > _SLIGHT * abs(ordered[0][1])]
    if len(kept) == 1:
        return plain(kept[0][0])
    text = " ".join(f"{'−' if weight < 0 else '+'} {abs(weight):.2f} × {plain(name)}" for name, weight in kept[:_TERMS])
    return text.removeprefix("+ ") + (" …" if len(kept) > _TERMS else "")


def _interval(one: Mapping[str, Any] | None, scale: float = 1.0) -> str:
    if one is None:
        return ""
    low, high = (number(one[side], scale) for side in ("lower", "upper"))
    if low and high:
        return f"{low} to {high}"
    below, above = ("not found" if side in one["unsettled"] else "open" for side in ("lower", "upper"))
    if low or high:
        return f"from {low}, {above}" if low else f"{below}, to {high}"
    return below if below == above else f"{below} below, {above} above"
