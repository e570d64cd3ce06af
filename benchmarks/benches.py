"""The shipped benches."""

from pathlib import Path

from slipstick.bench import Bench

TABLES = Path(__file__).parents[1] / "tables"
HEAVY = Bench.open(TABLES / "heavy.toml")
BENCHES = {bench.name: bench for bench in (HEAVY, Bench.open(TABLES / "compact.toml"))}
