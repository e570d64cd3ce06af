"""Columns as a data frame of pandas or polars, whichever is installed."""

import importlib
from collections.abc import Mapping, Sequence
from typing import Any

from slipstick.errors import InvalidValue

_LIBRARIES = "pandas", "polars"


def data_frame(columns: Mapping[str, Sequence[Any]]) -> Any:
    """A `DataFrame` of pandas, or else of polars; raises `InvalidValue` where neither is installed.

    Headings have units, such as `mean [s]`.
    """
    for name in _LIBRARIES:
        try:
            library = importlib.import_module(name)
        except ImportError:
            continue
        return library.DataFrame({heading: list(column) for heading, column in columns.items()})
    raise InvalidValue("Neither pandas nor polars is installed", "Install one of them, such as `pip install pandas`")
