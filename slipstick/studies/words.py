"""What findings are called, and the answer in one sentence."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from slipstick.bench.parameters import PARAMETERS, index
from slipstick.clutch import effects
from slipstick.confirmation.explanations import Explanation
from slipstick.naming.block import Pair
from slipstick.naming.released import VALUE
from slipstick.studies.finding import Contested
from slipstick.studies.result import BeyondParameter, FindingResult, Remainder

_FORMS = {"lag": "lag of the {0}", "offset": "offset of the {0}", "gain": "gain error of the {0}",
          "past current": "{0} that depends on the past of the current",
          "direction": "{0} that depends on the direction of motion", "twist": "twist of the shafts by the {0}",
          VALUE: "another value of the {0}"}
SIGNALS = {"valve": "current → pressure", "contact": "pressure, slip → torque in full contact",
           "clutch": "pressure, speeds → torque while the plates close", "load": "torque → output speed",
           "input": "torque → input speed", "lock": "output speed → input speed after lock-up"}
"""Block of the study -> the signals that it connects."""
NOTHING = "Nothing is missing that these recordings could show"
_PARAMETERS = "The parameters of the bench explain these recordings"


def title(pair: Pair, effect: str | None) -> str:
    """A finding in words: the title of its effect, or else what depends on what."""
    if effect is not None:
        return effects.find(effect).title
    words = _FORMS.get(pair[1], "{0} that depends on the {1}").format(*pair)
    return words[0].upper() + words[1:]


def sentence(findings: Sequence[FindingResult], unexplained: Sequence[str],
             outlying: Mapping[str, Sequence[int]] = MappingProxyType({}), remainders: Sequence[Remainder] = (),
             any_tested: bool = True, missing: Sequence[str] = (), misfits: Sequence[str] = (),
             explanations: Sequence[Explanation] = (), beyond: Sequence[BeyondParameter] = ()) -> str:
    """The answer.

    Where nothing was found, it has the engagements that are `outlying` in a block and yet used. Signals are `missing`
    without which some blocks could not be tested, or none. `misfits` are the signals, or the shifting time, in which
    the simulation leaves a misfit that the tested blocks do not explain, and `explanations` would explain it.
    Parameters `beyond` what is known of them are not what the bench states.
    """
    answer = _describe_findings(findings, unexplained, outlying)
    answer += "".join(_describe_remainder(remainder) for remainder in remainders)
    if misfits:
        absent = f"Something is missing that shows in the {_join_words(misfits)}"
        absent += ", but in no block that could be tested" if any_tested else ""
        answer = (absent if answer == NOTHING else f"{answer}. {absent}") + _describe_explanations(explanations)
    answer += "".join(_describe_beyond(parameter) for parameter in beyond)
    if not missing:
        return answer
    if not any_tested and answer == NOTHING:
        answer = _PARAMETERS
    which, lacking = "Not every" if any_tested else "No", _join_words(missing)
    return f"{answer}. {which} block was tested: the recordings have no {lacking}"


def partial_sentence(findings: Sequence[FindingResult], unexplained: Sequence[str],
                     outlying: Mapping[str, Sequence[int]], remainders: Sequence[Remainder]) -> str:
    """The answer of a study whose time budget ended before it was complete."""
    answer = sentence(findings, unexplained, outlying, remainders)
    return f"Partial answer, as the time budget ended. {'Nothing was found so far' if answer == NOTHING else answer}"


def engagements(rows: Sequence[int]) -> str:
    """Engagements by their numbers."""
    return f"engagement{'s' * (len(rows) > 1)} {_join_words([str(row) for row in rows])}"


def _describe_explanations(explanations: Sequence[Explanation]) -> str:
    """The effects that would explain a misfit best, as far as the recordings tell them apart."""
    if not explanations:
        return ""
    first, *others = (effects.find(explanation.effect).title for explanation in explanations
                      if explanation is explanations[0] or explanation.tied)
    names = [name[0].lower() + name[1:] for name in (first, *others)]
    what = "would explain it" if explanations[0].sufficient else "would explain most, but not all of it"
    best = f". Of the effects in the catalogue, {names[0]} {what}"
    return f"{best}, and is not told apart from {_join_words(names[1:])}" if names[1:] else best


def _join_words(names: Sequence[str]) -> str:
    *most, last = (name.replace("_", " ") for name in names)
    return f"{', '.join(most)} and {last}" if most else last


def _describe_findings(findings: Sequence[FindingResult], unexplained: Sequence[str],
                       outlying: Mapping[str, Sequence[int]]) -> str:
    left = _quote_blocks(unexplained)
    if not findings and not left and outlying:
        rows = sorted({row for block_rows in outlying.values() for row in block_rows})
        bad = "are bad: they are" if len(rows) > 1 else "is bad: it is"
        return (f"Something is missing in the block {_quote_blocks(tuple(outlying))}, or {engagements(rows)} {bad} "
                "far worse there than the others")
    if not findings:
        return f"Something is missing in the block {left}, and no law that was tried explains it" if left else NOTHING
    parts = [_describe_finding(finding, findings) for finding in findings]
    more = f". Something more is missing in the block {left}, and no law that was tried explains it" if left else ""
    return f"Missing: {list_findings(parts)}{more}"


def list_findings(names: Sequence[str]) -> str:
    """Return names of findings as a list in which a name may have an "and"."""
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])}, and {names[-1]}"


def tell_others(finding: Contested, findings: Sequence[Contested], titles: Sequence[str]) -> str:
    """Return what the recordings do not tell apart from a finding, beside the other `findings`: one by its name.

    The rivals of the finding have these `titles`.
    """
    named = {(each.quantity, each.depends_on) for each in findings if each is not finding}
    others = [words for rival, words in zip(finding.rivals, titles, strict=True)
              if (rival.quantity, rival.depends_on) not in named]
    if len(others) == 1:
        return f" (or {others[0][0].lower()}{others[0][1:]})"
    return f" (or {len(others)} others)" if others else ""


def _quote_blocks(blocks: Sequence[str]) -> str:
    return " and ".join(f"“{SIGNALS[block]}”" for block in blocks)


def _describe_beyond(parameter: BeyondParameter) -> str:
    size = f"{100 * abs(parameter.change):.3g} % {'larger' if parameter.change > 0 else 'smaller'}"
    return f". The {PARAMETERS[index(parameter.name)].meaning} is {size} than the bench states"


def _describe_remainder(remainder: Remainder) -> str:
    return (f". What is left in the block {_quote_blocks(remainder.blocks)} resembles this: "
            f"{remainder.title[0].lower() + remainder.title[1:]}. "
            "More likely it is what the laws of the findings do not follow")


def _describe_finding(finding: FindingResult, findings: Sequence[FindingResult]) -> str:
    doubt = finding.confirmation.agrees is False or finding.confirmation.simulated == "not computed"
    name = finding.title[0].lower() + finding.title[1:]
    titles = [title((other.quantity, other.depends_on), other.effect) for other in finding.rivals]
    return (name + " (which no effect of the catalogue explains)" * (finding.kind == "unlisted")
            + tell_others(finding, findings, titles) + " (not confirmed by the simulation of the whole bench)" * doubt)
