"""OMF, the Open Mining Format: read in all versions, written by its Python library.

A file holds a project of elements; one of them is read: a point set, else a block model, whose
blocks' centroids become points; or a surface. Three layouts go by the same ending:

- version 1 (`version1`): w runs fastest through a volume's cells;
- version 2 (`version2`): a zip archive of Parquet tables; u runs fastest;
- the pre-release 2.0.0a0 of the Python library (`prerelease`): a zip archive of plain arrays.

Reading needs no library. The stable one reads version 1 only, the pre-release its own layout only,
and not all of what it writes. Writing (`writing`) needs it, and gives what the installed one can:
version 1 by ``omf`` 1.0.1, its own layout by 2.0.0a0 (extra ``formats``). Units and coordinate
reference are carried where the version has them. Floats come back bit for bit.
"""

from __future__ import annotations

import errno
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from geounfold.errors import InputError
from geounfold.io.formats.omf import prerelease, version1, version2
from geounfold.io.formats.omf.elements import Element, Kind
from geounfold.io.formats.omf.writing import write_points, write_surface
from geounfold.io.formats.registry import Points, Surface
from geounfold.io.messages import listing

__all__ = ["read_points", "read_surface", "write_points", "write_surface"]


def read_points(path: Path) -> Points:
    """Return the one point set of a file, or the one block model's blocks where there is none.

    Raises
    ------
    InputError
        Not an OMF file, or not one such element.
    """
    with _damage_told(path):
        elements = _elements(path)
        for kind in (Kind.POINTS, Kind.BLOCKS):
            found = _one(path, elements, kind)
            if found is not None:
                points: Points = found.load()
                return points
    raise InputError(f"{path}: holds neither a point set nor a block model")


def read_surface(path: Path) -> Surface:
    """Return the one triangulated surface of a file."""
    with _damage_told(path):
        found = _one(path, _elements(path), Kind.SURFACE)
        if found is None:
            raise InputError(f"{path}: holds no surface of triangles")
        surface: Surface = found.load()
        return surface


def _elements(path: Path) -> list[Element]:
    """Return what a file holds, whatever its version."""
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


def _one(path: Path, elements: list[Element], kind: Kind) -> Element | None:
    """Return the only element of a kind, or None where there is none."""
    found = [element for element in elements if element.kind is kind]
    if len(found) > 1:
        raise InputError(
            f"{path}: holds several elements of one kind ({listing(e.name for e in found)}); "
            "export the one that is meant"
        )
    return found[0] if found else None


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    """Make one InputError of what a damaged file brings about while it is taken apart."""
    try:
        yield
    except OSError as error:
        # The disk's fault, but that a broken gzip or Parquet has no number, and that a place before
        # the file's beginning, to which a wrong number leads, is no valid one.
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
