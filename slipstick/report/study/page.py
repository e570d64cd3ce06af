"""The report of a study: answer, support, location of the misfit, closed gap, pictures and limitations."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.study import CAPTIONS, study_pictures
from slipstick.pictures.study.words import phrase, title
from slipstick.report.markup import listing, paragraph, section, table
from slipstick.report.shell import document, figures, provenance
from slipstick.report.study import further as study_further
from slipstick.report.study import words
from slipstick.report.study.fits import Fits, same_fit
from slipstick.report.study.limits import caveats, limits

_GAP = ("RMS error on held-out conditions", "before", "after", "correct model", "gap closed (90 %)")
_RANKING = ("candidate", "block", "improvement [decades]", "ahead [s.e.]", "behind [s.e.]", "share", "BIC")
_FITTED = ("", "no effect added", "all effects added")
_CLOSED = ("Gap closed: 1 − (after² − correct²) / (before² − correct²). Before: the best refit without the effect, on "
           "the same data and folds. After: the model with the effect. Correct model: the error that sensor noise and "
           "run-to-run scatter alone would cause, according to the model with the effect.")
_RANKED = ("Improvement: held-out log10 likelihood per experiment relative to the fit without the candidate. Ahead: "
           "the improvement in standard errors over experiments, each counted as log(1 + nats) so that none "
           "dominates. Behind: the standard errors by which the candidate trails the best, counted in the same way; "
           "candidates below two are tied, but effects added in later rounds may distinguish them. Share: share of "
           "bootstrap samples in which the candidate is the best. BIC: change relative to the fit without the "
           "candidate, with one observation per experiment; lower is better.")


def study_page(study: Mapping[str, Any], output: Mapping[str, Any], fits: Fits | None = None) -> str:
    """Return the HTML page of a study. The same input gives the same page.

    `study` is the JSON of the study (id, recordings, digest, settings, times), and `output` the output of its job
    (`result`, `figure_data`, `seconds`, `processor_seconds`). `fits` maps `before` and `after` to the fit on the table
    of that model: id, table, table_digest, `result`, `figure_data`.
    """
    result, figure_data = output["result"], output["figure_data"]
    specs, parameters = study_pictures(result, figure_data, fits), list(words.fits(result))
    return document("study", study["id"], result["answer"]["sentence"], [
        paragraph(words.lead(result, figure_data), "lead"), listing(caveats(result, figure_data)),
        section("Findings", _coefficients(study, result, figure_data), listing(words.rounds(result, figure_data))),
        section("Experiments that would distinguish the tied effects", *_further(result, figure_data)),
        section("Where model and test bench disagree most", listing(words.where(figure_data))),
        section("Gap closed by the added effects", _gap(result, figure_data)),
        same_fit(study, result, fits, "surfaces" in specs),
        figures([name for name in specs if name != "surfaces"], CAPTIONS),
        section("Candidates", *_rankings(result, figure_data)),
        section("Fitted parameters, scatter and noise", table(_FITTED[:len(parameters[0])], parameters)),
        section("Limitations", listing(limits(figure_data))),
        provenance(study, output, [
            ("recordings", f"{study['recordings']}, SHA-256 {study['recordings_digest']}"),
            ("experiments", str(result["experiments"])), ("settings digest", result["settings_digest"])])], specs)


def _coefficients(study: Mapping[str, Any], result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    rows, level = list(words.coefficients(result, figure_data)), 100 * study["settings"]["level"]
    return table(("coefficient", "estimate", f"{level:.0f} % interval"), rows) if rows else ""


def _further(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[str]:
    """Return one table per tie."""
    parts = []
    for tie in result["further"]:
        parts.append(paragraph(study_further.lead(tie, figure_data)))
        if tie["experiments"]:
            parts += [table(study_further.HEAD, study_further.rows(tie)), paragraph(study_further.NOTE, "note")]
    return parts


def _gap(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    if result["gap"] is None:
        return ""
    control = result["gap"]["control"]
    if control is None:
        return table(_GAP, words.gap(result)) + paragraph(_CLOSED, "note")
    note = f"Control: {title(figure_data, control['effect'])}, the best candidate that acts on another quantity."
    return table((*_GAP, "by the control"), words.gap(result)) + paragraph(f"{_CLOSED} {note}", "note")


def _rankings(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[str]:
    """Return one table per round, below the effects added before."""
    parts = []
    for entry in result["rounds"]:
        if entry["ranking"]:
            added = f"With {phrase(figure_data, entry['added'])} added:" if entry["added"] else ""
            parts += [paragraph(added) if added else "", table(_RANKING, words.ranking(entry))]
    return [*parts, paragraph(_RANKED, "note")] if parts else []
