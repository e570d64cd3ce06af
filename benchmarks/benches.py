"""The shipped benches."""

from pathlib import Path

from slipstick.bench import Bench

TABLES = Path(__file__).parents[1] / "tables"
HEAVY = Bench.open(TABLES / "heavy.toml")
