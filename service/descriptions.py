"""Conditions in words, wherever a response numbers them."""

from functools import lru_cache
from typing import Annotated

from pydantic import Field

from slipstick.pictures.conditions import described
from slipstick.table.subject import Setting, columns

Description = Annotated[str, Field(description="The condition in words: profile, motor speed, inertia and brake "
                                               "torque, or the columns of another machine.")]


@lru_cache(maxsize=64)
def descriptions(conditions: Setting) -> tuple[str, ...]:
    """Return all conditions of a table or of recordings in words."""
    given = columns(conditions)
    return tuple(described(given, place) for place in range(len(conditions)))
