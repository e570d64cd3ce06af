"""The study of any declared machine as typed values: what recordings show and the model lacks, and the words for it."""

from slipstick.machine_studies.result import MachineFigures, MachineStudyResult
from slipstick.machine_studies.study import require_enough, study_machine

__all__ = ["MachineFigures", "MachineStudyResult", "require_enough", "study_machine"]
