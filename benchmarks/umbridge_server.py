"""The Python server of UM-Bridge with a table as its model: `python -m benchmarks.umbridge_server PORT TABLE`."""

import sys

import numpy as np
import umbridge

from slipstick.table import Table


class TableModel(umbridge.Model):
    """The shifting times of a table at one point."""

    def __init__(self, table: Table) -> None:
        super().__init__("nominal")
        self.table = table

    def get_input_sizes(self, config: dict[str, object]) -> list[int]:
        return [len(self.table.axes)]

    def get_output_sizes(self, config: dict[str, object]) -> list[int]:
        return [len(self.table.conditions)]

    def __call__(self, parameters: list[list[float]], config: dict[str, object]) -> list[list[float]]:
        return self.table.interpolate(np.array(parameters)).tolist()

    def supports_evaluate(self) -> bool:
        return True


if __name__ == "__main__":
    umbridge.serve_models([TableModel(Table.open(sys.argv[2]))], int(sys.argv[1]))
