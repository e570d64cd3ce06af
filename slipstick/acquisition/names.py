"""Unique names of the channels of a file, whose headings may be equal, or equal but for what is in brackets."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from slipstick.acquisition.channel import unknown_channel
from slipstick.acquisition.units import split_bracket, split_unit
from slipstick.errors import BadRecording


@dataclass(frozen=True, eq=False)
class Names:
    """Positions of channels in a file by their unique names, and `aliases` that may fit several channels."""

    source: str
    positions: dict[str, int]
    aliases: dict[str, list[int]]

    @classmethod
    def of_headings(cls, source: str, headings: Sequence[str], places: Sequence[str]) -> "Names":
        """Names from headings such as `n_mot [rpm]`, whose unit is left out where the rest is unique."""
        bare = [split_bracket(heading)[0] for heading in headings]
        count = Counter(bare)
        names = [split_unit(heading)[0] if count[rest] == 1 else heading.strip()
                 for heading, rest in zip(headings, bare, strict=True)]
        return cls._unique(source, names, places, [{heading.strip(), rest} for heading, rest in
                                                   zip(headings, bare, strict=True)])

    @classmethod
    def plain(cls, source: str, names: Sequence[str], places: Sequence[str]) -> "Names":
        """Names that are not divided, whatever brackets they have."""
        return cls._unique(source, names, places, [{name} for name in names])

    @classmethod
    def _unique(cls, source: str, names: Sequence[str], places: Sequence[str],
                others: Sequence[set[str]]) -> "Names":
        """Of equal names each is followed by its place in the file, as in `M@4`; a channel may have no name."""
        count = Counter(names)
        positions: dict[str, int] = {}
        aliases: dict[str, list[int]] = {}
        for position, (name, place, also) in enumerate(zip(names, places, others, strict=True)):
            if not name:
                continue
            unique = name if count[name] == 1 else f"{name}@{place}"
            while unique in positions:  # where another channel is really called so
                unique = f"{unique}@{place}"
            positions[unique] = position
            for alias in also:
                aliases.setdefault(alias, []).append(position)
        return cls(source, positions, aliases)

    def position(self, name: str) -> int:
        """The channel of a name, or of a heading that no other channel has; raises `BadRecording`."""
        if name in self.positions:
            return self.positions[name]
        alike = self.aliases.get(name, [])
        if len(alike) > 1:
            names = [unique for unique, position in self.positions.items() if position in alike]
            raise BadRecording(f"{self.source} has {len(alike)} channels '{name}'",
                               f"Map one of them by its own name: {', '.join(names[:20])}")
        if not alike:
            raise unknown_channel(self.source, name, self.positions)
        return alike[0]
