"""The formats of a measured law: CSV, MATLAB, a Modelica block, and a C header."""

import csv
import io
import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.law_files.table import LawTable

_MODELICA = """block {name} "{title}"
{comments}
  Modelica.Blocks.Interfaces.RealInput u{x_unit} "{argument}";
{outputs}
  Modelica.Blocks.Tables.CombiTable1Ds table(
    table = [
      {rows}],
    columns = 2:{count},
    smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments,
    extrapolation = Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
equation
  connect(u, table.u);
{connections}
  annotation (uses(Modelica(version = "4.0.0")));
end {name};
"""
_C = """{comments}
#ifndef SLIPSTICK_{guard}_H
#define SLIPSTICK_{guard}_H

enum {{ {name}_count = {count} }};
{arrays}

static inline double {name}_change(double x)
{{
    if (x != x) {{
        return x; /* not a number */
    }}
    if (x <= {name}_x[0]) {{
        return {name}_y[0];
    }}
    for (int i = 1; i < {name}_count; ++i) {{
        if (x < {name}_x[i]) {{
            const double share = (x - {name}_x[i - 1]) / ({name}_x[i] - {name}_x[i - 1]);
            return {name}_y[i - 1] + share * ({name}_y[i] - {name}_y[i - 1]);
        }}
    }}
    return {name}_y[{name}_count - 1];
}}

#endif
"""
_MAT_TEXT = b"MATLAB 5.0 MAT-file, written by Slipstick".ljust(116)
"""What a MATLAB file begins with, instead of the time: the same law gives the same file."""
_UNIT = re.compile(r"(?:1|{0}(?:\.{0})*)(?:/(?:{0}|\({0}(?:[./]{0})*\)))?".format(r"[A-Za-z]+(?:-?\d+)?"))
"""Units of the Modelica language."""


class Format(NamedTuple):
    """A format of files of laws."""

    write: Callable[[LawTable], bytes]
    media_type: str


def write_law(law: LawTable, suffix: str) -> bytes:
    """The law as the bytes of a file that ends in `suffix`; raises `InvalidValue` for an unknown one."""
    if suffix not in FORMATS:
        raise InvalidValue(f"'{suffix}' is no format of a law", f"End the name in one of: {', '.join(FORMATS)}")
    return FORMATS[suffix].write(law)


def _write_csv(law: LawTable) -> bytes:
    """A row for each point, with headings such as `output_speed [rad/s]`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{column.name} [{column.unit}]" for column in law.columns)
    writer.writerows(zip(*(map(repr, column.values) for column in law.columns), strict=True))
    return text.getvalue().encode()


def _write_mat(law: LawTable) -> bytes:
    """A row vector for each column, its unit as text under its name with `_unit`, and what the law is."""
    from scipy.io import savemat  # here, because loading it takes longer than the rest of a model

    content = {**{column.name: np.array(column.values) for column in law.columns}, "quantity": law.quantity,
               "depends_on": law.depends_on, "relative": law.relative, "known_up_to": law.known_up_to,
               "band": law.band, **{f"{column.name}_unit": column.unit for column in law.columns}}
    file = io.BytesIO()
    savemat(file, content, oned_as="row")  # type: ignore[arg-type]
    return _MAT_TEXT + file.getvalue()[len(_MAT_TEXT):]


def _write_modelica(law: LawTable) -> bytes:
    """A block with the table: `u` in, and the change `y` and the other columns out."""
    point, change, *rest = law.columns
    outputs = [("y", _quote(f"{change.name} [{change.unit}]")), *((each.name, each.name) for each in rest)]
    text = _MODELICA.format(
        name=law.name, title=_quote(f"Measured law of the {law.quantity} over the {law.depends_on}"),
        comments=_comment(law, "  "), argument=_quote(f"{law.depends_on} [{point.unit}]"),
        x_unit=_declare_unit(point.unit), count=len(law.columns),
        outputs="\n".join(f'  Modelica.Blocks.Interfaces.RealOutput {name}{_declare_unit(change.unit)} "{about}";'
                          for name, about in outputs),
        rows=";\n      ".join(", ".join(map(repr, row))
                              for row in zip(*(column.values for column in law.columns), strict=True)),
        connections="\n".join(f"  connect(table.y[{place}], {name});" for place, (name, _) in enumerate(outputs, 1)))
    return text.encode()


def _write_c(law: LawTable) -> bytes:
    """A header in C99 with arrays of the columns, and a function of the change."""
    names = ["x", "y", *(column.name for column in law.columns[2:])]
    arrays = "\n".join(f"static const double {law.name}_{name}[] = {{\n    " + ",\n    ".join(map(repr, column.values))
                       + f"\n}}; /* {unit} */" for name, column in zip(names, law.columns, strict=True)
                       for unit in [column.unit.replace("*/", "* /")])
    return _C.format(comments=_comment(law), guard=law.name.upper(), name=law.name, count=len(law.x),
                     arrays=arrays).encode()


def _comment(law: LawTable, indent: str = "") -> str:
    """Lines that end in a full stop, as a backslash at the end of one would continue it."""
    return "\n".join(f"{indent}// {' '.join(sentence.split())}" for sentence in law.describe())


def _quote(text: str) -> str:
    """Text within quotes of Modelica."""
    return text.replace("\\", "\\\\").replace('"', '\\"')


def _declare_unit(unit: str) -> str:
    """The unit of a variable, such as N.m/(s.bar2) for N m/(s bar^2); nothing for one that Modelica lacks."""
    written = unit.replace(" ", ".").replace("^", "")
    return f'(unit = "{written}")' if _UNIT.fullmatch(written) else ""


FORMATS = {".csv": Format(_write_csv, "text/csv"), ".mat": Format(_write_mat, "application/octet-stream"),
           ".mo": Format(_write_modelica, "text/x-modelica"), ".h": Format(_write_c, "text/x-chdr")}
"""Suffix -> format."""
