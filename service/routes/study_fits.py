"""Two fits, of one kind on the tables of a study's two models, for its report: named in the query, and checked."""

from typing import Annotated, Any

from dbos import WorkflowStatus
from fastapi import Depends, Query

from service.jobs import finished, ordered, output
from service.routes.fits import TheFits
from service.routes.studies import StudyId, TheStudies
from service.schemas import TheLibrary
from slipstick.errors import InvalidValue
from slipstick.storage.library import Library

_ALIKE = ("simulate", "parameters", "outside", "settings")


def _of(model: str) -> Any:
    return Query(description=f"Id of a finished fit on a table of the study's model {model}. Give both or neither.")


def study_fits(id: StudyId, studies: TheStudies, fits: TheFits, library: TheLibrary,
               before: Annotated[str | None, _of("before")] = None,
               after: Annotated[str | None, _of("after")] = None) -> dict[str, dict[str, Any]] | None:
    """`before` and `after` -> order and output of the fit, with its `id`; None where none is named.

    Raises `UnknownName`, `Conflict`, and `InvalidValue` where they do not belong to the study or to each other.
    """
    if before is None and after is None:
        return None
    if before is None or after is None:
        raise InvalidValue("One fit shows no difference", "Name two fits, `before` and `after`, or none")
    study = finished(studies, id)
    if not output(study)["result"]["answer"]["effects"]:
        raise InvalidValue(f"The study '{id}' added nothing to the model, so there is one model only",
                           "Leave `before` and `after` out")
    named = {"before": finished(fits, before), "after": finished(fits, after)}
    for which, fit in named.items():
        _require_model(study, which, fit, library)
    for name in _ALIKE:
        if ordered(named["before"])[name] != ordered(named["after"])[name]:
            raise InvalidValue(f"The fits '{before}' and '{after}' differ in their {name}",
                               "Submit the same fit on both tables")
    return {which: {"id": fit.workflow_id, **ordered(fit), **output(fit)} for which, fit in named.items()}


StudyFits = Annotated[dict[str, dict[str, Any]] | None, Depends(study_fits)]


def _require_model(study: WorkflowStatus, which: str, fit: WorkflowStatus, library: Library) -> None:
    """Raise `InvalidValue` unless the fit is of the study's recordings and of its model `which`."""
    order, recordings = ordered(fit), ordered(study)["recordings"]
    if order["recordings_digest"] != ordered(study)["recordings_digest"]:
        raise InvalidValue(f"The fit '{fit.workflow_id}' is of other recordings than the study",
                           f"Fit the table to the recordings '{recordings}' as the study saw them")
    table = library.table(order["table"])
    if table.digest != order["table_digest"]:
        raise InvalidValue(f"The table '{order['table']}' changed after the fit '{fit.workflow_id}'",
                           "Submit the fit again")
    if table.model.spec() != output(study)["result"]["models"][which]:
        raise InvalidValue(f"The table '{order['table']}' is not of the study's model {which}",
                           f"Build it from /v1/studies/{study.workflow_id}/model?which={which} with `python -m worker "
                           "build --model`, and fit that one")
