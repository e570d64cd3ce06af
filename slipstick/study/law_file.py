"""The measured law of a finding as a file, for a look-up table in another program."""

from slipstick.clutch import law_files
from slipstick.clutch.law_files import Column
from slipstick.errors import InvalidValue
from slipstick.study.result import FindingResult


def to_csv(finding: FindingResult) -> str:
    """The law as CSV: point, change, band, and the formula if there is one; raises `InvalidValue` without points."""
    return law_files.to_csv(_columns(finding))


def to_mat(finding: FindingResult) -> bytes:
    """The columns of `to_csv` as a MATLAB file, and what they are as text; raises `InvalidValue` without points."""
    law = finding.law
    return law_files.to_mat(_columns(finding), quantity=finding.quantity, depends_on=finding.depends_on,
                            relative=law is not None and law.relative, up_to="" if law is None else law.up_to)


def _columns(finding: FindingResult) -> list[Column]:
    law = finding.law
    if law is None or law.x is None:
        raise InvalidValue(f"The finding “{finding.title}” has no law over points",
                           "Request JSON, which holds single numbers as well")
    at, change = law_files.columns(finding.quantity, finding.depends_on, (law.x_unit, law.unit), law.x, law.change,
                                   law.relative)
    band = [at, change, Column("lower", law.unit, law.lower), Column("upper", law.unit, law.upper)]
    return band if law.formula is None else [*band, Column("formula", law.unit, law.formula)]
