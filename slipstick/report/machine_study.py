"""The report of a study of a declared machine: answer, what to do, findings, parameters, gap and limitations."""

import math
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import MachineFinding, MachineParameter
from slipstick.machine_studies.study import law_table
from slipstick.pictures import units
from slipstick.pictures.machine_study import LEVEL, machine_pictures
from slipstick.pictures.study.law import headline, remarks
from slipstick.pictures.study.words import within
from slipstick.pictures.theme import Spec, captions
from slipstick.report import markup
from slipstick.report.shell import document, figures, home_of, provenance, tell_facts
from slipstick.report.study.glossary import explain
from slipstick.report.study.page import render_box, render_section
from slipstick.report.study.parts import Entries, Items, Note, Part, Picture, Section, Table
from slipstick.report.study.todo import TITLE, attach_laws, caution, describe_seen, find_weakest
from slipstick.report.study.words import between, many
from slipstick.report.words import listed
from slipstick.studies.record import from_dict

_LIMITS = (
    ("What is declared decides:", "a quantity that the machine does not name is not tested, and a parameter that is "
     "declared too tight or too loose may look like a law, or hide it."),
    ("No confidence is stated:", "rates were measured on two drawn machines (docs/engine.md), not on yours. Read the "
     "gain, the agreement of the runs, the rivals and the control."),
    ("Laws hold where runs have been:", "beyond the values that the runs visit, a law is constant."))

_WORSE = 1.2
"""Times the chi-square without findings above which a block is worse with them: by more than models leave of noise."""


def machine_study_page(study: Mapping[str, Any], output: Mapping[str, Any]) -> str:
    """Return the HTML page of a study; the arguments are those of `slipstick.report.study.page.study_page`."""
    result, specs = from_dict(MachineStudyResult, output["result"]), machine_study_specs(output)
    drawn, box = figures(specs, captions(specs)), advise(result)
    main = sections(result, drawn)
    return document("study", study["id"], result.sentence, warnings(result), [
        *(render_section(section, drawn) for section in (*main, explain([box, *main]))),
        provenance(study, output, [
            ("recordings", f"{study['recordings']}, SHA-256 {study['recordings_digest']}"),
            ("runs that count", str(result.runs)), ("settings digest", result.settings_digest),
            ("settings", "" if study["settings"] else "default")])],
        [markup.paragraph(tell_evidence(result), "lead"), render_box(box, drawn)],
        [tell_facts(study, [f"Machine {result.machine}", f"recordings {study['recordings']}", many(result.runs, "run")
                       + f", {len(result.set_aside)} more set aside" * bool(result.set_aside)])], home_of(study))


def machine_study_specs(output: Mapping[str, Any]) -> dict[str, Spec]:
    """Return the pictures of a study, name -> specification."""
    return machine_pictures(from_dict(MachineStudyResult, output["result"]),
                            from_dict(MachineFigures, output["figure_data"]))


def lead(result: MachineStudyResult) -> str:
    """Return by how much the findings close the gap; empty without a gap."""
    if result.gap is None:
        return ""
    return (f"With what was found, the simulation of the whole machine closes {_share(result.gap.closed)} of its gap "
            f"to the recordings; a wrong law, added as a control, closes {_share(result.gap.control_closed)}.")


def tell_evidence(result: MachineStudyResult) -> str:
    """Return how sure the answer is: no rates are known for machines."""
    if not result.findings:
        chi = [block.chi_square for block in result.blocks]
        return (f"{many(result.runs, 'run')} leave a reduced chi-square of {min(chi):.2f} to {max(chi):.2f} in the "
                "blocks of the model; 1 is expected if nothing is missing.")
    errors = listed([units.number(finding.errors) for finding in result.findings])
    control = "" if result.gap is None else f" A wrong law closes {_share(result.gap.control_closed)} of the gap."
    return (f"The runs agree about it by {errors} standard errors.{control} No confidence is stated: how often such "
            "findings are right is not measured for this machine.")


def _share(share: float) -> str:
    """A share in %: what is closed by chance beyond all of a gap is all of it."""
    return f"{100 * min(share, 1):.0f} %".replace("-", "−")


def advise(result: MachineStudyResult) -> Section:
    """Return what to do: for each finding, or where there is none."""
    several = len(result.findings) > 1
    parts: list[Part] = []
    for place, finding in enumerate(result.findings, 1):
        parts += _advise_finding(finding, f"{place}. " * several)
    entries: Entries = [] if result.findings else [_advise_without(result)]
    if any(finding.confirmed is not False for finding in result.findings):
        entries.append(("Take over as well:", "the parameters that the recordings determine, in the table "
                        "“Parameters”: they were fitted beside the findings."))
    if result.gap is not None:
        entries.append(("What it is worth:", lead(result)))
    entries += [("Next experiment:", text) for text in _list_next(result)]
    return Section(TITLE, [*parts, Items([*entries, *caution(warnings(result))])])


def _advise_finding(finding: MachineFinding, prefix: str) -> list[Part]:
    name, law = within(finding.title), finding.law
    what = "Do not add:" if finding.confirmed is False else "Add:"
    text = f"{name}. The simulation of the whole machine is no better with it." if finding.confirmed is False else \
        f"{name}: {finding.equation}." if finding.equation else f"{name}, as the measured law."
    if finding.rivals:
        text += f" Record first what tells it apart from {listed([within(rival.title) for rival in finding.rivals])}."
    entries: Entries = [(f"{prefix}{what}", text)]
    if law is not None:
        entries.append(("Measured:", f"{headline(finding, law)}."))
        if law.x is not None:
            entries.append(("Where it holds:", f"{describe_seen(finding, law)}. Beyond, the law is held constant."))
    parts: list[Part] = [Items(entries)]
    if finding.coefficients:
        head, rows = coefficient_table(finding)
        parts.append(Table(("set", "to", head[-1], "instead of"), [(*row, "not in the model") for row in rows],
                           words=(3,)))
    if law is not None and law.x is not None:
        parts += attach_laws([("The measured law as a file:", law_table(finding))])
    return parts


def _advise_without(result: MachineStudyResult) -> tuple[str, str]:
    if result.kind == "none":
        return "Keep the model:", "add nothing to it. Take over the parameters below that the recordings determine."
    left = [f"“{block.name}”" for block in result.blocks if block.unexplained]
    return "Do not change the model yet:", (f"something is missing in {listed(left)} that no candidate explains. Name "
                                            "further quantities there, and what they may depend on.")


def _list_next(result: MachineStudyResult) -> list[str]:
    if result.partial is not None:
        return ["repeat the study with a larger time budget."]
    if result.kind == "none":
        return ["none is needed. Before the model is used beyond these conditions, record a few runs there."]
    if not result.findings:
        return ["repeat the runs that are described worst (picture below), with one condition changed at a time."]
    return [text for finding in result.findings if (text := _describe_next(finding))]


def _describe_next(finding: MachineFinding) -> str:
    if finding.rivals:
        names = listed(list(dict.fromkeys([finding.depends_on, *(rival.depends_on for rival in finding.rivals)])))
        return f"runs in which {names} do not change together."
    return "" if finding.law is None else within(find_weakest(finding, finding.law))


def warnings(result: MachineStudyResult) -> Entries:
    """Return what limits the answer of this study, before anything else."""
    entries: Entries = [] if result.partial is None else [result.partial.warning]
    if result.set_aside:
        entries.append((f"Set aside: run{'s' * (len(result.set_aside) > 1)} "
                        f"{listed([str(run) for run in result.set_aside])},",
                        "numbered from 0. Each is far worse than all others and is not used: look at its signals."))
    entries += [(f"Unexplained: block “{block.name}”.", f"Reduced chi-square is {block.chi_square:.2f} with all "
                 "findings, and no candidate explains the rest. Findings and intervals may be off.")
                for block in result.blocks if block.unexplained]
    entries += [(f"Not converged: block “{block.name}”.", "The fit ended before its optimum, so that what is left, its "
                 "parameters and its findings may be those of the fit. Equations that are steep about a value, such as "
                 "the tanh of a speed, are a usual cause: declare the state among `switches`, and read its side.")
                for block in result.blocks if not block.converged]
    entries += [(f"Worse with the findings: block “{block.name}”.", f"Its reduced chi-square is {block.before:.2f} "
                 f"without them, and {block.chi_square:.2f} with them: findings in blocks that give what it reads "
                 "explain their signals badly.")
                for block in result.blocks if result.findings and block.chi_square > _WORSE * block.before]
    entries += [("Not told apart:", f"{finding.title}, and {listed([rival.title for rival in finding.rivals])}.")
                for finding in result.findings if finding.rivals]
    beyond = [each.name for each in result.parameters if each.beyond]
    if beyond:
        entries.append(("Outside of what is declared:", f"{listed(beyond)}. A declaration that is too tight may look "
                        "like a law, or hide it; or something is missing that the parameter stands for."))
    if result.gap is not None and not result.gap.converged:
        entries.append(("Not converged:", "a fit of the whole machine. The gap may be off."))
    if result.gap is not None and result.gap.control_closed > result.gap.closed / 2 > 0:
        entries.append(("The control closes much of the gap as well:", "that the gap closes is little support for the "
                        "findings."))
    return entries


def sections(result: MachineStudyResult, pictures: Collection[str]) -> list[Section]:
    """Return the sections of the report. `pictures` are those for which there are data."""
    several = len(result.findings) > 1
    return [Section("Measured and simulated", _show("overlay", pictures)),
            Section("The measured laws" if several else "The measured law", _show("law", pictures)),
            *(Section(f"Finding {place}: {finding.title}" if several else f"Finding: {finding.title}",
                      _describe(finding)) for place, finding in enumerate(result.findings, 1)),
            _describe_gap(result), _list_parameters(result), _list_blocks(result),
            Section("The runs that are described worst", _show("signals", pictures)),
            Section("Limitations", [Items(list(_LIMITS))])]


def _show(name: str, pictures: Collection[str]) -> list[Part]:
    return [Picture(name)] if name in pictures else []


def _describe(finding: MachineFinding) -> list[Part]:
    entries: Entries = []
    if finding.law is not None:
        entries.append(("Law:", f"{headline(finding, finding.law)}. {remarks(finding.law, LEVEL, is_drawn=False)}"))
    if finding.equation is not None:
        entries.append(("Equation:", f"{finding.equation}."))
    entries.append(("Evidence:", f"a gain of {units.number(finding.nats, 4)} nats in log marginal likelihood "
                    f"(natural logarithm: {units.number(finding.nats / math.log(10))} factors of ten), about which the "
                    f"runs agree by {units.number(finding.errors)} standard errors, in "
                    f"{listed([f'“{block}”' for block in finding.blocks])}."))
    if finding.kind is None:
        entries.append(("Kind:", "none of the known ones explains the law as well as it was measured."))
    parts: list[Part] = [Items(entries)]
    if finding.coefficients:
        parts.append(Table(*coefficient_table(finding)))
    return parts


def coefficient_table(finding: MachineFinding) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of a table of the coefficients of a finding."""
    rows: list[tuple[str, ...]] = [
        (each.name, units.with_unit(units.fixed(each.value, 4), units.raised(each.unit)),
         units.with_unit(between(each.lower, each.upper), units.raised(each.unit))) for each in finding.coefficients]
    return (finding.kind or "", "value", "95 % interval"), rows


def _describe_gap(result: MachineStudyResult) -> Section:
    gap = result.gap
    if gap is None:
        return Section("The gap of the whole machine", [])
    rows: list[tuple[str, ...]] = [
        ("without the findings", units.number(gap.before, 3), ""),
        ("with the findings", units.number(gap.after, 3), _share(gap.closed)),
        (f"with the control: {gap.control}", units.number(gap.before * (1 - gap.control_closed), 3),
         _share(gap.control_closed))]
    return Section("The gap of the whole machine", [
        Table(("simulation of the whole machine", "squares beyond noise", "closed"), rows),
        Note("Driven by commands and conditions alone. Of each run, by laws and parameters of all others. The "
             f"findings gain {units.number(gap.nats, 4)} nats, about which the runs agree by "
             f"{units.number(gap.errors)} standard errors.")])


def _list_parameters(result: MachineStudyResult) -> Section:
    head, rows = parameter_table(result.parameters)
    return Section("Parameters", [Table(head, rows, words=(4,))] if rows else [])


def parameter_table(parameters: Iterable[MachineParameter]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of a table of parameters."""
    rows: list[tuple[str, ...]] = [
        (each.name, units.with_unit(units.fixed(each.value, 4), units.raised(each.unit)),
         between(each.lower, each.upper), units.number(each.scatter, 2),
         "outside of what is declared" if each.beyond else "" if each.determined else "not determined")
        for each in parameters]
    return ("parameter", "mean", "95 % interval", "scatter between runs", "remark"), rows


def _list_blocks(result: MachineStudyResult) -> Section:
    rows: list[tuple[str, ...]] = [
        (block.name, block.signals, f"{block.before:.2f}", f"{block.chi_square:.2f}",
         "unexplained" if block.unexplained else "") for block in result.blocks]
    head = ("block", "reads → gives", "without findings", "with", "remark")
    return Section("Blocks", [Table(head, rows, words=(1, 4)), Note("Median over the runs of the reduced chi-square: 1 "
                                                                    "if only noise is left.")])
