"""What would explain a misfit where blocks could not be tested, and the shifting times over the conditions."""

from slipstick.pictures.study.words import effect_title
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import fixed, number, raised
from slipstick.report.study.parts import Note, Part, Picture, Section, Table
from slipstick.report.study.words import channel
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
        (effect_title(one.effect), number(one.nats), number(one.errors, 2), _apart(one, place), *_left(one),
         number(one.worth.shifting_time, 2)) for place, one in enumerate(result.explanations)]
    head = ("effect", "gain [nats]", "standard errors", "told apart from the first", "leaves at most", "in the",
            "changes the shifting time [ms RMS]")
    return Section("What would explain it", [Table(head, rows, words=(3, 5)), Note(_EXPLAINED)] if rows else [])


def times(result: StudyResult, has_picture: bool) -> Section:
    """The shifting times over the conditions; empty where signals were recorded."""
    parts: list[Part] = [Picture("times")] if has_picture else []
    rows = [_row(one) for one in result.times]
    head = ("condition", "furthest from zero at", "measured minus predicted [ms]", "standard error [ms]", "gain [nats]",
            "standard errors", "more than noise")
    return Section("Shifting times over the conditions",
                   [*parts, Table(head, rows, words=(1, 6)), Note(_OVER)] if rows else [])


def _apart(one: Explanation, place: int) -> str:
    return "" if place == 0 else "no" if one.tied else "yes"


def _left(one: Explanation) -> tuple[str, str]:
    """The largest chi-square that an effect leaves, and where."""
    name = max(one.chi_square, key=one.chi_square.__getitem__)
    return f"{one.chi_square[name]:.2f}", channel(name)


def _row(one: TimesOver) -> tuple[str, ...]:
    unit, at = "" if one.unit == "1" else f" {raised(one.unit)}", one.furthest
    return (in_words(one.condition), f"{number(one.levels[at], 4)}{unit}", signed(one.change[at]), fixed(one.error[at]),
            fixed(one.nats), fixed(one.errors), "yes" if one.shown else "no")
