"""Files of results: written whole, or not at all."""

import datetime
from collections.abc import Iterable
from pathlib import Path

from slipstick.errors import InvalidValue
from slipstick.law_files import FORMATS, LawTable, write_law
from slipstick.pictures.rendering import require_renderer
from slipstick.storage.files import replacing


def write(path: Path | str, content: bytes) -> Path:
    """Write `content` to `path`, in a folder that is made where it is missing, and return the path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return path


def write_laws(folder: Path | str, laws: Iterable[LawTable | None]) -> list[Path]:
    """Write each law, numbered from 1, as a file of each format into a `folder`; return the paths."""
    return [write(Path(folder) / f"{number}_{law.name}{suffix}", write_law(law, suffix))
            for number, law in enumerate(laws, 1) if law is not None for suffix in FORMATS]


def require_suffix(path: Path | str, suffix: str) -> None:
    """Raise `InvalidValue` for a path with another suffix: other files, such as recordings, must not be replaced."""
    path = Path(path)
    if path.suffix != suffix or path.is_dir():
        raise InvalidValue(f"'{path}' is not the name of a {suffix} file", f"Give a path that ends in {suffix}")


def require_html(path: Path | str) -> None:
    """Raise `InvalidValue` unless a report can be written to `path`."""
    require_suffix(path, ".html")
    require_renderer()


def now() -> str:
    """The present time in UTC, as in the answers of the service."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
