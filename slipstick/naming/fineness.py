"""Laws with more knots, as long as these gain enough."""

from collections.abc import Callable
from typing import Protocol, TypeVar


class Refinable(Protocol):
    """A law that was fitted: its gain in `nats`, with a resolution that has been doubled `finer` times."""

    @property
    def finer(self) -> int: ...  # noqa: D102

    @property
    def nats(self) -> float: ...  # noqa: D102


One = TypeVar("One", bound=Refinable)


def finer_while(found: One, most: int, doubled: Callable[[One], One], nats: float, share: float = 0.0) -> One:
    """A law `doubled` up to `most` times, as long as each doubling gains so many `nats`, and a `share` of its gain."""
    while found.finer < most:
        finer = doubled(found)
        if finer.nats < found.nats + max(nats, share * found.nats):
            break
        found = finer
    return found
