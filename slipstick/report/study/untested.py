"""What would explain a misfit where blocks could not be tested, and the shifting times over the conditions."""

from collections.abc import Collection

from slipstick.pictures.study.words import effect_title
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import fixed, number, raised
from slipstick.report.study.parts import Note, Section, Table, show
from slipstick.report.words import signed
from slipstick.studies.result import Explanation, StudyResult, TimesOver

_EXPLAINED = ("Each effect alone is added to the simulation of the whole bench and fitted to all that was recorded. No "
              "block measures its law here, so an effect that the catalogue does not have may be the cause. On "
              "simulated benches without pressure, the effect that gains most, or one that was not told apart from it, "
              "was the right one in one of five cases, and six of 24 without an effect were said to lack something. "
              "Standard errors are over engagements.")
_OVER = ("Measured minus predicted shifting time with its standard error. Predicted by the simulation whose parameters "
         "are fitted to the shifting times: what they explain is not in it, and where they could explain a change, its "
         "standard error is large. Every condition is tested without the others. The gain is that of engagements that "
         "did not determine the change, and the standard errors are those in which they gain.")


def explained(result: StudyResult) -> Section:
    """The effects that would explain what the simulation leaves; empty without any."""
    rows: list[tuple[str, ...]] = [
        (effect_title(explanation.effect), number(explanation.nats), number(explanation.errors, 2),
         _tell_apart(explanation, place), *_find_largest_misfit(explanation),
         number(explanation.worth.shifting_time, 2)) for place, explanation in enumerate(result.explanations)]
    head = ("effect", "gain [nats]", "standard errors", "told apart from the first", "leaves at most", "in the",
            "changes the shifting time [ms RMS]")
    return Section("What would explain it", [Table(head, rows, words=(3, 5)), Note(_EXPLAINED)] if rows else [])


def times(result: StudyResult, pictures: Collection[str]) -> Section:
    """The shifting times over the conditions; empty where signals were recorded."""
    rows = [_row(trend) for trend in result.times]
    head = ("condition", "furthest from zero at", "measured minus predicted [ms]", "standard error [ms]", "gain [nats]",
            "standard errors", "more than noise")
    return Section("Shifting times over the conditions",
                   [*show("times", pictures), Table(head, rows, words=(1, 6)), Note(_OVER)] if rows else [])


def _tell_apart(explanation: Explanation, place: int) -> str:
    return "" if place == 0 else "no" if explanation.tied else "yes"


def _find_largest_misfit(explanation: Explanation) -> tuple[str, str]:
    """The largest chi-square that an effect leaves, and where."""
    name = max(explanation.chi_square, key=explanation.chi_square.__getitem__)
    return f"{explanation.chi_square[name]:.2f}", in_words(name)


def _row(trend: TimesOver) -> tuple[str, ...]:
    unit, at = "" if trend.unit == "1" else f" {raised(trend.unit)}", trend.furthest
    return (in_words(trend.condition), f"{number(trend.levels[at], 4)}{unit}", signed(trend.change[at]),
            fixed(trend.error[at]), fixed(trend.nats), fixed(trend.errors), "yes" if trend.shown else "no")
