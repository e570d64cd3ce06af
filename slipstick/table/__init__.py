"""Tables of shifting times, on a grid or as a surrogate: file layout, verification and interpolation."""

from slipstick.table.axis import Axis
from slipstick.table.derivatives import Derivatives
from slipstick.table.grid import Grid
from slipstick.table.network import Network
from slipstick.table.points import Outside
from slipstick.table.surrogate import HeldOut, Surrogate
from slipstick.table.table import Table

__all__ = ["Axis", "Derivatives", "Grid", "HeldOut", "Network", "Outside", "Surrogate", "Table"]
