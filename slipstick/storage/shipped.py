"""Benches and recordings that are shipped with the package.

They are files of the folder `tables/` of the repository, which an installed wheel has as `slipstick/shipped`.
"""

from pathlib import Path

_INSTALLED = Path(__file__).parents[1] / "shipped"
FOLDER = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[2] / "tables"
"""The folder of the shipped files."""


def file_of(name: Path | str, suffix: str, folder: str = "") -> Path:
    """The file that `name` means: the file at this path, or else, for a plain name, the shipped file of that name,
    in a `folder` of the shipped ones.

    Where there is neither, `name` is returned as a path, whose reader says that it does not exist.
    """
    path = Path(name)
    if path.is_file() or path.parent != Path():
        return path
    shipped = FOLDER / folder / f"{path.name.removesuffix(suffix)}{suffix}"
    return shipped if shipped.is_file() else path
