"""The words of a study that are no plain English, each in half a sentence."""

from collections.abc import Iterable

from slipstick.report.study.parts import Entries, Files, Items, Section

_MEANINGS = {
    "block": "part of the model between two measured signals, tested with what was measured at its input.",
    "control": "a wrong effect, added for comparison: it must not close the gap.",
    "decades": "factors of ten of a likelihood.",
    "gap": "squared error beyond what sensor noise and scatter leave.",
    "held-out": "predicted by fits that have not seen it.",
    "nats": "natural logarithm of how many times more likely the recordings are; 2.3 are a factor of ten.",
    "reduced chi-square": "mean squared residual in units of the noise; 1 if only noise is left.",
    "scatter": "standard deviation from run to run, no uncertainty of an estimate.",
    "standard errors": "how far a number is from zero, in its own uncertainty over the runs.",
    "told apart": "one explanation leads the other by more standard errors than chance gives.",
}


def explain(sections: Iterable[Section]) -> Section:
    """Return the words that these sections have, with what they mean."""
    text = " ".join(repr(part) for section in sections for part in section.parts if not isinstance(part, Files)).lower()
    entries: Entries = [(f"{word[0].upper()}{word[1:]}:", meaning) for word, meaning in _MEANINGS.items()
                        if word in text or word.removesuffix("s") in text]
    return Section("Words", [Items(entries)] if entries else [])
