"""What findings of a machine are called, and the answer in one sentence."""

from collections.abc import Sequence

from slipstick.engine.laws import LAG, PAST
from slipstick.machine_studies.result import MachineFinding
from slipstick.studies.words import NOTHING, list_findings, tell_others, title


def name_finding(pair: tuple[str, str], kind: str | None = None, effect: str | None = None) -> str:
    """Return a finding in words: its effect, or else what depends on what, with the kind where there is one."""
    words = title(pair, None)
    if effect is not None:
        return f"{effect[0].upper()}{effect[1:]}: {words[0].lower()}{words[1:]}"
    return words if kind is None else f"{words} ({kind})"


def name_run(number: int, names: Sequence[str]) -> str:
    """Return a run by its number, with its name where the recordings have `names`."""
    return f"{number} ({names[number]})" if names else str(number)


def is_memory(depends_on: str) -> bool:
    """Whether a pair depends on a lag or on the past of a signal, which no run can set."""
    return depends_on == LAG or depends_on.startswith(PAST)


def find_past_signal(depends_on: str) -> str | None:
    """Return the signal on whose past a pair depends; None for another dependence."""
    return depends_on.removeprefix(PAST) if depends_on.startswith(PAST) else None


def answer(findings: Sequence[MachineFinding], unexplained: Sequence[str]) -> str:
    """Return the answer in one sentence; blocks are `unexplained` in which no candidate explains what is left."""
    left = " and ".join(f"“{block}”" for block in unexplained)
    where = f"is missing in the block{'s' * (len(unexplained) > 1)} {left}, and no law that was tried explains it"
    if not findings:
        return f"Something {where}" if left else NOTHING
    named = list_findings([_describe(finding, findings) for finding in findings])
    return f"Missing: {named}" + (f". Something more {where}" if left else "")


def _describe(finding: MachineFinding, findings: Sequence[MachineFinding]) -> str:
    others = tell_others(finding, findings, [rival.title for rival in finding.rivals])
    return (finding.title[0].lower() + finding.title[1:] + others
            + f", in the runs {list_findings([str(run) for run in finding.runs])} alone" * bool(finding.runs)
            + " (not confirmed by the simulation of the whole machine)" * (finding.confirmed is False))
