"""The measured law of a finding as a table for other programs: CSV and MATLAB.

The columns are the points, the change with its band, and the change by the formula of the named effect if there is
one. The first two have the names that `slipstick.clutch.laws.MeasuredLaw` gives to a law of the simulator.
"""

from slipstick.clutch.law_files import Column, columns, identifier, to_csv, to_mat
from slipstick.studies.result import FindingResult


def has_table(finding: FindingResult) -> bool:
    """Whether the finding has a law over a number, and not a single number or none."""
    return finding.law is not None and finding.law.x is not None


def file_stem(finding: FindingResult) -> str:
    """The name of a file of the law, such as friction_coefficient_over_slip."""
    return identifier(f"{finding.quantity} over {finding.depends_on}")


def law_csv(finding: FindingResult) -> str:
    """The law as CSV: a row for each point, columns with units such as `slip [rad/s]`."""
    return to_csv(_columns(finding))


def law_mat(finding: FindingResult) -> bytes:
    """The law as a MATLAB file: a row vector for each column of `law_csv`, and the names and units as text."""
    law = finding.law
    assert law is not None
    return to_mat(_columns(finding), quantity=finding.quantity, depends_on=finding.depends_on, relative=law.relative,
                  known_up_to=law.up_to, linearised_band=law.linearised)


def _columns(finding: FindingResult) -> list[Column]:
    law = finding.law
    if law is None or law.x is None:
        raise ValueError(f"The finding '{finding.title}' has no law over a number")
    table = [*columns(finding.quantity, finding.depends_on, (law.x_unit, law.unit), law.x, law.change, law.relative),
             Column("lower", law.unit, law.lower), Column("upper", law.unit, law.upper)]
    return table if law.formula is None else [*table, Column("formula", law.unit, law.formula)]
