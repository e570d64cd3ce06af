"""Atomic file replacement: a file is written under a temporary name, synced, and then renamed."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`; after the block the file is synced and replaces `path`.

    If the block raises, the temporary file is deleted and `path` is unchanged. A process killed inside the block
    leaves at most a hidden file `.NAME.*.tmp`, which is never read.
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
    """Replace `target` by the synced file `source` on the same file system, and sync both folders."""
    os.replace(source, target)
    _sync(target.parent)
    _sync(source.parent)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
