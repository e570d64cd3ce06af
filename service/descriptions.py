"""Conditions in words, wherever a response numbers them."""

from typing import Annotated

from pydantic import Field

from slipstick.interface.tables import descriptions

__all__ = ["Description", "descriptions"]

Description = Annotated[str, Field(description="The condition in words: profile, motor speed, inertia and brake "
                                               "torque, or the columns of another machine.")]
