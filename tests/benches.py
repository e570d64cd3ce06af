"""The shipped benches."""

from pathlib import Path

from slipstick.bench import Bench
from slipstick.clutch.model import Model

TABLES = Path(__file__).parents[1] / "tables"
HEAVY = Bench.open(TABLES / "heavy.toml")
COMPACT = Bench.open(TABLES / "compact.toml")
BENCHES = (HEAVY, COMPACT)
NOMINAL = Model(HEAVY.physics)
"""The nominal model of the first."""
