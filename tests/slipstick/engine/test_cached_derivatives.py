"""The machine code of derivatives that numba keeps is that of all files from which it is made."""

from pathlib import Path
from typing import Any

from slipstick.engine import stepping, tangents
from slipstick.numerics.linking import digest_files


def test_the_cache_of_derivatives_covers_the_file_of_the_operations(tmp_path: Path) -> None:
    entry: Any = tangents._differentiate
    cell, = entry.py_func.__closure__
    index, codegen = entry._cache._index_key, entry.targetctx.codegen()
    before = index(None, codegen)
    cell.cell_contents = "of another stepping.py"
    try:
        assert index(None, codegen) != before
    finally:
        cell.cell_contents = tangents._KEY
    source = Path(stepping.__file__)
    edited = tmp_path / source.name
    edited.write_text(source.read_text() + "\n")
    assert digest_files([edited]) != digest_files([source])
