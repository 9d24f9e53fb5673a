"""The map file: named arrays in a zip archive, checked before use.

The archive holds one .npy member for each entry of ARRAYS, the format's name and version, and
a checksum over all of them. ``numpy.load`` also opens it, but this module reads each member
itself. It checks the sizes in the archive's directory before it unpacks anything, matches each
header against the one form that numpy writes, and takes numbers directly from the bytes.
Nothing in the file is evaluated, unpickled or unpacked onto the disk.
"""

from __future__ import annotations

import hashlib
import io
import math
import os
import re
import shutil
import struct
import uuid
import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from geounfold.backends.system import files
from geounfold.errors import InputError

FORMAT = "geounfold-map"
FORMAT_VERSION = 6
OLDEST = 2
"""Oldest version that can be read."""

_OLDEST_WRITTEN = 3  # version written if no array is of a later one

Arrays = dict[str, NDArray[Any]]

_FLOAT, _INDEX = "<f8", "<i4"


@dataclass(frozen=True)
class Layout:
    """Type, shape and conditions of an array of a map file.

    Attributes
    ----------
    dtype : str
        Type, including the byte order.
    shape : tuple of int or str
        Shape. A word is a length of 1 or more, equal in all arrays that name it. With a question
        mark at its end it may be 0.
    below : str, optional
        For indices from 0: the word for the length below which they must lie.
    finite : bool, optional
        Whether every number must be finite.
    holds : callable, optional
        Returns whether the array meets the condition of `must`.
    must : str, optional
        The condition in words, after "must".
    """

    dtype: str
    shape: tuple[int | str, ...]
    below: str | None = None
    finite: bool = True
    holds: Callable[[NDArray[Any]], bool] | None = None
    must: str = ""


def _is_rotation(matrix: NDArray[Any]) -> bool:
    # A rotation of doubles has an error of 1e-15; with 1e-9, points are carried to 1e-9 of the
    # size.
    with np.errstate(all="ignore"):
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
        return bool(off < 1e-9 and np.linalg.det(matrix) > 0)


def _is_steps(steps: NDArray[Any]) -> bool:
    return bool(np.isnan(steps).all() or (np.isfinite(steps) & (steps > 0)).all())


ARRAYS: Mapping[str, Layout] = {
    "origin": Layout(_FLOAT, (3,)),
    "rotation": Layout(_FLOAT, (3, 3), holds=_is_rotation, must="be a rotation"),
    "scale": Layout(_FLOAT, (), holds=lambda a: bool(a > 0), must="be positive"),
    "steps": Layout(
        _FLOAT, (3,), finite=False, holds=_is_steps, must="be positive, or all missing"
    ),
    "reach": Layout(_FLOAT, (), holds=lambda a: bool(a >= 0), must="not be negative"),
    "folded": Layout(_FLOAT, ("vertices", 3)),
    "unfolded": Layout(_FLOAT, ("vertices", 3)),
    "inner": Layout(_INDEX, (), holds=lambda a: bool(a > 0), must="be positive"),
    "tetrahedra": Layout(_INDEX, ("tetrahedra", 4), below="vertices"),
    "shell": Layout(_INDEX, ("shell?", 4), below="vertices"),
    "stratigraphic": Layout(_FLOAT, ("vertices",)),
    "coordinates": Layout(
        _INDEX, (), holds=lambda a: bool(0 <= a <= 2), must="be 0, 1 or 2 (tet, wachspress, mvc)"
    ),
    "vertex_part": Layout(_INDEX, ("parted?",), below="vertices"),
    "part_cells": Layout(_INDEX, ("cells?", 3)),
    "cell_part": Layout(_INDEX, ("cells?",), below="vertices"),
    "fault_points": Layout(_FLOAT, ("faulted?", 3)),
    "fault_block": Layout(_INDEX, ("faulted?",), below="vertices"),
    "fault_side": Layout(_FLOAT, (), holds=lambda a: bool(a >= 0), must="not be negative"),
    "fault_vertices": Layout(_FLOAT, ("corners?", 3)),
    "fault_triangles": Layout(_INDEX, ("triangles?", 3), below="corners?"),
    "fault_surface": Layout(_INDEX, ("triangles?",), below="triangles?"),
    "body_lowest": Layout(_INDEX, (3,)),
    "body_shape": Layout(_INDEX, (3,), holds=lambda a: bool((a >= 0).all()), must="be 0 or more"),
    "body_bits": Layout("|u1", ("bits?",)),
}
"""Every array of a map file. One that is added here must raise FORMAT_VERSION too."""

ADDED: Mapping[str, tuple[int, Any]] = {
    "coordinates": (3, 0),
    "vertex_part": (4, np.zeros(0)),
    "part_cells": (4, np.zeros((0, 3))),
    "cell_part": (4, np.zeros(0)),
    "fault_points": (5, np.zeros((0, 3))),
    "fault_block": (5, np.zeros(0)),
    "fault_side": (5, 0),
    "fault_vertices": (5, np.zeros((0, 3))),
    "fault_triangles": (5, np.zeros((0, 3))),
    "fault_surface": (5, np.zeros(0)),
    "body_lowest": (6, np.zeros(3)),
    "body_shape": (6, np.zeros(3)),
    "body_bits": (6, np.zeros(0)),
}
"""Arrays added later: the first version that has each, and its value in older files."""

_HEAD: Mapping[str, Layout] = {
    "format": Layout(f"<U{len(FORMAT)}", ()),
    "version": Layout("<i8", ()),
    "checksum": Layout("<U64", ()),
}
_NPY = re.compile(
    rb"\x93NUMPY\x01\x00(?s:..)"  # version 1.0, length of what follows
    rb"\{'descr': '([<|][A-Za-z]\d{1,4})', 'fortran_order': False, "
    rb"'shape': \(((?:\d{1,12}(?:, \d{1,12})*)?),?\), \} *\n"
)
_LONGEST_HEAD = 4096
_ROOM = 64 << 20  # largest unpacked size of any file, bytes
_RATIO = 100  # largest ratio of unpacked to packed size above that; 2 for a map of 4,000 blocks
_LARGEST = 4 << 30
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_DAMAGE = (
    *(OSError, ValueError, EOFError, KeyError, IndexError, OverflowError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, struct.error),
)


def write_arrays(path: str | Path | BinaryIO, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write the arrays of a map; the same arrays give the same bytes.

    A file appears at `path` whole or not at all. As with ``numpy.savez``, ``.npz`` is added to
    a name that lacks it.

    Parameters
    ----------
    path : path or binary stream
        Destination.
    arrays : dict of arrays
        The arrays of ARRAYS, of any type that converts without loss. Those of ADDED may be left
        out. The file is of the first version that has all arrays given.

    Raises
    ------
    InputError
        An array is missing, unknown, or not as described in ARRAYS.
    """
    exact = {
        name: np.ascontiguousarray(arrays[name], layout.dtype).reshape(np.shape(arrays[name]))
        for name, layout in ARRAYS.items()
        if name in arrays
    }
    version = max(_OLDEST_WRITTEN, *(first for n, (first, _) in ADDED.items() if n in arrays))
    late = {n for n, (first, _) in ADDED.items() if first > version}
    exact = _left_out({*ADDED} - late - {*arrays}) | exact
    _check_names({*arrays} | {*exact}, {*ARRAYS} - late, "the map")
    _check_arrays({**exact, **_left_out(late)}, "the map")
    whole = {"format": np.array(FORMAT), "version": np.array(version, "<i8"), **exact}
    stream = io.BytesIO()
    np.savez_compressed(stream, **whole, checksum=np.array(_checksum(whole)))  # type: ignore[arg-type]
    if isinstance(path, str | os.PathLike):
        name = os.fspath(path)
        write_whole(Path(name if name.endswith(".npz") else f"{name}.npz"), stream.getvalue())
    else:
        path.write(stream.getvalue())


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside its destination and move it there."""
    target = path.resolve()
    part = target.with_name(f".geounfold-{uuid.uuid4().hex}.part")
    try:
        with part.open("xb") as stream:
            stream.write(content)
        files.flush(part)
        if target.exists():
            shutil.copymode(target, part)
        files.replace(part, target)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def read_arrays(path: str | Path) -> Arrays:
    """Return the arrays of a map file, those of ARRAYS, after checking all of it.

    Raises
    ------
    InputError
        The file does not exist, cannot be read, is not a map, is of another version or damaged, or
        has arrays that do not fit.
    """
    path = Path(path)
    return arrays_of(_content(path), path)


def arrays_of(content: bytes, path: Path) -> Arrays:
    """Return the arrays of a map file's bytes, as `read_arrays`; ``path`` is for messages."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = _members(archive, len(content), path)
            head = {n: _array(archive, members, n, path) for n in ("format", "version")}
            _check_version(head, path)
            late = {n for n, (first, _) in ADDED.items() if int(head["version"]) < first}
            names = [n for n in ARRAYS if n not in late]
            _check_names({*members}, {f"{n}.npy" for n in (*_HEAD, *names)}, str(path))
            rest = {n: _array(archive, members, n, path) for n in ("checksum", *names)}
    except InputError:  # a ValueError too
        raise
    except _DAMAGE as error:
        told = "not a geounfold map, or a damaged one; save it again"
        raise InputError(f"{path}: {told if _named_so(path) else _NO_MAP}") from error
    stored = rest.pop("checksum")
    if str(stored) != _checksum({**head, **rest}):
        raise InputError(f"{path}: the map file is damaged (checksum differs); save it again")
    rest.update(_left_out(late))
    _check_arrays(rest, str(path))
    return rest


def _left_out(names: set[str]) -> Arrays:
    """Return what arrays are that a version does not have."""
    return {n: np.array(ADDED[n][1], ARRAYS[n].dtype) for n in names}


def _content(path: Path) -> bytes:
    """Return the bytes of a regular file of a plausible size."""
    path = files.reachable(path)
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a directory, not a map file")
        if not path.exists():
            raise InputError(f"{path}: no such map file; write one with geounfold unfold --map")
        if not path.is_file():
            raise InputError(f"{path}: is not a regular file (a pipe or device?)")
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            if size > _LARGEST:
                raise InputError(f"{path}: not a geounfold map: larger than any")
            return stream.read(size)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def _members(archive: zipfile.ZipFile, size: int, path: Path) -> dict[str, zipfile.ZipInfo]:
    """Return the members by name, read from the directory only."""
    members: dict[str, zipfile.ZipInfo] = {}
    for info in archive.infolist():
        if info.filename in members:
            raise InputError(f"{path}: not a geounfold map: two of '{_shown(info.filename)}'")
        if info.compress_type not in _METHODS or info.flag_bits & 1:
            raise InputError(
                f"{path}: not a geounfold map: '{_shown(info.filename)}' is encrypted, or packed "
                "in a way that no map is"
            )
        members[info.filename] = info
    total = sum(info.file_size for info in members.values())
    if total > min(_LARGEST, max(_ROOM, _RATIO * size)):
        raise InputError(
            f"{path}: not a geounfold map: {_size(size)} that would unpack to {_size(total)}"
        )
    return members


def _array(
    archive: zipfile.ZipFile, members: Mapping[str, zipfile.ZipInfo], name: str, path: Path
) -> NDArray[Any]:
    """Return one array, of the type in its layout and the shape in its header."""
    if f"{name}.npy" not in members:
        raise _foreign(path)
    dtype = np.dtype({**_HEAD, **ARRAYS}[name].dtype)
    content = archive.read(members[f"{name}.npy"])
    header = _NPY.match(content[:_LONGEST_HEAD])
    found = header and header.group(1).decode("ascii")
    if header is None or found != dtype.str:
        if name in ("format", "version"):
            raise _foreign(path)
        raise InputError(
            f"{path}: array '{name}' of the map must be {dtype.str}, "
            f"but is {found or 'something else'}; save it again"
        )
    shape = tuple(int(word) for word in header.group(2).decode("ascii").split(",") if word)
    body = content[header.end() :]
    if len(body) != math.prod(shape) * dtype.itemsize:
        raise InputError(f"{path}: the map file is damaged (array '{name}' is cut); save it again")
    return np.frombuffer(body, dtype).reshape(shape)


def _check_version(head: Arrays, path: Path) -> None:
    """Raise if the file is not a map, or of another version."""
    if any(a.shape != () for a in head.values()) or str(head["format"]) != FORMAT:
        raise _foreign(path)
    version = int(head["version"])
    if version > FORMAT_VERSION:
        raise InputError(
            f"{path}: map version {version} is newer than this geounfold reads "
            f"({FORMAT_VERSION}); upgrade geounfold"
        )
    if version < OLDEST:
        raise InputError(
            f"{path}: map version {version} is older than this geounfold reads "
            f"({OLDEST}); unfold again with --map"
        )


def _check_names(found: set[str], wanted: set[str], source: str) -> None:
    """Raise if arrays are missing or unknown."""
    for names, what in ((wanted - found, "lacks"), (found - wanted, "holds more than a map:")):
        if names:
            some = ", ".join(_shown(name) for name in sorted(names)[:3])
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            raise InputError(f"{source}: not a geounfold map: it {what} {some}{more}")


def _check_arrays(arrays: Arrays, source: str) -> None:
    """Raise if an array differs from its layout or does not fit the others."""
    lengths: dict[str, int] = {}
    for name, layout in ARRAYS.items():
        shape = arrays[name].shape
        fits = len(shape) == len(layout.shape) and all(
            n == (lengths.setdefault(want, n) if isinstance(want, str) else want)
            and (n > 0 or not isinstance(want, str) or want.endswith("?"))
            for n, want in zip(shape, layout.shape, strict=True)
        )
        if not fits:
            words = ", ".join(str(lengths.get(str(w), w)) for w in layout.shape)
            raise _wrong(source, name, f"have shape ({words}), but has {shape}")
    for name, layout in ARRAYS.items():
        values = arrays[name]
        if layout.finite and not np.isfinite(values).all():
            raise _wrong(source, name, "be finite")
        if (
            layout.below is not None
            and values.size
            and not (values.min() >= 0 and values.max() < lengths[layout.below])
        ):
            raise _wrong(
                source,
                name,
                f"lie within 0..{lengths[layout.below] - 1}, but reaches "
                f"{values.min()}..{values.max()}",
            )
        if layout.holds is not None and not layout.holds(values):
            raise _wrong(source, name, layout.must)


def _wrong(source: str, name: str, must: str) -> InputError:
    return InputError(f"{source}: array '{name}' of the map must {must}")


def _foreign(path: Path) -> InputError:
    told = "not a geounfold map; write one with geounfold unfold --map"
    return InputError(f"{path}: {told if _named_so(path) else _NO_MAP}")


_NO_MAP = "not a geounfold map, which ends in .npz: were two files swapped?"


def _named_so(path: Path) -> bool:
    return path.suffix.lower() == ".npz"


def _checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 over names, types and bytes of arrays, in the names' order."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(name.encode())
        digest.update(str(arrays[name].dtype).encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _shown(name: str) -> str:
    text = "".join(c if c.isprintable() else "?" for c in name)
    return text if len(text) <= 40 else text[:37] + "..."


def _size(count: int) -> str:
    return f"{count / 1e6:.3g} MB"
