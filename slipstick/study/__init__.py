"""The study: what recordings ask for beside the model of their bench, named, measured, confirmed and worth."""

from slipstick.study.result import StudyResult
from slipstick.study.settings import StudySettings
from slipstick.study.study import conclude, examine, unconfirmed

__all__ = ["StudyResult", "StudySettings", "conclude", "examine", "unconfirmed"]
