"""The two fits that the report of a study compares: on tables of the model without and with what was found."""

from contextlib import suppress
from itertools import product
from typing import Annotated, Any

from dbos import WorkflowStatus
from fastapi import Depends, Query

from slipstick.errors import InvalidValue, SlipstickError
from slipstick.storage.library import Library

from ..job_filter import JobFilter
from ..job_store import JobStore
from ..jobs import finished_job, input_of, is_of_machine, is_partial, output_of, require_complete
from ..routes.fits import FitStore
from ..routes.studies import StudyId, StudyStore
from ..schemas import LibraryDependency

_TRIED = 20
"""Newest fits of the recordings among which those to compare are looked for, where none are given."""
_EQUAL_INPUTS = ("simulate", "parameters", "outside", "settings")
"""Entries of the job input in which the two fits must agree."""


def _fit_query(model: str, how: str) -> Any:
    return Query(description=f"Id of a finished fit on a table of the study's model {how} what was found (`{model}`). "
                             "Give both `before` and `after`, or neither: then the newest two that can be "
                             "compared are taken, if there are any.")


def study_fits(id: StudyId, studies: StudyStore, fits: FitStore, library: LibraryDependency,
               before: Annotated[str | None, _fit_query("before", "without")] = None,
               after: Annotated[str | None, _fit_query("after", "with")] = None) -> dict[str, dict[str, Any]] | None:
    """Return id, input and output of the fits `before` and `after`, or None if neither is given and there are none.

    Raises `UnknownName`, `Conflict`, and `InvalidValue` if the fits do not belong to the study or are not comparable.
    """
    if before is None and after is None:
        return _find_fits(finished_job(studies, id), fits, library)
    if before is None or after is None:
        raise InvalidValue("Only one of `before` and `after` is given", "Give both, or neither")
    study = finished_job(studies, id)
    require_complete(studies, study)
    if output_of(study)["result"]["gap"] is None:
        raise InvalidValue(f"The study '{id}' added nothing to the model, so it has only one",
                           "Omit `before` and `after`")
    jobs = {"before": finished_job(fits, before), "after": finished_job(fits, after)}
    for which, fit in jobs.items():
        require_complete(fits, fit)
        _require_model(study, which, fit, library)
    for name in _list_differences(jobs["before"], jobs["after"]):
        raise InvalidValue(f"The fits '{before}' and '{after}' differ in `{name}`",
                           "Submit the same fit on both tables")
    return _describe(jobs)


StudyFits = Annotated[dict[str, dict[str, Any]] | None, Depends(study_fits)]


def _find_fits(study: WorkflowStatus, fits: JobStore, library: Library) -> dict[str, dict[str, Any]] | None:
    """Return the newest two finished fits that can be compared; None without any."""
    if is_of_machine(study) or is_partial(study) or output_of(study)["result"]["gap"] is None:
        return None
    of_model: dict[str, list[WorkflowStatus]] = {"before": [], "after": []}
    for fit in fits.newest(_TRIED, 0, JobFilter(status=("done",), recordings=input_of(study)["recordings"])):
        for which, known in of_model.items():
            with suppress(SlipstickError):
                _require_model(study, which, fit, library)
                known.append(fit)
    for before, after in product(*of_model.values()):
        if not _list_differences(before, after):
            jobs = {"before": finished_job(fits, before.workflow_id), "after": finished_job(fits, after.workflow_id)}
            if not any(map(is_partial, jobs.values())):
                return _describe(jobs)
    return None


def _list_differences(before: WorkflowStatus, after: WorkflowStatus) -> list[str]:
    return [name for name in _EQUAL_INPUTS if input_of(before)[name] != input_of(after)[name]]


def _describe(jobs: dict[str, WorkflowStatus]) -> dict[str, dict[str, Any]]:
    return {which: {"id": fit.workflow_id, "ended": fit.completed_at, **input_of(fit), **output_of(fit)}
            for which, fit in jobs.items()}


def _require_model(study: WorkflowStatus, which: str, fit: WorkflowStatus, library: Library) -> None:
    """Raise `InvalidValue` unless the fit used the study's recordings and a table of the study's model `which`."""
    fit_input, study_input = input_of(fit), input_of(study)
    if fit_input["recordings_digest"] != study_input["recordings_digest"]:
        raise InvalidValue(f"The fit '{fit.workflow_id}' and the study used different recordings",
                           f"Fit the table to the recordings '{study_input['recordings']}', unchanged since the study")
    table = library.table(fit_input["table"])
    if table.digest != fit_input["table_digest"]:
        raise InvalidValue(f"The table '{fit_input['table']}' has changed since the fit '{fit.workflow_id}'",
                           "Submit the fit again")
    if table.model.spec() != output_of(study)["result"][which]["model"]:
        raise InvalidValue(f"The table '{fit_input['table']}' was not built from the study's model `{which}`",
                           f"Build a table from /v1/studies/{study.workflow_id}/model?which={which} by POST "
                           "/v1/builds, and submit the fit on that table")
