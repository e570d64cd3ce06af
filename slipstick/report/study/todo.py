"""What to do with the answer of a study: what to add with its numbers, where that holds, and what to record next."""

import json
from collections.abc import Iterable, Mapping

from slipstick.clutch.effects import Effect
from slipstick.law_files import FORMATS, LawTable, write_law
from slipstick.pictures.conditions import described
from slipstick.pictures.study.law import describe_change, describe_range, headline
from slipstick.pictures.study.words import argument, effect_title, name_candidate, within
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import number, scale, with_unit
from slipstick.report.doubts import LARGE_CHI_SQUARE
from slipstick.report.study.parts import Entries, File, Files, Items, Part, Section, Table
from slipstick.report.study.simulation import UNITS, lead, tell_confidence, values_of
from slipstick.report.study.words import coefficient_row, many
from slipstick.report.words import listed
from slipstick.studies.export import has_table, law_table
from slipstick.studies.figures import Figures
from slipstick.studies.finding import Changed, Law
from slipstick.studies.formula import effect_of, equation
from slipstick.studies.result import BlockResult, FindingResult, StudyResult
from slipstick.studies.settings import StudySettings

TITLE = "What to do"
_LABELS = {".csv": "CSV", ".mat": "MATLAB", ".mo": "Modelica", ".h": "C"}
_PASSING = "time", "run order"
"""What no run can be held at."""


def advise(result: StudyResult, figures: Figures, settings: StudySettings, cautions: Entries) -> Section:
    """Return what to do: for each finding, or where there is none. `cautions` are the warnings, which are named."""
    several = len(result.findings) > 1
    parts: list[Part] = []
    for place, finding in enumerate(result.findings, 1):
        parts += _advise_finding(finding, result, settings, f"{place}. " * several)
    if not result.findings:
        parts.append(Items(_advise_without(result)))
    entries: Entries = []
    if result.gap is not None and not any(map(_leaves_much, result.blocks)):
        entries.append((say_take_over(len(result.findings)), "the other parameters of the extended model, in the table "
                        "of “The fitted simulation of the whole bench”: they were fitted beside the findings."))
    entries += [("Correct the bench:", text) for text in _list_beyond(result, settings.level)]
    if tell_confidence(result):
        entries.append(("What it is worth:", lead(result, settings)))
    seen = [text for finding in result.findings if finding.law is not None
            if (text := describe_seen(finding, finding.law))]
    if (conditions := describe_conditions(figures.conditions)) and (result.findings or result.kind == "none"):
        ranges = "; ".join([*dict.fromkeys(seen), conditions])
        entries.append(("Where it holds:", f"{ranges}: what was recorded. Beyond, it is extrapolated."))
    entries += [("Next experiment:", text) for text in _list_next(result)]
    parts += [Items([*entries, *caution(cautions)]), *_attach_model(result)]
    return Section(TITLE, parts)


def say_take_over(findings: int) -> str:
    """Return the lead-in of parameters that were fitted together with so many findings."""
    return "Take over:" if not findings else "Take over with the law, not without it:" if findings == 1 else \
        "Take over with all laws, not without them:"


def check_channels(block: str) -> str:
    """Return what comes before any experiment where a block leaves more than noise."""
    return f"check the units and the signs of the channels of “{block}” first."


def _leaves_much(block: BlockResult) -> bool:
    return block.unexplained or block.chi_square > LARGE_CHI_SQUARE


def caution(warnings: Entries) -> Entries:
    """Return the warnings by their lead-ins: they stand below on a page, and above in plain text."""
    leads = dict.fromkeys(lead.rstrip(":.,") for lead, _ in warnings)
    return [("Mind the warnings:", f"{', '.join(leads)}.")] if warnings else []


def attach_laws(tables: Iterable[tuple[str, LawTable]]) -> list[Part]:
    """Return links to the files of laws, each with a lead-in."""
    return [Files(lead, tuple(File(_LABELS[suffix], f"{table.name}{suffix}", FORMATS[suffix].media_type,
                                   write_law(table, suffix)) for suffix in FORMATS)) for lead, table in tables]


def describe_seen(finding: Changed, law: Law) -> str:
    """Return over what a law was seen."""
    return "" if law.x is None else f"the {argument(finding)} {describe_range(law)}"


def find_weakest(finding: Changed, law: Law) -> str:
    """Return where a law is known least; empty for a single number."""
    if law.x is None:
        return ""
    width = [high - low for low, high in zip(law.lower, law.upper, strict=True)]
    at = max(range(len(width)), key=width.__getitem__)
    unit, factor = scale(law.x_unit, max(map(abs, law.x)))
    change, size = scale(law.unit, max(map(abs, law.change)), law.relative)
    runs = "More runs" if finding.depends_on in _PASSING else "Runs that stay there"
    return (f"The law is known least at {with_unit(number(factor * law.x[at]), unit)} of the {argument(finding)}: "
            f"± {with_unit(number(size * width[at] / 2, 2), change)}. {runs} improve it.")


def describe_conditions(conditions: Mapping[str, list[float] | None]) -> str:
    """Return the ranges of the conditions that were recorded."""
    ranges = [f"{in_words(name)} {number(min(column), 4)}"
              + (f" to {number(max(column), 4)}" if max(column) > min(column) else "") + f" {unit}"
              for name, unit in UNITS.items() if (column := conditions.get(name))]
    profiles = conditions.get("current_profile")
    return listed([*ranges, *([many(len(set(profiles)), "current profile")] if profiles else [])]) if ranges else ""


def write_equation(finding: FindingResult, result: StudyResult) -> str | None:
    """Return the equation with its coefficients, and the parameters of the extended model in it; None without one."""
    written = equation(finding)
    if written is None or result.after is None:
        return written
    known = [f"{value.symbol} = {value.text}" for value in values_of(result.after, 0.0) if value.is_in(written)]
    return f"{written}" + f", where {listed(known)} in the extended model" * bool(known)


def _advise_finding(finding: FindingResult, result: StudyResult, settings: StudySettings, prefix: str) -> list[Part]:
    entries: Entries = [(f"{prefix}{lead}", text) for lead, text in [_say_what(finding, result)]]
    law = finding.law
    if law is not None:
        text = f"{headline(finding, law)}."
        if law.formula is not None and law.x is not None and finding.depends_on != "gain":
            text += f" The equation gives {describe_change(law, law.formula)[0]} there."
        entries.append(("Measured:", text))
    parts: list[Part] = [Items(entries)]
    if finding.confirmation.agrees and finding.confirmation.coefficients:
        level, effect = settings.level, effect_of(finding.effect)
        parts.append(Table(("set", "to", f"{100 * level:.0f} % interval", "instead of"),
                           _list_new_values(finding, result, level, effect), words=(3,)))
    if law is not None and has_table(finding):
        parts += attach_laws([("The measured law as a file:", law_table(finding))])
    return parts


def _say_what(finding: FindingResult, result: StudyResult) -> tuple[str, str]:
    name, state = within(finding.title), finding.confirmation
    if state.simulated == "not computed":
        return "Do not add yet:", f"{name}. The simulation of the whole bench was not fitted with it."
    if state.agrees is False:
        return "Do not add:", f"{name}. A block shows it, but the simulation of the whole bench is no better with it."
    if state.simulated == "no":
        return "Add by hand:", (f"{name}. The simulation has no such quantity or dependence, so that neither an "
                                "equation nor its worth is known; the measured law is.")
    written = write_equation(finding, result)
    text = f"{name}, as the measured law of the {finding.quantity} over the {finding.depends_on}." \
        if written is None else f"{name}: {written}."
    others = [name_candidate(other) for other in finding.rivals]
    if finding.kind == "tie" and others:
        return "Do not add yet:", f"{text} Record first what tells it apart from {listed(others)}."
    return "Add:", text


def _list_new_values(finding: FindingResult, result: StudyResult, level: float,
                     effect: Effect | None) -> list[tuple[str, ...]]:
    rows = [(*coefficient_row(coefficient, effect)[:3], "not in the model")
            for coefficient in finding.confirmation.coefficients]
    written = equation(finding)
    if written is not None and result.after is not None:
        rows += [(value.name, value.text, value.interval or value.remark, value.nominal)
                 for value in values_of(result.after, level) if value.is_in(written)]
    return rows


def _advise_without(result: StudyResult) -> Entries:
    if result.partial is not None:
        return [("Repeat the study", "with a larger time budget: this one ended before there was an answer.")]
    if result.kind == "none":
        return [("Keep the model:", "add nothing to it. Where the refitted values differ from those of the bench file, "
                 "take them over: they are in the model below, and in the section on the fitted simulation.")]
    left = [f"“{block.signals}”" for block in result.blocks if not block.is_explained]
    where = f" of {listed(left)}" if left else ""
    what = "something is missing whose law is not measured." if result.explanations else \
        "something is missing that no effect and no law explains."
    entries: Entries = [("Do not change the model yet:", f"{what} Do not rely on its predictions{where}.")]
    if result.explanations:
        best = [within(effect_title(each.effect)) for each in result.explanations
                if each is result.explanations[0] or each.tied]
        entries.append(("What may be missing:", f"{listed(best)}, by the simulation of the whole bench alone."))
    return entries


def _list_beyond(result: StudyResult, level: float) -> list[str]:
    """Return the values of parameters that are not what the bench states."""
    names = {in_words(parameter.name) for parameter in result.beyond}
    if result.after is None:
        return []
    return [f"{value.name} {value.text}{f' ({value.interval})' * bool(value.interval)} instead of {value.nominal}."
            for value in values_of(result.after, level) if value.name in names]


def _list_next(result: StudyResult) -> list[str]:
    """Return the next experiment of each finding, or the one that would lead on without one."""
    doubtful = [check_channels(block.signals) for block in result.blocks if _leaves_much(block)]
    return [*doubtful, *_list_runs(result)]


def _list_runs(result: StudyResult) -> list[str]:
    if result.partial is not None:
        return []
    if result.closed:
        missing = list(dict.fromkeys(name for block in result.closed for name in block.missing))
        return [f"record {listed([in_words(name) for name in missing])} as well: "
                f"{many(len(result.closed), 'block')} could not be tested without."]
    if result.kind == "none":
        return ["none is needed. Before the model is used beyond these conditions, record a few runs there."]
    if not result.findings:
        outlying = sorted({row for block in result.blocks for row in block.outlying})
        look = f" Look first at the signals of {many(len(outlying), 'engagement')}: {listed([*map(str, outlying)])}." \
            if outlying else ""
        return ["repeat the conditions that are described worst (pictures below), with one condition changed at a "
                f"time, and record further channels, such as a temperature, which laws are then tried over.{look}"]
    return [text for finding in result.findings if (text := _describe_next(finding))]


def _describe_next(finding: FindingResult) -> str:
    if finding.experiments:
        best = finding.experiments[0]
        where = described({"current_profile": [best.current_profile], "motor_speed": [best.motor_speed],
                           "load_inertia": [best.load_inertia], "brake_torque": [best.brake_torque]}, 0)
        runs = "more than 1000 runs" if best.repetitions is None else many(best.repetitions, "run")
        return (f"{where}: {runs} tell {within(finding.title)} from {within(effect_title(best.rival))}, mostly by the "
                f"{in_words(best.signal)}.")
    if finding.rivals:
        return ("none that was tried tells the rivals apart: record a further channel, or conditions beyond these.")
    weak = find_weakest(finding, finding.law) if finding.law is not None else ""
    return f"none is needed to name {within(finding.title)}.{f' {weak}' * bool(weak)}"


def _attach_model(result: StudyResult) -> list[Part]:
    if result.after is None or not (result.findings or result.kind == "none"):
        return []
    what = "extended" if result.gap is not None else "refitted"
    content = f"{json.dumps(result.after.model, indent=1)}\n".encode()
    return [Files(f"The {what} model, for slipstick build --model:",
                  (File("JSON", f"{what}_model.json", "application/json", content),))]
