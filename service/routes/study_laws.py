"""The measured laws of the findings of a study, as JSON and as files for other programs."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Response

from service.bodies import JsonRoute
from service.job_store import JobStore
from service.jobs import finished_job
from service.problem_details import error_responses
from service.routes.studies import StudyId, StudyStore, typed_result
from service.study_schemas import FindingLaw, LawList
from slipstick.errors import UnknownName
from slipstick.study import law_file
from slipstick.study.result import FindingResult

router = APIRouter(prefix="/v1/studies/{id}/laws", tags=["studies"], route_class=JsonRoute)

Index = Annotated[int, Path(description="Index (from 0) of the finding in the result of the study.", ge=0,
                            openapi_examples={"first": {"summary": "The first finding", "value": 0}})]
Format = Literal["json", "csv", "mat"]
_TEXT = {"schema": {"type": "string"}}
_FILES = {200: {"description": "The law as JSON (`FindingLaw`), CSV or a MATLAB file",
                "content": {"text/csv": _TEXT, "application/octet-stream": {"schema": {"type": "string",
                                                                                        "format": "binary"}}}}}


@router.get("", summary="List the measured laws of a study", responses=error_responses(404, 409, 503))
def study_laws(id: StudyId, store: StudyStore) -> LawList:
    """Return the measured law of each finding that has one: how a quantity changes with what it depends on."""
    return LawList(laws=[_law(store, id, n, one) for n, one in enumerate(_findings(store, id)) if one.law is not None])


@router.get("/{n}", summary="Get a measured law of a study", response_model=FindingLaw,
            responses={**error_responses(404, 409, 503), **_FILES})
def study_law(id: StudyId, n: Index, store: StudyStore,
              format: Annotated[Format, Query(description="`json`, or a file with the columns point, change, lower "
                                                          "and upper end of its band, and the change by the formula "
                                                          "of the named effect if there is one: `csv`, with units in "
                                                          "the headings, or `mat`, a MATLAB file with a row vector "
                                                          "for each column.")] = "json") -> Response | FindingLaw:
    """Return the measured law of a finding.

    A law that is a single number, such as the lag of a sensor, has no points; it is available as JSON only, and other
    formats are rejected with 422.
    """
    findings = _findings(store, id)
    if n >= len(findings) or findings[n].law is None:
        known = ", ".join(str(place) for place, one in enumerate(findings) if one.law is not None)
        raise UnknownName(f"The study '{id}' has no law {n}", f"Known: {known or 'none'}")
    finding, name = findings[n], f"{id}-law-{n}"
    if format == "csv":
        return _file(law_file.to_csv(finding).encode(), "text/csv", f"{name}.csv")
    if format == "mat":
        return _file(law_file.to_mat(finding), "application/octet-stream", f"{name}.mat")
    return _law(store, id, n, finding)


def _findings(store: JobStore, id: str) -> list[FindingResult]:
    return typed_result(finished_job(store, id)).findings


def _law(store: JobStore, id: str, n: int, finding: FindingResult) -> FindingLaw:
    assert finding.law is not None
    address = f"{store.address}/{id}/laws/{n}"
    files = () if finding.law.x is None else ("csv", "mat")
    return FindingLaw(finding=n, title=finding.title, effect=finding.effect, quantity=finding.quantity,
                      depends_on=finding.depends_on, law=finding.law,
                      links={"json": address, **{name: f"{address}?format={name}" for name in files}})


def _file(content: bytes, media_type: str, name: str) -> Response:
    return Response(content, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'})
