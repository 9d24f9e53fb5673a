"""OMF, the Open Mining Format: read in all versions, written by its Python library.

A file holds a project of elements, of which one is read: a point set, a block model, whose
centroids become points, or a surface. If several fit, the user names one. Three layouts have the
same ending:

- version 1 (`version1`): w runs fastest through a volume's cells;
- version 2 (`version2`): a zip archive of Parquet tables; u runs fastest;
- the pre-release 2.0.0a0 of the Python library (`prerelease`): a zip archive of plain arrays.

Reading needs no library: the stable library reads version 1 only, and the pre-release only its own
layout, and not all of it. Writing (`writing`) needs the library (extra ``formats``): ``omf`` 1.0.1
writes version 1, and 2.0.0a0 its own layout. Units and coordinate reference are kept if the
version has them. Floats are read back bit for bit.
"""

from __future__ import annotations

import errno
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from geounfold.errors import InputError
from geounfold.io.formats.elements import Element, Kind, chosen
from geounfold.io.formats.omf import prerelease, version1, version2
from geounfold.io.formats.omf.writing import write_points, write_surface
from geounfold.io.formats.registry import Points, Surface

__all__ = ["elements_of", "read_points", "read_surface", "write_points", "write_surface"]


def read_points(path: Path, element: str | None = None) -> Points:
    """Return the point set of a file, or the blocks of its block model.

    Parameters
    ----------
    path : path
        The file.
    element : str, optional
        Name of the point set or block model, if there are several.

    Raises
    ------
    InputError
        The file is no OMF file or is damaged; it has no such element, or several and none is
        named.
    """
    with _damage_reported(path):
        found = chosen(path, _elements(path), (Kind.POINTS, Kind.BLOCKS), element)
        points: Points = found.load()
        return replace(points, element=found.name)


def read_surface(path: Path, element: str | None = None) -> Surface:
    """Return the triangulated surface of a file, or that of a name."""
    with _damage_reported(path):
        surface: Surface = chosen(path, _elements(path), (Kind.SURFACE,), element).load()
        return surface


def elements_of(path: Path) -> list[Element]:
    """Return the elements of a file, by name and kind."""
    with _damage_reported(path):
        return _elements(path)


def _elements(path: Path) -> list[Element]:
    """Return the elements of a file of any version."""
    with path.open("rb") as stream:
        head = stream.read(4)
    if head == version1.MAGIC:
        return version1.elements(path)
    if head[:2] != b"PK":
        raise InputError(f"{path}: is not an OMF file")
    try:
        with zipfile.ZipFile(path) as archive:
            comment, names = archive.comment, archive.namelist()
    except (zipfile.BadZipFile, EOFError, ValueError) as error:
        raise InputError(f"{path}: is no OMF file of version 2, or is damaged: {error}") from error
    if comment.startswith(version2.COMMENT):
        return version2.elements(path)
    if prerelease.INDEX in names:
        return prerelease.elements(path)
    raise InputError(f"{path}: is a zip archive, but no OMF file of version 2")


@contextmanager
def _damage_reported(path: Path) -> Iterator[None]:
    """Raise InputError for every error to which a damaged file leads while it is read."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        # An error of the disk has a number. Broken gzip or Parquet has none, and a position before
        # the file's beginning, to which a wrong number leads, gives EINVAL.
        if error.errno not in (None, errno.EINVAL):
            raise
        raise _damaged(path, error) from error
    except (
        ValueError, TypeError, LookupError, AttributeError, EOFError, RuntimeError,
        NotImplementedError, struct.error, zlib.error, zipfile.BadZipFile,
    ) as error:  # fmt: skip
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> InputError:
    words = " ".join(str(error).split())
    if isinstance(error, LookupError | TypeError | AttributeError):
        words = f"a part is missing or is not what it should be ({words})"
    return InputError(f"{path}: is an OMF file, but damaged: {words}")
