"""The notebooks run, and what is kept in them is what they compute."""

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = [Path(__file__).parents[1] / "docs" / f"{name}.ipynb" for name in ("quickstart", "your_machine")]
_TEXT, _SPECIFICATION = "text/plain", "application/vnd.vegalite.v5+json"


def outputs(notebook: Any) -> list[list[Any]]:
    """What each cell of code shows: text, and specifications of pictures."""
    return [[shown.get("text") or shown["data"].get(_SPECIFICATION) or shown["data"][_TEXT] for shown in cell.outputs]
            for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_was_executed_in_order_without_an_error(notebook: Path) -> None:
    cells = [cell for cell in nbformat.read(notebook, as_version=4).cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert not [shown for cell in cells for shown in cell.outputs if shown.output_type in ("error", "stream")
                and shown.get("name") != "stdout"]


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_computes_what_is_kept_in_it(notebook: Path, tmp_path: Path) -> None:
    kept = nbformat.read(notebook, as_version=4)
    fresh = nbformat.read(notebook, as_version=4)
    NotebookClient(fresh, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert outputs(fresh) == outputs(kept)
    if notebook.stem == "quickstart":
        assert (tmp_path / "study.html").stat().st_size > 100_000
