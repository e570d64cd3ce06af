"""Tables of shifting times: layout on file, verification and interpolation."""

from slipstick.table.axis import Axis
from slipstick.table.interpolation import Outside
from slipstick.table.table import Table

__all__ = ["Axis", "Outside", "Table"]
