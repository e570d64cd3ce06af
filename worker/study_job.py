"""A study as a durable workflow: killed at any moment, it resumes after its last step and gives the same result.

It has two steps, `examine` and `conclude` of `slipstick.study`, and each takes some seconds to a minute.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.bench import Bench
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.study import StudySettings, conclude, examine
from slipstick.study.progress import Stage, StudyProgress
from worker.clocks import clock_times, stage_times
from worker.jobs import Checkpoint, Order, report, require_same


def register(library: Library) -> None:
    """Register the DBOS workflow `study` on the recordings of `library`, before `DBOS.launch`.

    The checkpoint between both steps holds what is `named`.
    """

    @DBOS.step(name="study.name")
    def name(order: Order) -> Checkpoint:
        begin, task = clock_times(), _open(library, order)
        named = examine(task.settings, task.bench, task.recordings, _log("name"))
        return {"named": named, **stage_times({}, "name", begin)}

    @DBOS.step(name="study.confirm")
    def confirm(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        begin, task = clock_times(), _open(library, order)
        result, figures = conclude(task.settings, task.bench, task.recordings, checkpoint["named"], _log("confirm"))
        return {"result": asdict(result), "figure_data": asdict(figures), **stage_times(checkpoint, "confirm", begin)}

    @DBOS.workflow(name="study", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return confirm(order, name(order))


@dataclass(frozen=True, eq=False)
class _Task:
    settings: StudySettings
    bench: Bench
    recordings: Recordings


def _log(stage: Stage) -> Callable[[str], None]:
    return lambda doing: report(asdict(StudyProgress(stage, doing)))


def _open(library: Library, order: Order) -> _Task:
    recordings = library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "study")
    bench = library.bench(order["bench"])
    require_same(order, "bench", bench.digest, "study")
    require_same(order, "sensing", bench.sensing_digest, "study")
    return _Task(StudySettings.from_dict(order["settings"]), bench, recordings)
