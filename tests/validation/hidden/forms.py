"""The effects of each list of cases, one module for each, and the benches on which a case may have each of them."""

from collections.abc import Mapping
from types import ModuleType

from . import (
    eighteenth,
    eighth,
    eleventh,
    fifteenth,
    fifth,
    fourteenth,
    fourth,
    nineteenth,
    ninth,
    seventeenth,
    seventh,
    sixteenth,
    sixth,
    tenth,
    third,
    thirteenth,
    twelfth,
    twentieth,
    twentyfirst,
    twentysecond,
    unseen,
)
from .effect import Effect
from .nominal import BRISK, COMPACT, HEAVY

MODULES = {"final": unseen, "unseen": third, "elsewhere": fourth, "fresh": fifth, "later": sixth, "further": seventh,
           "beyond": eighth, "abroad": ninth, "afield": tenth, "farther": eleventh, "remote": twelfth,
           "outlying": thirteenth, "distant": fourteenth, "overseas": fifteenth, "polar": sixteenth,
           "austral": seventeenth, "boreal": eighteenth, "alpine": nineteenth, "glacial": twentieth,
           "lunar": twentyfirst, "solar": twentysecond}
"""List -> the module with its effects and, from `fresh` on, their benches, in the order in which they were made."""
ON_DRAWN = tuple(list(MODULES)[list(MODULES).index("beyond"):])
"""The lists whose benches were drawn."""


def _effects(module: ModuleType) -> tuple[Effect, ...]:
    effects: tuple[Effect, ...] = getattr(module, module.__name__.rpartition(".")[2].upper())
    return effects


def _benches(module: ModuleType) -> Mapping[str, tuple[str, ...]]:
    """The benches that a module states; before `fresh`, all effects of a list are on the same ones."""
    on = (BRISK.name,) if module is fourth else (HEAVY.name, COMPACT.name)
    benches: Mapping[str, tuple[str, ...]] = getattr(module, "BENCHES", {one.name: on for one in _effects(module)})
    return benches


FORMS = {which: _effects(module) for which, module in MODULES.items()}
"""List -> its effects, which no other list has."""
BENCHES = {which: _benches(module) for which, module in MODULES.items()}
"""List -> name of each of its effects -> the benches on which a case may have it."""
