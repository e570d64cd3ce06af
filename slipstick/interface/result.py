"""What all results have in common: they are saved as JSON, opened again, drawn, and shown in a notebook."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from slipstick import __version__
from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.files import require_suffix, write
from slipstick.interface.picture import Picture
from slipstick.pictures.rendering import has_renderer, inline
from slipstick.pictures.theme import Spec
from slipstick.report.markup import paragraph

HEAD = ("kind", "version")
"""Fields that the file of a result has beside the result."""


class Result(ABC):
    """What every result has: numbers with units, pictures, a summary, and the digests of what made it.

    A notebook shows the summary and the main picture.
    """

    kind: ClassVar[str]
    """What the result is of, such as `study`; the file of a result says it."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The result as JSON, which `from_dict` reads."""

    @classmethod
    @abstractmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The result whose `to_dict` is `values`; raises `InvalidValue`."""

    @abstractmethod
    def to_frame(self) -> Any:
        """The main table of the result as a data frame of pandas or polars, with units in its headings."""

    @abstractmethod
    def summary(self) -> list[str]:
        """The result in words: paragraphs, the answer first."""

    @abstractmethod
    def pictures(self) -> dict[str, tuple[Spec, str]]:
        """Name of each picture of the result, the main one first -> its Vega-Lite specification and its caption."""

    def plot(self, name: str | None = None) -> Picture:
        """The picture `name` of the result, by default the main one; raises `UnknownName`."""
        specs = self.pictures()
        if not specs:
            raise InvalidValue(f"There is no picture of this {self.kind}", "See its summary()")
        if name is None:
            name = next(iter(specs))
        if name not in specs:
            raise UnknownName.of("picture", name, specs)
        return Picture(name, *specs[name])

    def save(self, path: Path | str) -> Path:
        """Write the result as a JSON file, which `slipstick.open_result` reads, and return its path.

        Raises `InvalidValue` unless `path` ends in `.json`.
        """
        require_suffix(path, ".json")
        content = {"kind": self.kind, "version": __version__, **self.to_dict()}
        return write(path, (json.dumps(content, indent=1) + "\n").encode())

    def __repr__(self) -> str:
        return "\n".join(self.summary())

    def _repr_html_(self) -> str:
        """What a notebook shows: the summary, and the main picture where the renderer is installed."""
        parts = [paragraph(text) for text in self.summary()]
        specs = self.pictures()
        if specs and has_renderer():
            name, (spec, caption) = next(iter(specs.items()))
            parts.append(inline({name: spec}, {name: caption})[name])
        return "\n".join(parts)
