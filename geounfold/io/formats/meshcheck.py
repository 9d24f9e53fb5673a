"""Checks of mesh files before MeshLab reads them.

On some files that end too early, MeshLab's readers crash or never return. They allocate memory for
as many vertices as a header counts, read words as zeros and leave out faces whose vertices do not
exist. Such files are refused here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from geounfold.errors import InputError
from geounfold.io.messages import shown

_PLY_END = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)
_PLY_ELEMENT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\d{1,18})[ \t]*\r?$", re.MULTILINE)
_STL_HEAD, _STL_FACET = 84, 50  # bytes of a binary file's head and of each of its triangles


def checked_vertices(path: Path) -> int | None:
    """Return the number of vertices in a mesh file; None if the format does not count them.

    Raises
    ------
    InputError
        The file is cut, counts more than it holds, or has a coordinate that is no finite number or
        a vertex number that does not exist.
    """
    content = path.read_bytes()
    check = {".ply": _ply, ".off": _off, ".stl": _stl, ".obj": _obj}[path.suffix.lower()]
    try:
        return check(content)
    except ValueError as error:
        raise InputError(f"{path}: is not a surface: {error}") from error


def _ply(content: bytes) -> int:
    end = _PLY_END.search(content)
    if not content.startswith(b"ply") or end is None:
        raise ValueError("the header of the PLY file is cut or missing")
    counts = {name: int(n) for name, n in _PLY_ELEMENT.findall(content[: end.start()])}
    # Every vertex and face takes a byte or more.
    if sum(counts.values()) > len(content) - end.end():
        raise ValueError(f"the file is cut: its header counts {sum(counts.values())} elements")
    return counts.get(b"vertex", 0)


def _off(content: bytes) -> int:
    rows = [words for line in content.splitlines() if (words := line.partition(b"#")[0].split())]
    if not rows or not rows[0][0].upper().endswith(b"OFF"):
        raise ValueError("the header of the OFF file is cut, or none")
    start = 2 if len(rows[0]) == 1 else 1
    counts = [*rows[0][1:], *(rows[1] if start == 2 and len(rows) > 1 else [])][:2]
    if len(counts) < 2 or not all(count.isdigit() for count in counts):
        raise ValueError("the header of the OFF file is cut, or none")
    vertices, faces = map(int, counts)
    if len(rows) - start < vertices + faces:
        raise ValueError(
            f"the file is cut: its header counts {vertices + faces} vertices and faces"
        )
    _check_numbers(row[:3] for row in rows[start : start + vertices])
    for row in rows[start + vertices : start + vertices + faces]:
        corners = [int(word) for word in row[1 : 1 + int(row[0])]]
        if len(corners) < int(row[0]) or not all(0 <= k < vertices for k in corners):
            raise ValueError(
                f"a face has vertices {shown(corners)}, but vertices are numbered 0 to "
                f"{vertices - 1}"
            )
    return vertices


def _stl(content: bytes) -> None:
    if content[:5].lower() == b"solid" and b"facet" in content[:1024]:
        rows = (line.split() for line in content.splitlines())
        _check_numbers(row[1:] for row in rows if row[:1] == [b"vertex"])
        return
    if len(content) < _STL_HEAD:
        raise ValueError("the STL file is cut")
    count = int.from_bytes(content[80:_STL_HEAD], "little")
    if len(content) - _STL_HEAD < count * _STL_FACET:
        raise ValueError(f"the STL file is cut: its header counts {count} triangles")
    body = np.frombuffer(content, np.uint8, count * _STL_FACET, _STL_HEAD)
    corners = body.reshape(count, _STL_FACET)[:, 12:48].copy().view("<f4")
    if not np.isfinite(corners).all():
        raise ValueError("it has coordinates that are not finite numbers")


def _obj(content: bytes) -> None:
    rows = [
        line.split() for line in content.splitlines() if line[:2] in (b"v ", b"v\t", b"f ", b"f\t")
    ]
    vertices = [row[1:4] for row in rows if row[0] == b"v"]
    _check_numbers(vertices)
    for row in rows:
        if row[0] != b"f":
            continue
        for word in row[1:]:
            number = int(word.partition(b"/")[0])
            if number == 0 or number > len(vertices) or number < -len(vertices):
                raise ValueError(
                    f"a face has vertex {number}, but vertices are numbered 1 to {len(vertices)}"
                )


def _check_numbers(vertices: Iterable[list[bytes]]) -> None:
    """Raise ValueError if a vertex is not three finite numbers."""
    for number, words in enumerate(vertices):
        try:
            good = len(words) >= 3 and bool(np.isfinite([float(w) for w in words]).all())
        except ValueError:
            good = False
        if not good:
            text = b" ".join(words).decode("utf-8", "replace")
            raise ValueError(f"vertex {number + 1} is '{shown(text)}', not three finite numbers")
