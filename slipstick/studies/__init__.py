"""The study: what recordings ask for beside the model of their bench, named, measured, confirmed and worth."""

from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings
from slipstick.studies.study import conclude, examine, unconfirmed

__all__ = ["StudyResult", "StudySettings", "conclude", "examine", "unconfirmed"]
