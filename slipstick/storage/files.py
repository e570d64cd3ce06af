"""Files that are whole or absent: written under a temporary name, synced, and only then put in place."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`; after the block it is synced and replaces `path`.

    Where the block raises, the temporary file goes and `path` stays as it was. A process killed on the way
    leaves at most a hidden `.NAME.*.tmp`, which nothing reads.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _sync(path.parent)


def move(source: Path, target: Path) -> None:
    """Put the synced file `source` in the place of `target`, on one file system, and sync both folders."""
    os.replace(source, target)
    _sync(target.parent)
    _sync(source.parent)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
