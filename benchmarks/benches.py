"""The shipped benches, and all that recordings of hidden effects come from."""

from pathlib import Path

from slipstick.bench import Bench

ROOT = Path(__file__).parents[1]
HEAVY = Bench.open(ROOT / "tables" / "heavy.toml")
SHIPPED = {bench.name: bench for bench in (HEAVY, Bench.open(ROOT / "tables" / "compact.toml"))}
HIDDEN = ROOT / "tests" / "validation" / "hidden" / "data"
BRISK, GIANT, LIGHT, SLOW = (Bench.open(HIDDEN / f"{name}.toml") for name in ("brisk", "giant", "light", "slow"))
DRAWN = {bench.name: bench for bench in map(Bench.open, sorted((HIDDEN / "drawn").glob("*.toml")))}
BENCHES = {**SHIPPED, BRISK.name: BRISK, GIANT.name: GIANT, LIGHT.name: LIGHT, SLOW.name: SLOW, **DRAWN}
