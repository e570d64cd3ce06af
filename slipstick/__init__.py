"""Find where the simulation of a machine and its test bench disagree, and which physical effect explains it.

    import slipstick

    bench = slipstick.Bench.open("heavy")
    recordings = slipstick.Recordings.open("sample")
    study = slipstick.study(bench, recordings)
    study.findings[0].law.plot()

The names below are the public interface (docs/python.md). They are imported when they are used: importing the package
takes no time. docs/architecture.md shows the packages behind them, and the direction of their imports.
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_PUBLIC = {
    "Bench": "bench", "Recordings": "recordings", "BlackBox": "black_box", "Table": "table",
    "Machine": "machine", "Runs": "machine",
    "simulate": "interface.simulate", "build": "interface.build", "calibrate": "interface.calibrate",
    "propagate": "interface.propagate", "likelihood": "interface.likelihood", "fit": "interface.fit",
    "study": "interface.study", "open_result": "interface.results"}
"""Public name -> the module that has it."""
__all__ = [
    "Bench",
    "BlackBox",
    "Machine",
    "Recordings",
    "Runs",
    "Table",
    "build",
    "calibrate",
    "fit",
    "likelihood",
    "open_result",
    "propagate",
    "simulate",
    "study",
]

if TYPE_CHECKING:
    from slipstick.bench import Bench
    from slipstick.black_box import BlackBox
    from slipstick.interface.build import build
    from slipstick.interface.calibrate import calibrate
    from slipstick.interface.fit import fit
    from slipstick.interface.likelihood import likelihood
    from slipstick.interface.propagate import propagate
    from slipstick.interface.results import open_result
    from slipstick.interface.simulate import simulate
    from slipstick.interface.study import study
    from slipstick.machine import Machine, Runs
    from slipstick.recordings import Recordings
    from slipstick.table import Table


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'slipstick' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"slipstick.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
