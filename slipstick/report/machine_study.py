"""The report of a study of a declared machine: answer, findings, parameters, blocks, gap, signals and limitations."""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import MachineFinding, MachineParameter
from slipstick.pictures import units
from slipstick.pictures.machine_study import CAPTIONS, LEVEL, machine_pictures
from slipstick.pictures.study.law import headline, remarks
from slipstick.pictures.theme import Spec
from slipstick.report import markup
from slipstick.report.shell import document, figures, provenance
from slipstick.report.study.page import render_section
from slipstick.report.study.parts import Entries, Items, Note, Part, Picture, Section, Table
from slipstick.report.study.words import between, many
from slipstick.report.words import listed
from slipstick.studies.record import from_dict

_LIMITS = (
    ("What is declared decides:", "a quantity that the machine does not name is not tested, and a parameter that is "
     "declared too tight or too loose may look like a law, or hide it."),
    ("No confidence is stated:", "rates were measured on two drawn machines (docs/engine.md), not on yours. Read the "
     "gain, the agreement of the runs, the rivals and the control."),
    ("Laws hold where runs have been:", "beyond the values that the runs visit, a law is constant."))


def machine_study_page(study: Mapping[str, Any], output: Mapping[str, Any]) -> str:
    """Return the HTML page of a study; the arguments are those of `slipstick.report.study.page.study_page`."""
    result = from_dict(MachineStudyResult, output["result"])
    drawn = figures(machine_study_specs(output), CAPTIONS)
    return document("study", study["id"], result.sentence, warnings(result), [
        markup.paragraph(lead(result), "lead"),
        *(render_section(section, drawn) for section in sections(result, drawn)),
        provenance(study, output, [
            ("machine", result.machine),
            ("recordings", f"{study['recordings']}, SHA-256 {study['recordings_digest']}"),
            ("runs that count", str(result.runs)), ("settings digest", result.settings_digest),
            ("settings", "" if study["settings"] else "default")])])


def machine_study_specs(output: Mapping[str, Any]) -> dict[str, Spec]:
    """Return the pictures of a study, name -> specification."""
    return machine_pictures(from_dict(MachineStudyResult, output["result"]),
                            from_dict(MachineFigures, output["figure_data"]))


def lead(result: MachineStudyResult) -> str:
    """Return what was studied, and by how much the findings close the gap."""
    studied = f"{many(result.runs, 'run')} of the machine “{result.machine}” were studied."
    if result.gap is None:
        return studied
    return (f"{studied} With what was found, the simulation of the whole machine closes "
            f"{100 * result.gap.closed:.0f} % of its gap to the recordings; a wrong law, added as a control, closes "
            f"{100 * result.gap.control_closed:.0f} %.")


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
    return [Section("The measured laws" if several else "The measured law", _show("law", pictures)),
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
    entries.append(("Evidence:", f"a gain of {units.number(finding.nats, 4)} nats in log marginal likelihood, about "
                    f"which the runs agree by {units.number(finding.errors)} standard errors, in "
                    f"{listed([f'“{block}”' for block in finding.blocks])}."))
    if finding.kind is None:
        entries.append(("Kind:", "none of the known ones explains the law as well as it was measured."))
    parts: list[Part] = [Items(entries)]
    if finding.coefficients:
        rows: list[tuple[str, ...]] = [
            (each.name, units.with_unit(units.fixed(each.value, 4), units.raised(each.unit)),
             units.with_unit(between(each.lower, each.upper), units.raised(each.unit)))
            for each in finding.coefficients]
        parts.append(Table((finding.kind or "", "value", "95 % interval"), rows))
    return parts


def _describe_gap(result: MachineStudyResult) -> Section:
    gap = result.gap
    if gap is None:
        return Section("The gap of the whole machine", [])
    rows: list[tuple[str, ...]] = [
        ("without the findings", units.number(gap.before, 3), ""),
        ("with the findings", units.number(gap.after, 3), f"{100 * gap.closed:.0f} %"),
        (f"with the control: {gap.control}", units.number(gap.before * (1 - gap.control_closed), 3),
         f"{100 * gap.control_closed:.0f} %")]
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
