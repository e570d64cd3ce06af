"""Laws with more knots, as long as these gain enough."""

from collections.abc import Callable
from typing import Protocol, TypeVar


class Refinable(Protocol):
    """A law that was fitted: its gain in `nats`, with a resolution that has been doubled `finer` times."""

    @property
    def finer(self) -> int: ...  # noqa: D102

    @property
    def nats(self) -> float: ...  # noqa: D102


Law = TypeVar("Law", bound=Refinable)


def finer_while(law: Law, most: int, doubled: Callable[[Law], Law], nats: float, share: float = 0.0) -> Law:
    """A law `doubled` up to `most` times, as long as each doubling gains so many `nats`, and a `share` of its gain."""
    while law.finer < most:
        finer = doubled(law)
        if finer.nats < law.nats + max(nats, share * law.nats):
            break
        law = finer
    return law
