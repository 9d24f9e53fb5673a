"""Polylines as VTK files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.formats.registry import require
from geounfold.io.formats.vtk import add_text, save


def write_polylines(
    path: str | Path,
    points: Floats,
    first: Ints,
    point_data: Mapping[str, np.ndarray],
    line_data: Mapping[str, Sequence[str]],
) -> None:
    """Write polylines to a ``.vtp`` file, floats bit for bit.

    Parameters
    ----------
    path : path
        A file ending in .vtp.
    points : (n, 3) float
        Vertices, one line after the other.
    first : (k + 1,) int
        Line k has the vertices ``first[k]`` to ``first[k + 1] - 1``.
    point_data : dict of (n,) or (n, 3) arrays
        Values at the vertices.
    line_data : dict of k texts
        A text for each line.
    """
    pyvista = require("pyvista", "VTK")

    size = np.diff(first)
    cells = np.empty(len(points) + len(size), dtype=np.int64)
    heads = first[:-1] + np.arange(len(size))
    cells[heads] = size
    cells[np.delete(np.arange(len(cells)), heads)] = np.arange(len(points))
    mesh = pyvista.PolyData(np.asarray(points, dtype=np.float64), lines=cells)
    for name, values in point_data.items():
        mesh.point_data[name] = values
    for name, words in line_data.items():
        add_text(mesh.GetCellData(), name, words)
    save(mesh, Path(path))
