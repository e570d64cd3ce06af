"""The report and the pictures of a study."""

from typing import Any

from fastapi import APIRouter

from slipstick.pictures.study import NAMES

from ..bodies import JsonRoute
from ..jobs import finished_job, output_of, version_of
from ..routes.drawing_routes import DrawingTexts, Drawn, add_drawing_routes
from ..routes.studies import STUDIES, StudyId, StudyStore
from ..routes.study_fits import StudyFits

router = APIRouter(prefix="/v1/studies", tags=["studies"], route_class=JsonRoute)

_TEXTS = DrawingTexts(
    report="The report begins with what to do: what to add to the model with its numbers, where that holds, files of "
           "the laws and of the extended model, and the next experiment. Then come the evidence, the result of each "
           "block, the gap between model and recordings before and after with a control, and the limitations. It also "
           "compares two fits, on tables of the models without and with what was found (`before` and `after`, or the "
           "newest ones): likelihood, scatter of the inputs, and output noise.",
    pictures="\n\nThe picture `surfaces` is available only if there are fits to compare, `before` and `after`.",
    names=NAMES, example=("gap", "Held-out error without and with the findings"))


def drawn_study(id: StudyId, store: StudyStore, fits: StudyFits) -> Drawn:
    """What is drawn of a study, and of the fits that are compared: another fit may have taken the id of one."""
    study = finished_job(store, id, output=False)
    compared = [] if fits is None else [f"{fit['id']} {fit['ended']}" for fit in fits.values()]

    def request() -> dict[str, Any]:
        finished = finished_job(store, id)
        job = STUDIES.without_progress(store, finished).model_dump(mode="json")
        return {"kind": "study", "job": job, "output": output_of(finished), "fits": fits}

    return Drawn((version_of(study), *compared), request, f"{store.address}/{id}",
                 "" if fits is None else f"?before={fits['before']['id']}&after={fits['after']['id']}")


add_drawing_routes(router, STUDIES, _TEXTS, drawn_study)
