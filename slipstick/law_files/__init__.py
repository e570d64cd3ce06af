"""Measured laws as files for other programs: CSV, MATLAB, Modelica and C; and the equations of named effects."""

from slipstick.law_files.equation import insert_values
from slipstick.law_files.formats import FORMATS, write_law
from slipstick.law_files.table import LawTable, identifier

__all__ = ["FORMATS", "LawTable", "identifier", "insert_values", "write_law"]
