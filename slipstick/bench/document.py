"""A TOML document whose values are taken with checks, and whose errors name the key and its line."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import BadBench
from slipstick.numerics.quantities import NotAQuantity, convert, in_unit

_HEADER = re.compile(r"^\s*\[{1,2}\s*([^\]]+?)\s*\]{1,2}")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\" -]+?)\s*=")
_QUOTES = re.compile(r'"""|\'\'\'')


@dataclass(frozen=True)
class Section:
    """One table of the document: its `values`, the dotted `path` to it, and the document it is part of."""

    values: dict[str, Any]
    path: str
    document: "Document"

    def error(self, key: str, cause: str, remedy: str) -> BadBench:
        """The error about one key of this section, with its line."""
        return self.document.error(f"{self.path}.{key}" if self.path else key, cause, remedy)

    def keys(self, known: tuple[str, ...]) -> None:
        """Refuse keys that are not `known`: a misspelt key would otherwise be ignored."""
        for key in self.values:
            if key not in known:
                near = get_close_matches(key, known, n=1)
                hint = f"Did you mean '{near[0]}'? " if near else ""
                raise self.error(key, "the key is unknown", f"{hint}Known here: {', '.join(known)}")

    def section(self, key: str) -> "Section":
        """The table `key`, empty where it is absent."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, "a table is needed", f"Write a header [{key}], or {key} = {{ ... }}")
        return Section(value, f"{self.path}.{key}" if self.path else key, self.document)

    def text(self, key: str, default: str | None = None) -> str:
        """A text; required unless there is a default."""
        value = self._value(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"{value!r} is not a text", "Put it into quotation marks")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self._value(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"{value!r} is neither true nor false",
                             "Write true or false, without quotation marks")
        return value

    def quantity(self, key: str, unit: str, default: float | None = None) -> float:
        """A number in `unit`, written with any unit of the same dimension."""
        if key not in self.values and default is not None:
            return default
        value = self._value(key)
        try:
            return in_unit(value, unit)
        except NotAQuantity as error:
            raise self.error(key, str(error), error.remedy or _example(unit)) from None

    def numbers(self, key: str, unit: str) -> np.ndarray:
        """Numbers (k,) in `unit`: a list where the unit is 1, else { values = [...], unit = "..." }."""
        value = self._value(key)
        written = ""
        if isinstance(value, dict):
            inner = Section(value, f"{self.path}.{key}" if self.path else key, self.document)
            inner.keys(("values", "unit"))
            written, value = inner.text("unit"), inner._value("values")
        if not isinstance(value, list) or not value or any(isinstance(x, bool) or not isinstance(x, int | float)
                                                           for x in value):
            raise self.error(key, "a list of numbers is needed",
                             f'Write {key} = {{ values = [1, 2], unit = "{unit}" }}' if unit != "1"
                             else f"Write {key} = [1, 2]")
        try:
            return convert(np.array([float(str(x)) for x in value]), written, unit)
        except NotAQuantity as error:
            raise self.error(key, str(error), error.remedy or f'Write {key} = {{ values = [...], unit = "{unit}" }}, '
                             "with the unit that the values have") from None

    def _value(self, key: str, default: Any = None) -> Any:
        if key in self.values:
            return self.values[key]
        if default is None:
            raise self.error(key, "the key is missing", "Add it; `slipstick bench new FILE` writes a template")
        return default


@dataclass(frozen=True)
class Document:
    """A parsed TOML file: the `name` it is called in errors, its folder, and the line of every key."""

    name: str
    folder: Path | None
    values: dict[str, Any]
    lines: dict[str, int]

    @classmethod
    def read(cls, text: str, name: str, folder: Path | None = None) -> "Document":
        """Parse `text`; raises `BadBench` with the line where it is not TOML."""
        try:
            values = tomllib.loads(text)
        except (ValueError, RecursionError) as error:  # tomllib raises these on numbers and lists without end
            raise BadBench(f"{name} is not TOML: {error}",
                           "Correct that line; https://toml.io shows the syntax") from None
        return cls(name, folder, values, dict(_lines(text)))

    @property
    def root(self) -> Section:
        """The whole document as a section."""
        return Section(self.values, "", self)

    def error(self, path: str, cause: str, remedy: str) -> BadBench:
        """The error about the key at a dotted path; the line is that of the nearest part of the path that has one."""
        parts = path.split(".")
        for length in range(len(parts), 0, -1):
            line = self.lines.get(_plain(".".join(parts[:length])))
            if line is not None:
                return BadBench(f"{self.name}, line {line}, {path}: {cause}", remedy)
        return BadBench(f"{self.name}, {path}: {cause}", remedy)


def _lines(text: str) -> Iterator[tuple[str, int]]:
    """Dotted path and line number of every header and key; elements of [[lists]] are numbered from 0."""
    prefix, counts, quoted = "", dict[str, int](), False
    for number, line in enumerate(text.splitlines(), 1):
        was_quoted, quoted = quoted, quoted ^ (len(_QUOTES.findall(line)) % 2 == 1)
        if was_quoted:
            continue  # a text over several lines has no keys
        if header := _HEADER.match(line):
            prefix = _plain(header[1])
            if line.lstrip().startswith("[["):
                counts[prefix] = counts.get(prefix, -1) + 1
                prefix = f"{prefix}.{counts[prefix]}"
            yield f"{prefix}", number
            prefix += "."
        elif key := _KEY.match(line):
            yield f"{prefix}{_plain(key[1])}", number


def _plain(path: str) -> str:
    """A dotted path without quotation marks and spaces, which names in it may have."""
    return path.replace('"', "").replace(" ", "")


def _example(unit: str) -> str:
    return ("Give a plain number" if unit == "1" else
            f'Write a number with a decimal point, a space and its unit, in quotation marks, such as "1.5 {unit}"')
