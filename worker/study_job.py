"""A study as a durable workflow: killed at any moment, it resumes after its last step and gives the same result.

A step is one call of `study.start`, `study.advance` or `conclude`, and takes some seconds.
"""

from dataclasses import dataclass
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.storage.library import Library
from slipstick.study import study
from slipstick.study.comparison import Comparison, compare
from slipstick.study.conclusion import conclude as study_result
from slipstick.study.evidence import evidence as study_figure_data
from slipstick.study.progress import progress
from slipstick.study.settings import StudySettings
from worker.clocks import clock_times, stage_times
from worker.jobs import Checkpoint, Order, report, require_same


def register(library: Library) -> None:
    """Register the DBOS workflow `study` on the recordings of `library`, before `DBOS.launch`.

    A checkpoint holds the `state` of the study.
    """

    @DBOS.step(name="study.start")
    def start(order: Order) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        stage = _report_stage(task, None)
        return {"state": study.start(task.settings, task.comparison), **stage_times({}, stage, begin)}

    @DBOS.step(name="study.advance")
    def advance(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        stage = _report_stage(task, checkpoint["state"])
        state = study.advance(task.settings, task.comparison, checkpoint["state"])
        return {"state": state, **stage_times(checkpoint, stage, begin)}

    @DBOS.step(name="study.conclude")
    def conclude(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        begin = clock_times()
        task = _open(library, order)
        stage = _report_stage(task, checkpoint["state"])
        result = study_result(task.settings, task.comparison, checkpoint["state"])
        figures = study_figure_data(task.settings, task.comparison, checkpoint["state"])
        return {"result": result, "figure_data": figures, **stage_times(checkpoint, stage, begin)}

    @DBOS.workflow(name="study", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        checkpoint = start(order)
        while not study.finished(checkpoint["state"]):
            checkpoint = advance(order, checkpoint)
        return conclude(order, checkpoint)


@dataclass(frozen=True, eq=False)
class _Task:
    settings: StudySettings
    comparison: Comparison


def _report_stage(task: _Task, state: study.State | None) -> str:
    """Publish the progress of the study, and return the stage of the next step."""
    current = progress(task.settings, state)
    report(current)
    return str(current["stage"])


def _open(library: Library, order: Order) -> _Task:
    recordings = library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "study")
    bench = library.bench(order["bench"])
    require_same(order, "bench", bench.digest, "study")
    require_same(order, "sensing", bench.sensing_digest, "study")
    settings = StudySettings.from_dict(order["settings"])
    return _Task(settings, compare(bench, recordings, settings.shifting_time_noise))
