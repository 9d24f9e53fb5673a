"""Paths of files: their endings, and the check that a file can be read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from geounfold.backends.system import files
from geounfold.errors import InputError
from geounfold.io.messages import shown

TABLE_ENDINGS = (".csv", ".csv.gz", ".parquet")
"""Endings of tables that are written, and read."""

_TEXT = (".csv", ".txt", ".asc", ".tsv", ".dat", ".xyz", ".prn")

TEXT_ENDINGS = (*(f"{kind}.gz" for kind in _TEXT), *_TEXT)
"""Endings of text tables that are read."""


_OTHERS = {
    ".npz": "a map of geounfold",
    ".json": "a JSON file, such as a summary",
    ".html": "a page, such as a report",
    ".htm": "a page, such as a report",
    ".toml": "a file of options, or a variogram",
    ".png": "a picture",
}
"""What files are that commands read or write beside points and surfaces, by their ending."""

_SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods")
_CLOSED = (".dm", ".bmf", ".mdl", ".dtm", ".00t", ".lfproj", ".aproj", ".tridb")
"""Files of Datamine, Vulcan, Surpac and Leapfrog that no open library reads."""

_SOME = 6  # endings that a message names

SWAPPED = "were two files swapped?"


def wrong_kind(path: Path, wanted: str, read: Sequence[str]) -> str:
    """Return the message on a file whose ending is none of those that are read.

    Parameters
    ----------
    path : Path
        The file.
    wanted : str
        What it is to hold: points, a surface.
    read : sequence of str
        The endings that are read, the usual ones first.

    Examples
    --------
    >>> wrong_kind(Path("s.json"), "points", [".csv"])
    's.json: is a JSON file, such as a summary, and holds no points: were two files swapped?'
    """
    kind = ending(path)
    if kind in _OTHERS:
        return f"{path}: is {_OTHERS[kind]}, and holds no {wanted}: {SWAPPED}"
    if kind in _SPREADSHEETS:
        return f"{path}: is a spreadsheet: save the sheet as .csv"
    if kind in _CLOSED:
        return f"{path}: is of a closed format: export it as .csv, surfaces as .dxf"
    told = f"the ending '{kind}' is none of" if kind else "a file without an ending is none of"
    some = ", ".join(read[:_SOME]) + (" and others" if len(read) > _SOME else "")
    return f"{path}: {told} the kinds that {wanted} are read from: {some}; save it as one of these"


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
    """Return the path of a file that can be read and is not empty, in a form of any length.

    Raises
    ------
    InputError
        No such file, a directory, a pipe or device, not readable, or empty.
    """
    path = files.reachable(path)
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
