"""The conditions of a machine: named columns of numbers."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

import h5py
import numpy as np

from slipstick.black_box.description import Quantity, require_name
from slipstick.errors import InvalidValue
from slipstick.numerics.quantities import describe_quantity
from slipstick.storage.hdf5 import Source, text


@dataclass(frozen=True, eq=False)
class Cases:
    """n conditions: `values` (n, k) of the k `quantities`. Raises `InvalidValue`."""

    quantities: tuple[Quantity, ...]
    values: np.ndarray

    def __post_init__(self) -> None:
        """Check shape and finiteness."""
        if self.values.ndim != 2 or self.values.shape[1] != len(self.quantities) or not len(self.values):
            raise InvalidValue(f"There are values of shape {self.values.shape} for {len(self.quantities)} columns",
                               "Give one number per condition and column")
        if not np.isfinite(self.values).all():
            raise InvalidValue("A number of a condition is not finite", "Give finite numbers")

    def __len__(self) -> int:
        return len(self.values)

    def columns(self, with_run_order: bool = False) -> list[np.ndarray]:
        """All that defines the conditions; a run order is not known."""
        return [self.values]

    @property
    def digest(self) -> str:
        """SHA-256 of columns, units and values at nine significant digits."""
        content = " ".join(f"{quantity.name} [{quantity.unit}]" for quantity in self.quantities) + "\n" + "\n".join(
            " ".join(f"{value:.9g}" for value in row) for row in self.values)
        return hashlib.sha256(content.encode()).hexdigest()

    @property
    def keys(self) -> list[str]:
        """A key of each condition: names, units and values to five digits, the precision of a file written by hand."""
        return [self.described(row) for row in range(len(self))]

    def described(self, row: int) -> str:
        """A condition in words."""
        return ", ".join(describe_quantity(quantity.name, value, quantity.unit)
                         for quantity, value in zip(self.quantities, self.values[row], strict=True))

    def take(self, indices: Sequence[int] | np.ndarray) -> "Cases":
        """The conditions at `indices`, in that order."""
        return Cases(self.quantities, self.values[np.asarray(indices, dtype=np.int64)])

    def write(self, file: h5py.File) -> None:
        """Write the group `conditions`: a dataset per column."""
        group = file.create_group("conditions")
        group.attrs["order"] = text(json.dumps([quantity.name for quantity in self.quantities]))
        for quantity, column in zip(self.quantities, self.values.T, strict=True):
            dataset = group.create_dataset(quantity.name, data=column, dtype="<f8", chunks=column.shape,
                                           fletcher32=True)
            dataset.attrs["units"] = text(quantity.unit)

    @classmethod
    def read(cls, source: Source) -> "Cases":
        """Read the group `conditions`; raises `source.error`."""
        length: int | None = None
        quantities, columns = [], []
        try:
            for name in json.loads(source.attribute("conditions", "order")):
                require_name(name)
                quantity = Quantity(name, source.attribute(f"conditions/{name}", "units"))
                column = source.array(f"conditions/{name}", "fiu", (length,), quantity.unit).astype(np.float64)
                length = len(column)
                quantities.append(quantity)
                columns.append(column)
            return cls(tuple(quantities), np.array(columns).T)
        except InvalidValue as error:
            raise source.error(error.cause, error.remedy) from error
