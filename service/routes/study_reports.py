"""The report and the pictures of a study."""

from typing import Any

from fastapi import APIRouter

from slipstick.pictures.machine_study import CAPTIONS as MACHINE_CAPTIONS
from slipstick.pictures.study import CAPTIONS

from ..bodies import JsonRoute
from ..jobs import finished_job, is_of_machine, output_of, version_of
from ..routes.drawing_routes import DrawingTexts, Drawn, add_drawing_routes
from ..routes.studies import STUDIES, StudyId, StudyStore
from ..routes.study_fits import StudyFits

router = APIRouter(prefix="/v1/studies/{id}", tags=["studies"], route_class=JsonRoute)

_TEXTS = DrawingTexts(
    report="The report contains what is missing and the evidence for it, the result of each block of the model, the "
           "gap between model and recordings before and after with a control, the pictures, and the limitations of a "
           "study. With `before` and `after` it also compares two fits, on tables of the models without and with what "
           "was found: likelihood, scatter of the inputs, and output noise.",
    pictures="\n\nThe picture `surfaces` is available only if `before` and `after` are given.",
    captions=CAPTIONS, example=("gap", "Held-out error without and with the findings"))


def drawn_study(id: StudyId, store: StudyStore, fits: StudyFits) -> Drawn:
    """What is drawn of a study, and of the fits that are compared: another fit may have taken the id of one."""
    study = finished_job(store, id, output=False)
    compared = [] if fits is None else [f"{fit['id']} {fit['ended']}" for fit in fits.values()]

    def request() -> dict[str, Any]:
        finished = finished_job(store, id)
        job = STUDIES.without_progress(store, finished).model_dump(mode="json")
        return {"kind": "study", "job": job, "output": output_of(finished), "fits": fits}

    return Drawn((version_of(study), *compared), request, f"{store.address}/{id}",
                 MACHINE_CAPTIONS if is_of_machine(study) else CAPTIONS,
                 "" if fits is None else f"?before={fits['before']['id']}&after={fits['after']['id']}")


add_drawing_routes(router, STUDIES, _TEXTS, drawn_study)
