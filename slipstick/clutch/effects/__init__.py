"""The catalogue: one physical effect that the paper's model lacks per file of this folder.

To add one, copy a file, change it, and run the tests: nothing else has to be edited (docs/add_an_effect.md).
"""

import importlib
import pkgutil

import numpy as np

from slipstick.clutch.effects.effect import Coefficient, Effect
from slipstick.errors import InvalidValue, UnknownName

__all__ = ["CATALOGUE", "Coefficient", "Effect", "find", "index", "neutral", "span"]

_FILES = sorted(module.name for module in pkgutil.iter_modules(__path__) if module.name != "effect")
_MODULES = [importlib.import_module(f"{__name__}.{name}") for name in _FILES]


def _collected() -> tuple[Effect, ...]:
    """The effects of all files; raises `InvalidValue` naming the file that has none, or one of another's name."""
    found: dict[str, Effect] = {}
    for module in _MODULES:
        one = getattr(module, "EFFECT", None)
        file = f"{module.__name__.rsplit('.', 1)[1]}.py"
        for effect in getattr(module, "EFFECTS", (one,)):
            if effect is None:
                raise InvalidValue(f"The file {file} of the catalogue has no EFFECT", "Define one, or move it out")
            if effect.name in found:
                raise InvalidValue(f"The file {file} has an effect '{effect.name}', and another file has one already",
                                   "Give it another name: files are often copied")
            found[effect.name] = effect
    return tuple(found.values())


CATALOGUE: tuple[Effect, ...] = _collected()
"""The effects in the order of their files."""


def neutral() -> np.ndarray:
    """Neutral value of every coefficient, in the order of the catalogue: shape (c,)."""
    return np.array([value for effect in CATALOGUE for value in effect.neutral])


def find(name: str) -> Effect:
    """The effect of that name; raises `UnknownName`."""
    for effect in CATALOGUE:
        if effect.name == name:
            return effect
    raise UnknownName.of("effect", name, [effect.name for effect in CATALOGUE])


def index(effect: str, coefficient: str) -> int:
    """Position of a coefficient in every coefficient vector; raises `UnknownName`."""
    names = [known.name for known in find(effect).coefficients]
    if coefficient not in names:
        raise UnknownName.of(f"coefficient of {effect}", coefficient, names)
    return int(span(find(effect)).start) + names.index(coefficient)


def span(effect: Effect) -> slice:
    """Where the coefficients of `effect` stand in every coefficient vector."""
    first = sum(len(entry.coefficients) for entry in CATALOGUE[:CATALOGUE.index(effect)])
    return slice(first, first + len(effect.coefficients))
