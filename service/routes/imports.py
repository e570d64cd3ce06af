"""Import: recordings from the files of a data-acquisition system and a mapping, uploaded as a ZIP archive."""

import base64
import io
import zipfile
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from slipstick.acquisition.archive import MAPPING, ImportReport, import_archive
from slipstick.machine import Runs
from slipstick.recordings import Recordings
from slipstick.storage.library import require_name

from ..bodies import JsonRoute, upload_of
from ..computations import reads_upload
from ..drawings import Drawings, DrawingsDependency
from ..error_responses import error_responses
from ..front.panels import draw_elements
from ..front.recorded import previewed_run
from ..machines import MachinesDependency
from ..routes.recordings import RecordingsDescription, RunsDescription, describe, store
from ..schemas import LibraryDependency
from ..subjects import ImportBench, ImportMachine, find_subject

router = APIRouter(prefix="/v1/recordings", tags=["recordings"], route_class=JsonRoute)

MEDIA_TYPE = "application/zip"
_EXAMPLE_MAPPING = """[signals]
input_speed = { channel = "n_in", unit = "rad/s" }
output_speed = { channel = "n_out", unit = "rad/s" }
[time]
channel = "t"
unit = "s"
[shift_command]
time = "0 s"
[conditions]
current_profile = { value = 0 }
motor_speed = { value = "1000 rpm" }
load_inertia = { value = "6 kg m^2" }
brake_torque = { value = "20 N m" }
"""


def _sheet() -> str:
    """A fictitious engagement whose speeds meet after 0.6 s on a bench with the gear ratio 3.2, as CSV."""
    rows = [(20 * k, max(60 - 2 * k, 0)) for k in range(60)]
    return "t;n_in;n_out\n" + "".join(f"{t / 1000};{160 + slip};{50}\n".replace(".", ",") for t, slip in rows)


def example_file() -> str:
    """A file of a fictitious engagement, as Base64."""
    return base64.b64encode(_sheet().encode()).decode()


def _example() -> str:
    """The file with its mapping, as Base64."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in ((MAPPING, _EXAMPLE_MAPPING), ("run.csv", _sheet())):
            archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
    return base64.b64encode(memory.getvalue()).decode()


_UPLOAD_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {MEDIA_TYPE: {
    "schema": {"type": "string", "format": "binary", "contentEncoding": "base64"}, "example": _example()}}}}


class SetAsideEngagement(BaseModel):
    """An engagement that is not among the recordings."""

    engagement: str = Field(description="Name of the file, and number of the engagement where the file has several.")
    reason: str = Field(description="Why the engagement cannot be used.")


class SignalPicture(BaseModel):
    """A signal or command of an engagement or run over time."""

    title: str = Field(description="Name of the signal, with its unit.")
    caption: str = Field(description="What is drawn and marked.")
    note: str = Field(description="What is not drawn; empty for nothing.")
    svg: str = Field(description="The picture as an SVG element.")


class PicturedExperiment(BaseModel):
    """The pictures of an engagement or run."""

    label: str = Field(description="Name of the file, and number in it where the file has several.")
    conditions: str = Field(description="Its conditions in words.")
    pictures: list[SignalPicture] = Field(description="Its signals and commands. Those of an engagement begin before "
                                                      "the shift command, where the file does.")


class ImportDescription(BaseModel):
    """Imported recordings, and what must be known about them."""

    recordings: RecordingsDescription | RunsDescription = Field(description="The recordings, as stored.")
    engagements: list[str] = Field(description="File, and number in it, of each engagement or run of the recordings.")
    computed: bool | None = Field(description="Whether the shifting times were computed from the speeds; null for "
                                              "runs of a machine.")
    set_aside: list[SetAsideEngagement] = Field(description="Engagements that cannot be used, with the reasons.")
    remarks: list[str] = Field(description="What was detected or assumed because the mapping does not state it.")
    doubts: list[str] = Field(description="What looks wrong: the marks of a swapped channel, a wrong sign or unit.")
    open_questions: list[str] = Field(description="What cannot be answered without the signals that were not mapped: "
                                                  "blocks that a study cannot test, and what no calibration "
                                                  "determines.")
    pictures: list[PicturedExperiment] = Field(description="The first engagements or runs, as many as were asked for.")


ImportName = Annotated[str, Query(
    description="Name of the new recordings: up to 64 letters, digits, - and _, starting with a letter or digit.",
    openapi_examples={"mine": {"summary": "A new name", "value": "imported-files"}})]


Preview = Annotated[bool, Query(description="Import without storing anything: the answer, with status 200, says what "
                                            "the recordings would be.")]
Pictures = Annotated[int, Query(ge=0, le=12, description="Number of the first engagements or runs of which the answer "
                                                         "has pictures.")]


@router.post("/import", summary="Import files of a bench or machine", status_code=201, openapi_extra=_UPLOAD_BODY,
             responses=error_responses(404, 408, 409, 413, 415, 503) | {200: {
                 "description": "Identical recordings already existed under this name, or it was a `preview`",
                 "model": ImportDescription}})
@reads_upload
def import_recordings(name: ImportName, archive: Annotated[bytes, upload_of(MEDIA_TYPE)], library: LibraryDependency,
                      machines: MachinesDependency, drawings: DrawingsDependency, response: Response,
                      bench: ImportBench = None, machine: ImportMachine = None, preview: Preview = False,
                      pictures: Pictures = 0) -> ImportDescription:
    """Make recordings of a `bench`, or runs of a declared `machine`, of the files of a data-acquisition system.

    The request body is a ZIP archive (Content-Type application/zip) with the files (MDF, MATLAB, CSV or Parquet),
    their mapping `channels.toml`, and the sheet of conditions if the mapping names one, made by
    `zip -r files.zip channels.toml runs`. Send it by `curl --data-binary @files.zip --header 'Content-Type:
    application/zip'`. `docs/your_files.md` describes the mapping. The files are read in a child process with limited
    time and memory. An existing file is never replaced. With `preview`, nothing is stored. A machine is one that a
    worker has told of (`slipstick work --machine FILE.py`); its file is not run.
    """
    require_name(name)  # before the files are read, which may take minutes
    subject = find_subject(library, machines, bench, machine)
    content, report = import_archive(archive, subject, leads_in=pictures > 0)
    if preview:
        response.status_code = 200
        stored = describe(name, library.read_recordings(content, "h5"))
    else:
        stored = store(library, response, name, content, "h5")
    return ImportDescription(
        recordings=stored, engagements=list(report.labels), computed=report.computed,
        pictures=_draw(library.read_recordings(content, "h5"), report, pictures, drawings) if pictures else [],
        set_aside=[SetAsideEngagement(engagement=entry.label, reason=entry.reason) for entry in report.set_aside],
        remarks=list(report.remarks), doubts=list(report.doubts), open_questions=list(report.open_questions))


def _draw(recordings: Recordings | Runs, report: ImportReport, count: int,
          drawings: Drawings) -> list[PicturedExperiment]:
    """Return pictures of the first experiments, at most `count`."""
    shown = [(label, *previewed_run(recordings, run, report.led_in)) for run, label in enumerate(report.labels[:count])]
    panels = [panel for _, _, each in shown for panel in each]
    drawn = iter(draw_elements(drawings, panels, "preview") if panels else [])
    return [PicturedExperiment(label=label, conditions=words, pictures=[
        SignalPicture(title=panel.title, caption=panel.caption, note=panel.note, svg=next(drawn))
        for panel in each]) for label, words, each in shown]
