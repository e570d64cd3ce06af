"""What limits the answer of this study, stated before anything else."""

from slipstick.pictures.conditions import Columns, described
from slipstick.pictures.study.words import effect_title, name_candidate, within
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import number
from slipstick.report.study.parts import Entries
from slipstick.report.study.words import MISFIT
from slipstick.report.words import listed
from slipstick.studies.result import WITHIN, Control, FindingResult, Gap, Remainder, StudyResult
from slipstick.studies.words import engagements

_CONTROL = 0.5
"""Share of the closure by the findings from which on the control casts doubt on it."""


def warnings(result: StudyResult, aside: Columns | None = None) -> Entries:
    """All warnings of a result; none is good. `aside` are the conditions of the engagements that were set aside."""
    entries: Entries = [] if result.partial is None else [result.partial.warning]
    if result.closed:
        missing = dict.fromkeys(name for block in result.closed for name in block.missing)
        entries.append((f"Not measured: {listed([in_words(name) for name in missing])}.",
                        f"{listed([f'“{block.signals}”' for block in result.closed])} could not be tested. "
                        + ("What is missing there is not found, or appears as a finding of another block."
                           if result.blocks else "The answer is that of the simulation of the whole bench alone.")))
    if result.unused_channels:
        entries.append((f"Not used: {listed(result.unused_channels)}.",
                        "In at least one engagement it has no value up to lock-up, so that no law over it was tried."))
    if result.set_aside:
        names = [f"{place} ({described(aside, row)})" if aside else str(place)
                 for row, place in enumerate(result.set_aside)]
        entries.append((f"Set aside: engagement{'s' * (len(names) > 1)} {listed(names)},",
                        "numbered from 0. Each is far worse than all others in some block and is not used. Look at "
                        "its signals: an effect depends on the conditions and acts on many engagements."))
    entries += [(f"Unexplained: “{block.signals}”.", f"Reduced chi-square is {block.chi_square:.2f} with all "
                 "findings, and no law that was tried explains the rest. The findings and their intervals may be off.")
                for block in result.blocks if block.unexplained]
    entries += [(f"Far worse than the others: {engagements(block.outlying)} in “{block.signals}”,",
                 "numbered from 0, and yet used: too many others are set aside, or the difference shows only beside "
                 "the findings. Look at the signals: either the recording is bad, or an effect acts on few "
                 "engagements, and no law that was tried follows it.") for block in result.blocks if block.outlying]
    entries += [_warn_of_remainder(remainder, result) for remainder in result.remainders]
    for finding in result.findings:
        entries += _warn_of_finding(finding, len(result.findings) > 1)
    return entries + _warn_of_simulation(result) + _warn_of_gap(result)


def _warn_of_remainder(remainder: Remainder, result: StudyResult) -> tuple[str, str]:
    """What a finding may leave."""
    blocks = [f"“{block.signals}”" for block in result.blocks if block.name in remainder.blocks]
    return (f"Left over: {within(remainder.title)}?",
            f"Beside the findings it would explain {remainder.nats:.0f} nats in {listed(blocks or ['?'])}. Only "
            f"{remainder.counted.right} of {remainder.counted.of} such findings were right on simulated benches: more "
            "likely a law that was found does not follow its cause everywhere. It is neither named nor simulated.")


def _warn_of_finding(finding: FindingResult, has_others: bool) -> Entries:
    """Warnings of a finding that may be one of several."""
    entries: Entries = []
    others = [name_candidate(other) for other in finding.rivals]
    others += [within(effect_title(other.rival)) for other in finding.experiments]
    if others or finding.kind == "tie":
        rest = listed(list(dict.fromkeys(others))) if others else "another effect of the same quantity and dependence"
        entries.append(("Not told apart:", f"the recordings do not tell {within(finding.title)} from {rest}."))
    if finding.confirmation.agrees is False:
        entries.append(("Not confirmed:", f"the simulation of the whole bench does not support {within(finding.title)}"
                        f"{' in addition to the other findings' * has_others}. It is not part of the extended model. "
                        "The confidence is that of findings of the blocks, whether they are confirmed or not."))
    if finding.confirmation.simulated == "no":
        entries.append(("Not simulated:", f"the simulation does not have the {finding.quantity} in dependence on "
                        f"“{finding.depends_on}”, so the only evidence for {within(finding.title)} is that of its "
                        "blocks."))
    at_bound = [in_words(coefficient.name) for coefficient in finding.confirmation.coefficients if coefficient.at_bound]
    if at_bound:
        entries.append(("At a bound:", f"{listed(at_bound)} of {within(finding.title)}. The interval has no meaning, "
                        "and the formula may be the wrong one."))
    if finding.law is not None and finding.law.linearised:
        entries.append(("Rough band:", f"the law of {within(finding.title)} comes from the closing piston. Its "
                        "interval is that of a linear model and may be several times too narrow."))
    return entries


def _warn_of_simulation(result: StudyResult) -> Entries:
    """Whether the fits converged, and signals in which the simulation leaves more than noise."""
    entries: Entries = []
    if result.after is None:
        return entries
    if not result.after.converged:
        entries.append(("Not converged:", "the fit of the simulation did not converge within its iterations. "
                        "Coefficients and the log-likelihood may be off."))
    misfits = [f"{number(value)} in the {in_words(name)}" for name, value in result.after.chi_square.items()
               if value > MISFIT]
    if misfits:
        entries.append(("The simulation leaves more than noise:", f"reduced chi-square is {listed(misfits)}. "
                        "Coefficients and their intervals are biased by what is missing there."))
    return entries


def _warn_of_gap(result: StudyResult) -> Entries:
    """Whether predictions improve, and whether the control does as well."""
    if result.gap is None:
        return []
    time, control = result.gap.closures["shifting_time"], result.gap.control
    if time.rms_after > max(time.rms_before, time.rms_expected):  # less than that may be the scatter of the parameters
        return [("Shifting times are predicted worse:", "on held-out conditions the error grows with the findings.")]
    for name, words in (("shifting_time", "in the shifting time"), (WITHIN, "within engagements")):
        own, other = _share(result.gap, name), None if control is None else _share(control, name)
        if control is None or own is None or other is None or other < _CONTROL * own:
            continue
        effect = within(effect_title(control.effect))
        return [("The control closes much of the gap as well:", f"{effect}, which acts on another quantity, closes "
                 f"{100 * other:.0f} % of the gap {words}, the findings {100 * own:.0f} %. That the gap closes is "
                 "little support for the name.")]
    return []


def _share(of: Gap | Control, name: str) -> float | None:
    """The share that is closed of a gap, which results of earlier versions may not have."""
    return of.closures[name].closure if name in of.closures else None
