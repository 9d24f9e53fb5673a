"""Files of strings (polylines), read and written by their ending."""

from __future__ import annotations

from pathlib import Path

from geounfold.errors import InputError, OutputError
from geounfold.io.formats import Strings, find_format, string_endings
from geounfold.io.paths import ending, existing_file
from geounfold.io.polylines import write_polylines
from geounfold.io.surfaces import holds_surface

STRINGS_OUT = (*string_endings(), ".vtp")
"""Endings of the files that strings are written to."""


def holds_strings(path: str | Path) -> bool:
    """Return whether a file is one of strings: by its ending, and no faces are in it."""
    found = find_format(ending(Path(path)), "strings")
    if found is None:
        return False
    return not found.reads_surface or not holds_surface(path)


def read_strings(path: str | Path) -> Strings:
    """Return the strings of a file.

    Raises
    ------
    InputError
        The ending is unknown, or the file cannot be read or holds no strings.
    MissingDependencyError
        The format's library is not installed.
    """
    path = existing_file(Path(path))
    found = find_format(ending(path), "strings")
    if found is None:
        known = ", ".join(string_endings())
        raise InputError(f"{path}: unknown kind of strings; files end in {known}")
    strings: Strings = found.load().read_strings(path)
    return strings


def write_strings(path: str | Path, strings: Strings) -> None:
    """Write strings by the path's ending; coordinates are read back bit for bit.

    Raises
    ------
    OutputError
        The ending is unknown, or the format cannot hold the values.
    """
    path = Path(path)
    found = find_format(ending(path), "strings")
    if found is not None:
        found.load().write_strings(path, strings)
    elif ending(path) == ".vtp":
        write_polylines(path, strings.xyz, strings.first, {}, {"name": strings.names})
    else:
        raise OutputError(f"{path}: strings cannot be written as '{ending(path)}'")
