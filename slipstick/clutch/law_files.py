"""Laws as files: columns with units, as CSV and for MATLAB."""

import csv
import io
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Column(NamedTuple):
    """A column of a file."""

    name: str
    unit: str
    values: Sequence[float]


def columns(quantity: str, depends_on: str, units: tuple[str, str], at: Sequence[float], change: Sequence[float],
            relative: bool) -> tuple[Column, Column]:
    """The points of a law and its change at them, as columns."""
    name = f"{identifier(quantity)}_{'relative_' if relative else ''}change"
    return Column(identifier(depends_on), units[0], at), Column(name, units[1], change)


def identifier(words: str) -> str:
    """Words as a name that programs accept, such as output_speed."""
    return re.sub(r"\W+", "_", words).strip("_")


def to_csv(columns: Sequence[Column]) -> str:
    """A row for each point, with headings such as `output_speed [rad/s]`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{column.name} [{column.unit}]" for column in columns)
    writer.writerows(zip(*(map(repr, column.values) for column in columns), strict=True))
    return text.getvalue()


def to_mat(columns: Sequence[Column], **more: str | bool) -> bytes:
    """A MATLAB file: a row vector for each column, its unit as text under its name with `_unit`, and what is `more`."""
    from scipy.io import savemat  # here, because loading it takes longer than the rest of a model

    content = {**{column.name: np.array(column.values) for column in columns}, **more,
               **{f"{column.name}_unit": column.unit for column in columns}}
    file = io.BytesIO()
    savemat(file, content, oned_as="row")  # type: ignore[arg-type]
    return file.getvalue()
