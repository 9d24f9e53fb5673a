"""Paths of files: their endings, and the check that a file can be read."""

from __future__ import annotations

from pathlib import Path

from geounfold.errors import InputError
from geounfold.io.messages import shown

TABLE_ENDINGS = (".csv", ".csv.gz", ".parquet")
"""Endings of tables that are written, and read."""

_TEXT = (".csv", ".txt", ".asc", ".tsv", ".dat", ".xyz", ".prn")

TEXT_ENDINGS = (*(f"{kind}.gz" for kind in _TEXT), *_TEXT)
"""Endings of text tables that are read."""


def ending(path: Path) -> str:
    """Return a file's ending in lower case; that of a compressed text, ``.csv.gz``, counts as one.

    Examples
    --------
    >>> ending(Path("Blocks.v2.CSV.GZ"))
    '.csv.gz'
    """
    name = path.name.lower()
    return next((kind for kind in TEXT_ENDINGS if name.endswith(kind)), Path(name).suffix)


def existing_file(path: Path) -> Path:
    """Return the path of a file that can be read and is not empty.

    Raises
    ------
    InputError
        No such file, a directory, a pipe or device, not readable, or empty.
    """
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a directory, not a file")
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: is a pipe or a device; save its content to a file first")
        with path.open("rb") as stream:
            if not stream.read(1):
                raise InputError(f"{path}: the file is empty")
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{shown(path)}: cannot be read: {reason}") from error
    return path
