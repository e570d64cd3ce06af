"""The measured law of a finding as a table for other programs: CSV and MATLAB.

The columns are the points, the change with its band, and the change by the formula of the named effect if there is
one. The first two have the names that `slipstick.clutch.laws.MeasuredLaw` gives to a law of the simulator.
"""

import csv
import io
import re

import numpy as np

from slipstick.study.result import FindingResult


def has_table(finding: FindingResult) -> bool:
    """Whether the finding has a law over a number, and not a single number or none."""
    return finding.law is not None and finding.law.x is not None


def file_stem(finding: FindingResult) -> str:
    """The name of a file of the law, such as friction_coefficient_over_slip."""
    return _identifier(f"{finding.quantity} over {finding.depends_on}")


def law_csv(finding: FindingResult) -> str:
    """The law as CSV: a row for each point, columns with units such as `slip [rad/s]`."""
    table = _columns(finding)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{name} [{unit}]" for name, (unit, _) in table.items())
    writer.writerows(zip(*([repr(value) for value in values] for _, values in table.values()), strict=True))
    return text.getvalue()


def law_mat(finding: FindingResult) -> bytes:
    """The law as a MATLAB file: a row vector for each column of `law_csv`, and the names and units as text."""
    from scipy.io import savemat  # here, because loading it takes longer than the rest of an export

    table, law = _columns(finding), finding.law
    assert law is not None
    content: dict[str, object] = {name: np.array(values) for name, (_, values) in table.items()}
    content |= {f"{name}_unit": unit for name, (unit, _) in table.items()}
    content |= {"quantity": finding.quantity, "depends_on": finding.depends_on, "relative": law.relative,
                "known_up_to": law.up_to, "linearised_band": law.linearised}
    file = io.BytesIO()
    savemat(file, content, oned_as="row", long_field_names=True)  # type: ignore[arg-type]
    return file.getvalue()


def _columns(finding: FindingResult) -> dict[str, tuple[str, list[float]]]:
    """Name of a column -> its unit and values."""
    law = finding.law
    if law is None or law.x is None:
        raise ValueError(f"The finding '{finding.title}' has no law over a number")
    change = f"{_identifier(finding.quantity)}_{'relative_' if law.relative else ''}change"
    found = {_identifier(finding.depends_on): (law.x_unit, law.x), change: (law.unit, law.change),
             "lower": (law.unit, law.lower), "upper": (law.unit, law.upper)}
    return found if law.formula is None else {**found, "formula": (law.unit, law.formula)}


def _identifier(words: str) -> str:
    return re.sub(r"\W+", "_", words).strip("_")
