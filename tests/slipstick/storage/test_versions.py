"""Files that are opened again only if they have changed."""

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from slipstick.storage import versions
from slipstick.table import Table


class Read:
    """What stands for the content of a file."""


def test_who_asks_for_a_table_while_it_is_read_gets_the_same_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                 ) -> None:
    both, reads = threading.Barrier(2, timeout=1.0), list[Path]()

    def read(path: Path) -> Read:
        reads.append(path)
        with suppress(threading.BrokenBarrierError):
            both.wait()  # two that read at once would meet here
        return Read()

    monkeypatch.setattr(Table, "open", read)
    version = (tmp_path / "table.h5", 1, 1)
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(versions.open_table, [version] * 2)
    assert first is second is versions.known_table(version)
    assert len(reads) == 1
