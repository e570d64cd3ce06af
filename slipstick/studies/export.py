"""The measured law of a finding as a table for other programs.

The first two columns have the names that `slipstick.clutch.laws.MeasuredLaw` gives to a law of the simulator.
"""

from slipstick.law_files import LawTable, identifier
from slipstick.studies.finding import Changed
from slipstick.studies.formula import equation
from slipstick.studies.result import FindingResult

_VARIABLES = {"gain": "reading", "direction": "piston rate"}
"""Dependence -> what the points of its law are values of, if it is not the dependence."""
_LINEARISED = ", of a linear model about the fit, which may be several times too narrow"


def has_table(finding: Changed) -> bool:
    """Whether the finding has a law over a number, and not a single number or none."""
    return finding.law is not None and finding.law.x is not None


def file_stem(finding: Changed) -> str:
    """The name of a file of the law, such as friction_coefficient_over_slip."""
    return identifier(f"{finding.quantity} over {_VARIABLES.get(finding.depends_on, finding.depends_on)}")


def law_table(finding: FindingResult) -> LawTable:
    """The law as a table, which `slipstick.law_files.write_law` writes."""
    is_linearised = finding.law is not None and finding.law.linearised
    return tabulate_finding(finding, f"interval at each point, at the level of the study{_LINEARISED * is_linearised}",
                            equation(finding))


def tabulate_finding(finding: Changed, band: str, written: str | None) -> LawTable:
    """The law of a finding of any machine as a table; `band` says what its interval is, and `written` its equation."""
    law = finding.law
    if law is None or law.x is None:
        raise ValueError(f"The finding '{finding.title}' has no law over a number")
    return LawTable(finding.quantity, _VARIABLES.get(finding.depends_on, finding.depends_on), law.x, law.x_unit,
                    law.change, law.unit, law.relative, law.lower, law.upper,
                    band, law.formula, written, law.up_to)
