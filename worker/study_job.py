"""A study as a durable workflow: killed at any moment, it goes on from its last step with the same result.

A step is what `study.start`, `study.advance` or the conclusion does: some seconds.
"""

from dataclasses import dataclass
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.storage.library import Library
from slipstick.study import study
from slipstick.study.comparison import Comparison, compare
from slipstick.study.conclusion import conclude as concluded
from slipstick.study.evidence import evidence
from slipstick.study.progress import progress
from slipstick.study.settings import StudySettings
from worker.clocks import clocks, spent
from worker.jobs import Block, Order, report, require_same


def register(library: Library) -> None:
    """Teach DBOS the workflow `study` on the recordings of `library`; call it before the launch.

    A block holds the `state` of the study.
    """

    @DBOS.step(name="study.start")
    def start(order: Order) -> Block:
        begun = clocks()
        task = _open(library, order)
        said = _told(task, None)
        return {"state": study.start(task.settings, task.comparison), **spent({}, said, begun)}

    @DBOS.step(name="study.advance")
    def advance(order: Order, block: Block) -> Block:
        begun = clocks()
        task = _open(library, order)
        said = _told(task, block["state"])
        state = study.advance(task.settings, task.comparison, block["state"])
        return {"state": state, **spent(block, said, begun)}

    @DBOS.step(name="study.conclude")
    def conclude(order: Order, block: Block) -> dict[str, Any]:
        begun = clocks()
        task = _open(library, order)
        said = _told(task, block["state"])
        result = concluded(task.settings, task.comparison, block["state"])
        shown = evidence(task.settings, task.comparison, block["state"])
        return {"result": result, "figure_data": shown, **spent(block, said, begun)}

    @DBOS.workflow(name="study", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        block = start(order)
        while not study.finished(block["state"]):
            block = advance(order, block)
        return conclude(order, block)


@dataclass(frozen=True, eq=False)
class _Task:
    settings: StudySettings
    comparison: Comparison


def _told(task: _Task, state: study.State | None) -> str:
    """Publish what is done now, and return the name of its stage."""
    said = progress(task.settings, state)
    report(said)
    return str(said["stage"])


def _open(library: Library, order: Order) -> _Task:
    recordings = library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "study")
    settings = StudySettings.from_dict(order["settings"])
    return _Task(settings, compare(recordings, settings.shifting_time_noise))
