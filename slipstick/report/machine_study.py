"""The report of a study of a declared machine: answer, what to do, findings, parameters, gap and limitations."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import (
    MachineBlock,
    MachineFinding,
    MachineGap,
    MachineParameter,
    Rival,
    StatedCondition,
)
from slipstick.machine_studies.study import law_table
from slipstick.machine_studies.words import find_past_signal, is_memory, name_run
from slipstick.pictures import units
from slipstick.pictures.machine_study import LEVEL, machine_pictures
from slipstick.pictures.study.law import describe_change, headline, remarks
from slipstick.pictures.study.words import argument, subject, within
from slipstick.pictures.theme import Spec, captions
from slipstick.report import markup
from slipstick.report.doubts import LARGE_CHI_SQUARE
from slipstick.report.shell import document, figures, home_of, provenance, tell_facts
from slipstick.report.study.findings import tell_distance
from slipstick.report.study.glossary import explain
from slipstick.report.study.page import render_box, render_section
from slipstick.report.study.parts import Entries, Items, Note, Part, Section, Table, show
from slipstick.report.study.simulation import NOT_DETERMINED
from slipstick.report.study.todo import (
    TITLE,
    attach_laws,
    caution,
    check_channels,
    describe_seen,
    find_weakest,
    say_take_over,
)
from slipstick.report.study.words import between, digits_between, many
from slipstick.report.words import listed
from slipstick.studies.finding import Coefficient, Paired
from slipstick.studies.record import from_dict

_LIMITS = (
    ("What is declared decides:", "a quantity that the machine does not name is not tested, and a parameter that is "
     "declared too tight or too loose may look like a law, or hide it."),
    ("No confidence is stated:", "rates were measured on two drawn machines (docs/engine.md), not on yours. Read the "
     "gain, the agreement of the runs, the rivals and the control."),
    ("Laws hold where runs have been:", "beyond the values that the runs visit, a law is constant."))

_NO_GAP = ("There is no gap that it could close: the simulation of the whole machine, which reads no signal that it "
           "gives, leaves no more than noise without it as well.")
_FEW = 12
"""Runs below which it is said that they are few."""
_BEYOND = "outside of what is declared"
_WORSE = 1.2
"""Times the chi-square without findings above which a block is worse with them: by more than models leave of noise."""


def machine_study_page(study: Mapping[str, Any], output: Mapping[str, Any]) -> str:
    """Return the HTML page of a study; the arguments are those of `slipstick.report.study.page.study_page`."""
    result, specs = from_dict(MachineStudyResult, output["result"]), machine_study_specs(output)
    drawn, box = figures(specs, captions(specs)), advise(result)
    main = sections(result, drawn)
    return document("study of", study["recordings"], result.sentence, warnings(result), [
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
    gap = result.gap
    if gap is None:
        return ""
    if gap.before <= 0:
        return _NO_GAP
    if gap.closed is None:
        return ("How much of its gap to the recordings the simulation of the whole machine closes with what was found "
                "is not known: a fit of it did not converge.")
    control = "the fit with a wrong law, added as a control, did not converge" if gap.control_closed is None else \
        f"a wrong law, added as a control, closes {_share(gap.control_closed)}"
    return (f"With what was found, the simulation of the whole machine closes {_share(gap.closed)} of its gap "
            f"to the recordings; {control}.")


def tell_evidence(result: MachineStudyResult) -> str:
    """Return how sure the answer is: no rates are known for machines."""
    if not result.findings:
        chi = [block.chi_square for block in result.blocks]
        lowest, highest = f"{min(chi):.2f}", f"{max(chi):.2f}"
        reached = lowest if lowest == highest else f"{lowest} to {highest}"
        return (f"{many(result.runs, 'run')} leave a reduced chi-square of {reached} in "
                f"{many(len(result.blocks), 'block')} of the model; 1 is expected if nothing is missing.")
    errors = listed([units.number(finding.errors) for finding in result.findings])
    return (f"{_tell_sure(result)}The runs agree about it by {errors} standard errors.{_tell_closed(result.gap)} No "
            "confidence is stated: how often such findings are right is not measured for this machine.")


def _tell_closed(gap: MachineGap | None) -> str:
    if gap is None:
        return ""
    if gap.before <= 0:
        return f" {_NO_GAP}"
    if gap.closed is None:
        return " How much of the gap it closes is not known: a fit of the whole machine did not converge."
    control = "; the fit with a wrong law did not converge" if gap.control_closed is None else \
        f", a wrong law {_share(gap.control_closed)}"
    return f" What was found closes {_share(gap.closed)} of the gap{control}."


def _tell_sure(result: MachineStudyResult) -> str:
    """Return which findings are sure and why others are not; empty where all are sure."""
    reasons = [_list_reasons(finding, result) for finding in result.findings]
    if not any(reasons):
        return ""
    if len(reasons) == 1:
        return f"This is not sure: {listed(reasons[0])}. "
    sure = [str(place) for place, each in enumerate(reasons, 1) if not each]
    doubtful = "; ".join(f"finding {place} ({listed(each)})" for place, each in enumerate(reasons, 1) if each)
    named = f"finding{'s' * (len(sure) > 1)} {listed(sure)}" if sure else "none of the findings"
    return f"Sure: {named}. Not sure: {doubtful}. "


def _list_reasons(finding: MachineFinding, result: MachineStudyResult) -> list[str]:
    """Return why a finding is not sure."""
    own = [block for block in result.blocks if block.name in finding.blocks]
    reasons = [("not told apart", bool(finding.rivals)),
               ("not confirmed", finding.confirmed is False),
               *((f"“{block.name}” leaves more than noise", _leaves_much(block)) for block in own),
               *((f"“{block.name}” not converged", not block.converged) for block in own)]
    return [reason for reason, is_so in reasons if is_so]


def _share(share: float) -> str:
    """A share in %: what is closed by chance beyond all of a gap is all of it."""
    return f"{100 * min(share, 1):.0f} %".replace("-", "−")


def advise(result: MachineStudyResult) -> Section:
    """Return what to do: for each finding, or where there is none."""
    parts: list[Part] = []
    several = len(result.findings) > 1
    for place, finding in enumerate(result.findings, 1):
        parts += (_advise_runs if finding.runs else _advise_finding)(finding, result, f"{place}. " * several)
    if not result.findings:
        parts.append(Items([_advise_without(result)]))
    entries: Entries = []
    general = [finding for finding in result.findings if not finding.runs]
    is_taken = result.kind == "none" or any(finding.confirmed is not False for finding in result.findings)
    if is_taken and not any(_leaves_much(block) or not block.converged for block in result.blocks):
        rows: list[tuple[str, ...]] = [(each.name, *_state_value(each), _declared(each))
                                       for each in result.parameters if _is_changed(each)]
        text = "these parameters, whose intervals exclude what is declared. The table “Parameters” has the others." if \
            rows else "no parameter: the intervals of all that the recordings determine contain what is declared."
        parts.append(Items([(say_take_over(len(general)), text)]))
        parts += [_new_values(rows)] if rows else []
    if result.gap is not None:
        entries.append(("What it is worth:", lead(result)))
    if result.findings or result.kind == "none":
        entries += _describe_where(result)
    entries += [("Next experiment:", text) for text in _list_next(result)]
    return Section(TITLE, [*parts, Items([*entries, *caution(warnings(result))])])


def _advise_finding(finding: MachineFinding, result: MachineStudyResult, prefix: str) -> list[Part]:
    name, law = within(finding.title), finding.law
    if finding.confirmed is False:
        what, text = "Do not add:", f"{name}. The simulation of the whole machine is no better with it."
    else:
        is_early, of_sensor = bool(_list_reasons(finding, result)), subject(finding) != finding.quantity
        is_by_hand = law is None and finding.equation is None
        what = ("Do not correct yet:" if is_early else "Correct or model:") if of_sensor else (
            "Do not add yet:" if is_early else "Add by hand:" if is_by_hand else "Add:")
        text = f"{name}: the recordings show it, and no equation of it is known." if is_by_hand else \
            f"{name}, as the measured law." if finding.equation is None else \
            f"{name}: {units.raised(finding.equation)}{_describe_zero(finding)}."
        if of_sensor:
            text += " Correct the sensor or its channel in the recordings, or add the error to the model."
        own = [block for block in result.blocks if block.name in finding.blocks]
        doubtful = [f"“{block.name}”" for block in own if _leaves_much(block)]
        unsettled = [f"“{block.name}”" for block in own if not block.converged]
        if doubtful:
            text += f" With it, {listed(doubtful)} still leave{'s' * (len(doubtful) == 1)} more than noise: what is " \
                "missing may be something else."
        if unsettled:
            text += f" The fit of {listed(unsettled)} has not converged."
    if finding.rivals:
        text += f" Record first what tells it apart from {listed([within(rival.title) for rival in finding.rivals])}."
    entries: Entries = [(f"{prefix}{what}", text)]
    if law is not None:
        by_equation = "" if law.formula is None or law.x is None else \
            f" The equation gives {describe_change(law, law.formula)[0]} there."
        entries.append(("Measured:", f"{headline(finding, law)}.{by_equation}"))
    parts: list[Part] = [Items(entries)]
    if finding.coefficients:
        parts.append(_new_values([(*row, "not in the model") for row in coefficient_table(finding)[1]]))
    if law is not None and law.x is not None:
        parts += attach_laws([("The measured law as a file:", law_table(finding))])
    return parts


def _advise_runs(finding: MachineFinding, result: MachineStudyResult, prefix: str) -> list[Part]:
    """Return what to do about a finding in a few runs: the model is right for all others."""
    runs = listed([name_run(run, result.run_names) for run in finding.runs])
    entries: Entries = [(f"{prefix}Find out what differs in these runs:", f"{runs}. {finding.title} makes them like "
                         "all others, which are explained without it: do not add it to the model of these.")]
    if finding.law is not None:
        entries.append(("Measured:", f"{headline(finding, finding.law)}."))
    return [Items(entries)]


def _new_values(rows: list[tuple[str, ...]]) -> Table:
    return Table(("set", "to", f"{100 * LEVEL:.0f} % interval", "instead of"), rows, words=(3,))


def _describe_zero(finding: MachineFinding) -> str:
    """Return where an equation that is known up to a constant is 0 beside the stated parameters; empty elsewhere."""
    law = finding.law
    if law is None or law.x is None or law.formula is None or law.up_to != "constant":
        return ""
    for place, (here, there) in enumerate(pairwise(law.formula)):
        if here * there <= 0 and here != there:
            zero = law.x[place] + (law.x[place + 1] - law.x[place]) * here / (here - there)
            unit, factor = units.scale(law.x_unit, max(map(abs, law.x)))
            return (f"; beside the parameters of this report, it is 0 where the {argument(finding)} is "
                    f"{units.with_unit(units.number(factor * zero), unit)}")
    return ""


def _describe_where(result: MachineStudyResult) -> Entries:
    laws = [describe_seen(finding, finding.law) for finding in result.findings if finding.law is not None]
    seen = [units.with_unit(f"{name} {units.number(low, 4)}" + f" to {units.number(high, 4)}" * (high > low),
                            units.raised(result.units.get(name, ""))) for name, (low, high) in result.seen.items()]
    ranges = "; ".join([*dict.fromkeys(filter(None, laws)), *([listed(seen)] if seen else [])])
    held = " Beyond, a law is held constant, and all else is extrapolated." if any(laws) else \
        " Beyond, it is extrapolated."
    return [("Where it holds:", f"{ranges}: what was recorded.{held}")] if ranges else []


def _is_changed(parameter: MachineParameter) -> bool:
    """Whether what is declared is outside of the interval of a parameter that the recordings determine."""
    return (parameter.declared is not None and parameter.determined and not parameter.beyond
            and not parameter.lower <= parameter.declared <= parameter.upper)


def _is_worse(block: MachineBlock) -> bool:
    return block.chi_square > _WORSE * block.before


def _leaves_much(block: MachineBlock) -> bool:
    return block.unexplained or _is_worse(block) or block.chi_square > LARGE_CHI_SQUARE


def _advise_without(result: MachineStudyResult) -> tuple[str, str]:
    if result.kind == "none":
        return "Keep the model:", "add nothing to it."
    left = [f"“{block.name}”" for block in result.blocks if block.unexplained]
    return "Do not change the model yet:", (f"something is missing in {listed(left)} that no candidate explains. Name "
                                            "further quantities there, and what they may depend on.")


def _list_next(result: MachineStudyResult) -> list[str]:
    doubtful = [check_channels(f"{block.name}: {block.signals}") for block in result.blocks if _leaves_much(block)]
    off = [f"measure the {each.name} in each run: what is stated is off by more than is declared."
           for each in result.conditions]
    return [*doubtful, *off, *([] if off and result.kind == "none" else _list_runs(result))]


def _list_runs(result: MachineStudyResult) -> list[str]:
    if result.partial is not None:
        return ["repeat the study with a larger time budget."]
    if result.kind == "none":
        return ["none is needed. Before the model is used beyond these conditions, record a few runs there."]
    if not result.findings:
        return ["repeat the runs that are described worst (picture below), with one condition changed at a time."]
    return list(dict.fromkeys(text for finding in result.findings for text in _describe_next(finding)))


def _describe_next(finding: MachineFinding) -> Iterator[str]:
    if finding.runs:
        yield (f"repeat the runs {listed([str(run) for run in finding.runs])} with the same commands and conditions: "
               "does it come back?")
        return
    pairs: list[Paired] = [finding, *finding.rivals]
    if not finding.rivals:
        if finding.law is not None and (weakest := find_weakest(finding, finding.law)):
            yield within(weakest)
        return
    names = list(dict.fromkeys(pair.depends_on for pair in pairs if not is_memory(pair.depends_on)))
    quantities = list(dict.fromkeys(pair.quantity for pair in pairs if pair.depends_on in names))
    if len(names) > 1:
        yield f"runs in which {listed(names)} do not change together."
    elif len(quantities) > 1:
        yield (f"runs over the {names[0]} alone do not tell {listed(quantities)} apart. Change another condition that "
               "acts on a single one of them, or measure closer to it.")
    for signal in dict.fromkeys(signal for pair in pairs if (signal := find_past_signal(pair.depends_on))):
        yield f"a step of the {signal} while all else is held."


def warnings(result: MachineStudyResult) -> Entries:
    """Return what limits the answer of this study, before anything else."""
    entries: Entries = [] if result.partial is None else [result.partial.warning]
    entries += [("Doubtful recordings:", f"{doubt}.") for doubt in result.doubts]
    if result.runs < _FEW:
        entries.append((f"Few runs: {result.runs}.", "What is named must show in runs that agree, so that more may be "
                        "missing than so few can tell. Record some 20 to 60 that differ in commands and conditions."))
    explained = {run for finding in result.findings for run in finding.runs}
    if bad := [name_run(run, result.run_names) for run in result.set_aside if run not in explained]:
        entries.append((f"Set aside: run{'s' * (len(bad) > 1)} {listed(bad)},", "numbered from 0: far worse than all "
                        "others and not used" + ", and not explained by what explains others of these" * bool(explained)
                        + ". Look at the signals."))
    entries += [(f"Unexplained: block “{block.name}”.", f"Reduced chi-square is {block.chi_square:.2f} with all "
                 "findings, and no candidate explains the rest. Findings and intervals may be off.")
                for block in result.blocks if block.unexplained]
    unsettled = [block for block in result.blocks if not block.converged]
    smooth = [f"“{block.name}”" for block in unsettled if not block.switches]
    if unsettled:
        entries.append((
            f"Not converged: block{'s' * (len(unsettled) > 1)} {listed([f'“{block.name}”' for block in unsettled])}.",
            "The fit ended before its optimum: what is left, its parameters and its findings may be those of the fit."
            + (f" Equations that are steep about a value, such as the tanh of a speed, are a usual cause: if "
               f"{listed(smooth)} {'have' if len(smooth) > 1 else 'has'} any, declare the state among `switches`, and "
               "read its side." if smooth else "")))
    entries += [(f"Worse with the findings: block “{block.name}”.", f"Its reduced chi-square is {block.before:.2f} "
                 f"without them, and {block.chi_square:.2f} with them: findings in blocks that give what it reads "
                 "explain their signals badly.") for block in result.blocks if result.findings and _is_worse(block)]
    entries += [("Not told apart:", f"{within(finding.title)}, and "
                 f"{listed([within(rival.title) for rival in finding.rivals])}.")
                for finding in result.findings if finding.rivals]
    switching = {name for block in result.blocks for name in block.switches}
    entries += [(f"Dry friction: {within(finding.title)}.",
                 f"If {finding.depends_on} is a state that may come to rest, declare it among the `switches` of its "
                 "block, and study again: without that it is not held at rest, and the form about 0 may be off.")
                for finding in result.findings
                if (finding.kind or "").endswith("friction") and finding.depends_on not in switching]
    beyond = [each.name for each in result.parameters if each.beyond]
    if beyond:
        entries.append(("Outside of what is declared:", f"{listed(beyond)}. A declaration that is too tight may look "
                        "like a law, or hide it; or something is missing that the parameter stands for."))
    if result.conditions:
        entries.append(("Stated conditions outside of what is declared:",
                        f"{'; '.join(map(state_condition, result.conditions))}. Measure them in the runs, or declare "
                        "how far they may be off: a law may look like such an error, or hide in it."))
    if result.gap is not None and not result.gap.converged:
        entries.append(("Not converged:", "a fit of the whole machine. Whether it confirms the findings is not sure."))
    if result.gap is not None and result.gap.control_closed is not None and result.gap.closed is not None \
            and result.gap.control_closed > result.gap.closed / 2 > 0:
        entries.append(("The control closes much of the gap as well:", "that the gap closes is little support for the "
                        "findings."))
    return entries


def sections(result: MachineStudyResult, pictures: Collection[str]) -> list[Section]:
    """Return the sections of the report. `pictures` are those for which there are data."""
    several = len(result.findings) > 1
    return [Section("Measured and simulated", show("overlay", pictures)),
            Section("The measured laws" if several else "The measured law", show("law", pictures)),
            *(Section(f"Finding{f' {place}' * several}: {within(finding.title)}", _describe(finding))
              for place, finding in enumerate(result.findings, 1)),
            _describe_gap(result),
            Section("Parameters", [tabulate_parameters(result.parameters)] if result.parameters else []),
            _list_blocks(result),
            Section("The runs that are described worst", show("signals", pictures)),
            Section("Limitations", [Items(list(_LIMITS))])]


def _describe(finding: MachineFinding) -> list[Part]:
    entries: Entries = []
    if finding.law is not None:
        law = f"{headline(finding, finding.law)}. {remarks(finding.law, LEVEL, is_drawn=False)}"
        entries.append(("Law:", law.strip()))
    if finding.equation is not None:
        entries.append(("Equation:", f"{units.raised(finding.equation)}{_describe_zero(finding)}."))
    if finding.runs:
        entries.append(("Where:", f"in the runs {listed([str(run) for run in finding.runs])} alone, which are set "
                        "aside. Parameters and their scatter are those that all other runs tell, and with the law, "
                        "these runs are described as well as the others."))
    entries.append(("Evidence:", f"a gain of {units.number(finding.nats, 4)} nats in log marginal likelihood "
                    f"(natural logarithm: {units.number(finding.nats / math.log(10))} factors of ten), about which the "
                    f"runs agree by {units.number(finding.errors)} standard errors, in "
                    f"{listed([f'“{block}”' for block in finding.blocks])}."))
    if finding.rivals:
        entries.append(("Rivals:", f"{listed([_describe_rival(rival) for rival in finding.rivals])}. The recordings do "
                        "not tell these apart from it."))
    elif finding.next_best is not None:
        entries.append(("Rivals:", "no other pair that was fitted in full is close. The next best is "
                        f"{_describe_rival(finding.next_best)}."))
    if finding.kind is None:
        entries.append(("Kind:", "none of the known ones explains the law as well as it was measured."))
    parts: list[Part] = [Items(entries)]
    if finding.coefficients:
        parts.append(Table(*coefficient_table(finding)))
    return parts


def _describe_rival(rival: Rival) -> str:
    name = within(rival.title)
    if rival.nats is None or rival.behind is None:
        return name
    return f"{name} ({units.number(rival.nats, 4)} nats, {tell_distance(rival.behind)})"


def coefficient_table(finding: MachineFinding) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of a table of the coefficients of a finding."""
    rows: list[tuple[str, ...]] = [
        (each.name, *_state_value(_rescale(each), ", contains 0" * (each.lower <= 0 <= each.upper),
                                  each.lower == each.upper))  # a shape of a grid that leads all others
        for each in finding.coefficients]
    return (finding.kind or "", "value", "95 % interval"), rows


def _rescale(coefficient: Coefficient) -> Coefficient:
    """Return a coefficient in the unit that suits its size, such as a lag in ms."""
    unit, factor = units.scale(coefficient.unit, coefficient.value)
    return replace(coefficient, unit=unit, value=factor * coefficient.value, lower=factor * coefficient.lower,
                   upper=factor * coefficient.upper)


def _state_value(estimate: Coefficient | MachineParameter, remark: str = "",
                 at_bound: bool = False) -> tuple[str, str]:
    """Return a value and its interval with their unit."""
    unit = units.raised(estimate.unit)
    return (units.with_unit(units.fixed(estimate.value, digits_between(estimate.lower, estimate.upper)), unit),
            between(estimate.lower, estimate.upper, unit, at_bound) + remark)


def _declared(parameter: MachineParameter) -> str:
    return "" if parameter.declared is None else units.with_unit(units.fixed(parameter.declared, 4),
                                                                 units.raised(parameter.unit))


def _describe_gap(result: MachineStudyResult) -> Section:
    gap = result.gap
    if gap is None:
        return Section("The gap of the whole machine", [])
    rows: list[tuple[str, ...]] = [
        ("without the findings", units.number(gap.before, 3), ""),
        ("with the findings", *_state_closed(gap.after, gap.closed)),
        (f"with the control: {within(gap.control)}",
         *_state_closed(gap.before * (1 - (gap.control_closed or 0.0)), gap.control_closed))]
    if gap.before <= 0:
        rows = [rows[0], ("with the findings", units.number(gap.after, 3) if gap.converged else "did not converge", "")]
    return Section("The gap of the whole machine", [
        Table(("simulation of the whole machine", "squared residuals beyond noise", "closed"), rows),
        Note("Summed over all samples, in units of the noise variance; below 0, less is left than noise leaves on "
             "average. The simulation reads no signal that it gives, and each run is predicted by laws "
             f"and parameters of all others. The findings gain {units.number(gap.nats, 4)} nats, about which the runs "
             f"agree by {units.number(gap.errors)} standard errors.")])


def _state_closed(left: float, closed: float | None) -> tuple[str, str]:
    """Return what is left and which share is closed."""
    return ("", "did not converge") if closed is None else (units.number(left, 3), _share(closed))


def state_condition(each: StatedCondition) -> str:
    """Return how far the stated values of a condition are off, and what is declared, in words."""
    error, within, scatter, most = (f"{100 * abs(share):.1f} %" for share in (
        each.error, each.declared_error, each.scatter, each.declared_scatter))
    side = "above" if each.error > 0 else "below"
    return (f"{each.name}, {error} {side} what is stated where it is off most (declared: {within}), with a scatter of "
            f"{scatter} between runs (declared: at most {most})")


def tabulate_parameters(parameters: Sequence[MachineParameter]) -> Table:
    """Return a table of parameters, with their means without the findings where there are any."""
    has_before = any(each.before is not None for each in parameters)
    rows: list[tuple[str, ...]] = []
    for each in parameters:
        unit = units.raised(each.unit)
        before = "" if each.before is None else units.with_unit(units.fixed(each.before, 4), unit) + (
            f" ({_BEYOND})" if each.beyond_before else "")
        rows.append((each.name, _declared(each), *([before] if has_before else []),
                     *_state_value(each, at_bound=each.beyond),
                     units.with_unit(units.number(each.scatter, 2), unit),
                     _BEYOND if each.beyond else "" if each.determined else NOT_DETERMINED))
    means = ("mean without", "mean with the findings") if has_before else ("mean",)
    return _remark(("parameter", "declared", *means, f"{100 * LEVEL:.0f} % interval", "scatter between runs"), rows)


def _remark(head: tuple[str, ...], rows: list[tuple[str, ...]], words: tuple[int, ...] = ()) -> Table:
    """Return a table of rows that end in a remark, without a column of these where all are empty."""
    if any(row[-1] for row in rows):
        return Table((*head, "remark"), rows, (*words, len(head)))
    return Table(head, [row[:-1] for row in rows], words)


def _list_blocks(result: MachineStudyResult) -> Section:
    rows: list[tuple[str, ...]] = [
        (block.name, block.signals, f"{block.before:.2f}", f"{block.chi_square:.2f}",
         ", ".join(word for word, is_so in (("unexplained", block.unexplained), ("not converged", not block.converged))
                   if is_so)) for block in result.blocks]
    head = ("block", "reads → gives", "without findings", "with")
    notes = [Note("Median over the runs of the reduced chi-square: 1 if only noise is left."), *(
        Note(f"The blocks {listed([f'“{name}”' for name in block.joined])} read each other's signals, which are "
             "simulated together: they are one block here.") for block in result.blocks if block.joined)]
    return Section("Blocks", [_remark(head, rows, words=(1,)), *notes])
