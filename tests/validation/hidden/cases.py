"""Fixed lists of cases by id: `DEVELOPMENT` for developing a study, `FINAL`, `UNSEEN`, `ELSEWHERE`, `FRESH`, `LATER`,
`FURTHER`, `BEYOND`, `ABROAD`, `AFIELD`, `FARTHER`, `REMOTE`, `OUTLYING`, `DISTANT`, `OVERSEAS`, `POLAR`,
`AUSTRAL`, `BOREAL`, `ALPINE`, `GLACIAL`, `LUNAR` and `SOLAR` for judging it.
"""

import csv
from pathlib import Path

from .case import Case
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


DEVELOPMENT = read(_DATA / "development.csv")
FINAL = read(_DATA / "final.csv")
UNSEEN = read(_DATA / "unseen.csv")
ELSEWHERE = read(_DATA / "elsewhere.csv")
FRESH = read(_DATA / "fresh.csv")
LATER = read(_DATA / "later.csv")
FURTHER = read(_DATA / "further.csv")
BEYOND = read(_DATA / "beyond.csv")
ABROAD = read(_DATA / "abroad.csv")
AFIELD = read(_DATA / "afield.csv")
FARTHER = read(_DATA / "farther.csv")
REMOTE = read(_DATA / "remote.csv")
OUTLYING = read(_DATA / "outlying.csv")
DISTANT = read(_DATA / "distant.csv")
OVERSEAS = read(_DATA / "overseas.csv")
POLAR = read(_DATA / "polar.csv")
AUSTRAL = read(_DATA / "austral.csv")
BOREAL = read(_DATA / "boreal.csv")
ALPINE = read(_DATA / "alpine.csv")
GLACIAL = read(_DATA / "glacial.csv")
LUNAR = read(_DATA / "lunar.csv")
SOLAR = read(_DATA / "solar.csv")
LISTS = {"development": DEVELOPMENT, "final": FINAL, "unseen": UNSEEN, "elsewhere": ELSEWHERE, "fresh": FRESH,
         "later": LATER, "further": FURTHER, "beyond": BEYOND, "abroad": ABROAD, "afield": AFIELD,
         "farther": FARTHER, "remote": REMOTE, "outlying": OUTLYING, "distant": DISTANT, "overseas": OVERSEAS,
         "polar": POLAR, "austral": AUSTRAL, "boreal": BOREAL, "alpine": ALPINE, "glacial": GLACIAL,
         "lunar": LUNAR, "solar": SOLAR}
