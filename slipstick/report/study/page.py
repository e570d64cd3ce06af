"""The report of a study: the answer and how sure it is, where it shows, what adding it closes, and the limits."""

from collections.abc import Mapping
from typing import Any

from slipstick.pictures.study import CAPTIONS, study_pictures
from slipstick.pictures.study.words import phrase, title
from slipstick.report.markup import listing, paragraph, section, table
from slipstick.report.shell import document, figures, origin
from slipstick.report.study import further as study_further
from slipstick.report.study import words
from slipstick.report.study.fits import Fits, same_fit
from slipstick.report.study.limits import caveats, limits

_GAP = ("on conditions not seen, RMS", "before", "after", "right model", "gap closed (90 %)")
_RANKING = ("candidate", "block", "gain [decades]", "ahead [s.e.]", "behind [s.e.]", "share", "BIC")
_CLOSED = ("Closed: 1 − (after² − right²) / (before² − right²), where right is what sensor noise and scatter from run "
           "to run leave of the model with the effect. Before is the best refit without it, on the same data and "
           "folds.")
_RANKED = ("Gain: held-out log10 likelihood per experiment above the fit without the candidate. Ahead: how sure the "
           "experiments are of it, in standard errors, each counted as log(1 + nats) so that no one drowns the others. "
           "Behind: how far it trails the best, counted alike; tied below two, before what later rounds added. "
           "Share: how often it is the best in a bootstrap. BIC: change, with one observation an experiment; less is "
           "better.")


def study_page(study: Mapping[str, Any], output: Mapping[str, Any], fits: Fits | None = None) -> str:
    """The whole page.

    `study` is the JSON of a study (id, recordings, digest, settings, times), `output` what its job left (`result`,
    `figure_data`, `seconds`, `processor_seconds`), `fits` under `before` and `after` the fit on the table of that model:
    id, table, table_digest, `result`, `figure_data`. The same input gives the same page.
    """
    result, figure_data = output["result"], output["figure_data"]
    drawn, fitted = study_pictures(result, figure_data, fits), list(words.fits(result))
    return document("study", study["id"], result["answer"]["sentence"], [
        paragraph(words.lead(result, figure_data), "lead"), listing(caveats(result, figure_data)),
        section("What was found", _coefficients(study, result, figure_data), listing(words.rounds(result, figure_data))),
        section("Experiments that would tell them apart", *_further(result, figure_data)),
        section("Where model and bench disagree most", listing(words.where(figure_data))),
        section("What adding it closes", _gap(result, figure_data)),
        same_fit(study, result, fits, "surfaces" in drawn),
        figures([name for name in drawn if name != "surfaces"], CAPTIONS),
        section("Candidates", *_rankings(result, figure_data)),
        section("The fit", table(("", "with nothing added", "with all")[:len(fitted[0])], fitted)),
        section("What it cannot say", listing(limits(figure_data))),
        origin(study, output, [
            ("recordings", f"{study['recordings']}, SHA-256 {study['recordings_digest']}"),
            ("experiments", str(result["experiments"])), ("settings digest", result["settings_digest"])])], drawn)


def _coefficients(study: Mapping[str, Any], result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    rows, level = list(words.coefficients(result, figure_data)), 100 * study["settings"]["level"]
    return table(("coefficient", "estimate", f"{level:.0f} % interval"), rows) if rows else ""


def _further(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[str]:
    """A table a tie."""
    found = []
    for one in result["further"]:
        found.append(paragraph(study_further.lead(one, figure_data)))
        if one["experiments"]:
            found += [table(study_further.HEAD, study_further.rows(one)), paragraph(study_further.NOTE, "note")]
    return found


def _gap(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> str:
    if result["gap"] is None:
        return ""
    control = result["gap"]["control"]
    if control is None:
        return table(_GAP, words.gap(result)) + paragraph(_CLOSED, "note")
    named = f"Control: {title(figure_data, control['effect'])}, the best candidate that acts on another quantity."
    return table((*_GAP, "by the control"), words.gap(result)) + paragraph(f"{_CLOSED} {named}", "note")


def _rankings(result: Mapping[str, Any], figure_data: Mapping[str, Any]) -> list[str]:
    """A table a round, under what had been added before."""
    found = []
    for one in result["rounds"]:
        if one["ranking"]:
            added = f"With {phrase(figure_data, one['added'])} added:" if one["added"] else ""
            found += [paragraph(added) if added else "", table(_RANKING, words.ranking(one))]
    return [*found, paragraph(_RANKED, "note")] if found else []
