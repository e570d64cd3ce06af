"""Fixed lists of cases by id: `development` for developing a study, those of forms.py for judging it."""

import csv
from pathlib import Path

from .case import Case
from .forms import FORMS
from .nominal import SETUPS
from .temptations import TEMPTATIONS, tempted
from .world import INGREDIENTS, World, draw

_DATA = Path(__file__).parent / "data"


def read(path: Path) -> dict[str, Case]:
    """Read a list of cases, one per row: `effects` are `name:strength`, `world` are ingredients and temptations,
    joined by `+`. `world` may also be "none", and "any" stands for all ingredients.
    """
    with path.open() as file:
        return {row["id"]: _case(row) for row in csv.DictReader(file)}


def _case(row: dict[str, str]) -> Case:
    effects = dict(entry.split(":") for entry in row["effects"].split("+") if entry)
    return Case({name: float(strength) for name, strength in effects.items()}, int(row["seed"]),
                count=int(row["count"]), bench=row["bench"],
                world=_world(row["world"], int(row["seed"]), row["bench"]))


def _world(text: str, seed: int, bench: str) -> World | None:
    if text == "none":
        return None
    names = [name for part in text.split("+") for name in (INGREDIENTS if part == "any" else (part,))]
    world = draw(seed, SETUPS[bench], [name for name in names if name not in TEMPTATIONS])
    return tempted(world, seed, [name for name in names if name in TEMPTATIONS])


LISTS = {which: read(_DATA / f"{which}.csv") for which in ("development", *FORMS)}
