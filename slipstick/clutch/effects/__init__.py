"""The catalogue of effects: each file of this folder defines a physical effect that the paper's model lacks.

To add an effect, copy a file, change it, and run the tests; no other file changes (docs/add_an_effect.md).
"""

import importlib
import pkgutil
from collections.abc import Iterator

import numpy as np

from slipstick.clutch.effects.effect import Coefficient, Effect, check_pair
from slipstick.clutch.effects.shape import Shape
from slipstick.errors import InvalidValue, UnknownName

__all__ = ["CATALOGUE", "Coefficient", "Effect", "Shape", "find", "index", "matching", "neutral", "span", "spans"]

_NO_EFFECTS = ("effect", "shape")
_FILES = sorted(module.name for module in pkgutil.iter_modules(__path__) if module.name not in _NO_EFFECTS)
_MODULES = [importlib.import_module(f"{__name__}.{name}") for name in _FILES]


def _collect() -> tuple[Effect, ...]:
    """The effects of all files; raises `InvalidValue` for a file without an effect and for a duplicate name."""
    collected: dict[str, Effect] = {}
    for module in _MODULES:
        file = f"{module.__name__.rsplit('.', 1)[1]}.py"
        for effect in getattr(module, "EFFECTS", (getattr(module, "EFFECT", None),)):
            if effect is None:
                raise InvalidValue(f"The file {file} of the catalogue defines no EFFECT",
                                   "Define one, or move the file out of the folder")
            if effect.name in collected:
                raise InvalidValue(f"The file {file} defines '{effect.name}', which another file defines too",
                                   "Change the name of one of them")
            collected[effect.name] = effect
    return tuple(collected.values())


CATALOGUE: tuple[Effect, ...] = _collect()
"""The effects in the order of their files."""


def neutral() -> np.ndarray:
    """Neutral value of every coefficient, in catalogue order: shape (c,)."""
    return np.array([value for effect in CATALOGUE for value in effect.neutral])


def find(name: str) -> Effect:
    """The effect named `name`; raises `UnknownName`."""
    for effect in CATALOGUE:
        if effect.name == name:
            return effect
    raise UnknownName.of("effect", name, [effect.name for effect in CATALOGUE])


def matching(quantity: str, depends_on: str) -> tuple[Effect, ...]:
    """The effects that a study may find as this pair; raises `UnknownName` for an unknown word."""
    check_pair(quantity, depends_on)
    return tuple(effect for effect in CATALOGUE if (quantity, depends_on) in effect.pairs)


def index(effect: str, coefficient: str) -> int:
    """Index of a coefficient in the coefficient vector; raises `UnknownName`."""
    names = [entry.name for entry in find(effect).coefficients]
    if coefficient not in names:
        raise UnknownName.of(f"coefficient of {effect}", coefficient, names)
    return int(span(find(effect)).start) + names.index(coefficient)


def span(effect: Effect) -> slice:
    """Slice of the coefficient vector that holds the coefficients of `effect`, of the catalogue or on a bench."""
    return next(place for entry, place in spans() if entry.name == effect.name)


def spans() -> Iterator[tuple[Effect, slice]]:
    """The effects, each with the slice of the coefficient vector that holds its coefficients."""
    first = 0
    for effect in CATALOGUE:
        yield effect, slice(first, first := first + len(effect.coefficients))
