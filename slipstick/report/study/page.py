"""The report of a study as an HTML page: answer, what to do, warnings, evidence, gap and limitations."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from slipstick.pictures.study import study_pictures
from slipstick.pictures.theme import Spec, captions
from slipstick.report import markup
from slipstick.report.shell import SIGN, document, figures, home_of, provenance, tell_facts, tell_recordings
from slipstick.report.study import content, parts
from slipstick.report.study.fits import Fits, same_fit
from slipstick.report.study.glossary import explain
from slipstick.report.study.simulation import lead, tell_confidence
from slipstick.report.study.todo import advise
from slipstick.report.study.warnings import warnings
from slipstick.report.study.words import many
from slipstick.studies.figures import Figures
from slipstick.studies.record import from_dict
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings


def study_page(study: Mapping[str, Any], output: Mapping[str, Any], fits: Fits | None = None) -> str:
    """Return the HTML page of a study. The same input gives the same page.

    `study` is the JSON of the study (id, recordings, digest, settings, times), and `output` the output of its job
    (`result`, `figure_data`, `seconds`, `processor_seconds`). `fits` maps `before` and `after` to the fit on the table
    of that model: id, table, table_digest, `result`, `figure_data`.
    """
    result, data = from_dict(StudyResult, output["result"]), from_dict(Figures, output["figure_data"])
    settings = StudySettings.from_dict(study["settings"])
    specs = study_pictures(result, data, fits, settings)
    drawn, changed, cautions = figures(specs, captions(specs)), _select_changes(settings), warnings(result, data.aside)
    main, rest = content.evidence(result, settings, drawn), content.background(result, data, settings)
    box = advise(result, data, settings, cautions)
    return document("study of", study["recordings"], result.sentence, cautions, [
        *(render_section(section, drawn) for section in main),
        same_fit(result, fits, drawn.get("surfaces", "")),
        *(render_section(section, drawn) for section in (*rest, explain([box, *main, *rest]))),
        provenance({**study, "settings": changed}, output, [
            ("recordings", f"{study['recordings']}, SHA-256 {study['recordings_digest']}"),
            ("engagements that count", str(result.experiments)), ("settings digest", result.settings_digest),
            ("settings", "" if changed else "default")])],
        [markup.paragraph(tell_confidence(result) or lead(result, settings), "lead"), render_box(box, drawn)],
        [tell_facts(study, [
            f"Bench {study['bench']}" if study.get("bench") else "", tell_recordings(study),
            many(result.experiments, "engagement")
            + f", {len(result.set_aside)} more set aside" * bool(result.set_aside)]),
         markup.paragraph(SIGN, "note")], home_of(study))


def study_specs(study: Mapping[str, Any], output: Mapping[str, Any], fits: Fits | None = None) -> dict[str, Spec]:
    """Return the pictures of a study, name -> specification; the arguments are those of `study_page`."""
    return study_pictures(from_dict(StudyResult, output["result"]), from_dict(Figures, output["figure_data"]), fits,
                          StudySettings.from_dict(study["settings"]))


def _select_changes(settings: StudySettings) -> dict[str, Any]:
    """The settings that differ from the default: all others would fill a screen."""
    chosen, default = asdict(settings), asdict(StudySettings())
    chosen["naming"] = {name: value for name, value in chosen["naming"].items() if value != default["naming"][name]}
    return {name: value for name, value in chosen.items() if value not in ({}, default[name])}


def render_box(section: parts.Section, drawn: Mapping[str, str]) -> str:
    """Return a section that stands out as HTML."""
    return f'<div class="box">\n{render_section(section, drawn)}\n</div>'


def render_section(section: parts.Section, drawn: Mapping[str, str]) -> str:
    """Return a section as HTML; `drawn` has the figure elements of its pictures."""
    return markup.section(section.title, *(_part(part, drawn) for part in section.parts))


def _part(part: parts.Part, drawn: Mapping[str, str]) -> str:
    match part:
        case parts.Note(text):
            return markup.paragraph(text, "note")
        case parts.Items(entries):
            return markup.listing(entries)
        case parts.Table(head, rows, words):
            return markup.table(head, rows, words)
        case parts.Picture(name):
            return drawn[name]
        case parts.Files(lead, files):
            return markup.downloads(lead, [(file.label, file.name, file.media_type, file.content) for file in files])
        case str(text):
            return markup.paragraph(text)
