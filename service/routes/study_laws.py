"""The measured laws of the findings of a study, as JSON and as files for other programs."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Response

from slipstick.errors import InvalidValue, UnknownName
from slipstick.law_files import FORMATS, write_law
from slipstick.machine_studies import MachineStudyResult
from slipstick.machine_studies.result import MachineFinding
from slipstick.machine_studies.study import law_table as machine_law_table
from slipstick.studies.export import file_stem, has_table, law_table
from slipstick.studies.formula import equation
from slipstick.studies.record import from_dict
from slipstick.studies.result import FindingResult, StudyResult

from ..bodies import JsonRoute
from ..error_responses import error_responses
from ..job_store import JobStore
from ..jobs import finished_job, is_of_machine, output_of
from ..routes.studies import StudyId, StudyStore
from ..study_schemas import FindingLaw, LawList

router = APIRouter(prefix="/v1/studies/{id}/laws", tags=["studies"], route_class=JsonRoute)

Index = Annotated[int, Path(description="Index (from 0) of the finding in the result of the study.", ge=0,
                            openapi_examples={"first": {"summary": "The first finding", "value": 0}})]
Format = Literal["json", "csv", "mat", "mo", "h"]
_FORMATS = ("`json`, or a file with the columns point, change, lower and upper end of its band, and the change by the "
            "formula of the named effect if there is one: `csv`, with units in the headings, `mat`, a MATLAB file with "
            "a row vector for each column, `mo`, a Modelica block with the table, or `h`, a C header with a function "
            "of the change.")
_FILES: dict[int | str, dict[str, Any]] = {200: {
    "description": "The law as JSON (`FindingLaw`), CSV, a MATLAB file, a Modelica block or a C header",
    "content": {media_type: {"schema": {"type": "string"} if media_type.startswith("text/") else
                             {"type": "string", "format": "binary"}} for _, media_type in FORMATS.values()}}}


@router.get("", summary="List the measured laws of a study", responses=error_responses(404, 409, 503))
def study_laws(id: StudyId, store: StudyStore) -> LawList:
    """Return the measured law of each finding that has one: how a quantity changes with what it depends on."""
    return LawList(laws=[_law(store, id, n, finding) for n, finding in enumerate(_findings(store, id))
                         if finding.law is not None])


@router.get("/{n}", summary="Get a measured law of a study", response_model=FindingLaw,
            responses={**error_responses(404, 409, 503), **_FILES})
def study_law(id: StudyId, n: Index, store: StudyStore,
              format: Annotated[Format, Query(description=_FORMATS)] = "json") -> Response | FindingLaw:
    """Return the measured law of a finding.

    A law that is a single number, such as the lag of a sensor, has no points; it is available as JSON only, and other
    formats are rejected with 422.
    """
    findings = _findings(store, id)
    if n >= len(findings) or findings[n].law is None:
        known = ", ".join(str(place) for place, finding in enumerate(findings) if finding.law is not None)
        raise UnknownName(f"The study '{id}' has no law {n}", f"Known: {known or 'none'}")
    finding = findings[n]
    if format == "json":
        return _law(store, id, n, finding)
    if not has_table(finding):
        raise InvalidValue(f"The law of the finding “{finding.title}” is a single number", "Omit `format`")
    name = f"{id}_{n}_{file_stem(finding)}.{format}"
    table = machine_law_table(finding) if isinstance(finding, MachineFinding) else law_table(finding)
    return Response(write_law(table, f".{format}"), media_type=FORMATS[f".{format}"].media_type,
                    headers={"Content-Disposition": f'attachment; filename="{name}"'})


def _findings(store: JobStore, id: str) -> Sequence[FindingResult | MachineFinding]:
    study = finished_job(store, id)
    result = output_of(study)["result"]
    return (from_dict(MachineStudyResult, result) if is_of_machine(study) else from_dict(StudyResult, result)).findings


def _law(store: JobStore, id: str, n: int, finding: FindingResult | MachineFinding) -> FindingLaw:
    assert finding.law is not None
    written = finding.equation if isinstance(finding, MachineFinding) else equation(finding)
    address = f"{store.address}/{id}/laws/{n}"
    files = [suffix.removeprefix(".") for suffix in FORMATS] if has_table(finding) else []
    return FindingLaw(finding=n, title=finding.title, effect=finding.effect, quantity=finding.quantity,
                      depends_on=finding.depends_on, law=finding.law, equation=written,
                      links={"json": address, **{name: f"{address}?format={name}" for name in files}})
