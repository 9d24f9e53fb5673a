"""DXF wireframes through ezdxf (extra ``formats``): 3DFACE entities, polyface and other meshes.

Corners at the same coordinates become one vertex, because 3DFACE has no vertex numbers. The
drawing's unit is kept. Coordinates are read back bit for bit.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.errors import InputError, OutputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.formats.registry import Meta, Surface, require
from geounfold.io.formats.units import unit_name
from geounfold.io.messages import listing

_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 21: "us-ft"}


def read_surface(path: Path) -> Surface:
    """Return the triangles of a drawing's model space; quadrangles are cut in two.

    Raises
    ------
    InputError
        The file is no DXF file, or holds no faces.
    """
    ezdxf = require("ezdxf", "DXF")
    render = require("ezdxf.render", "DXF")
    try:
        drawing = ezdxf.readfile(path)
    except (ezdxf.DXFError, OSError, ValueError) as error:
        words = " ".join(str(error).split())
        raise InputError(f"{path}: is not a DXF file, or is damaged: {words}") from error
    corners: list[tuple[Any, Any, Any]] = []
    others: set[str] = set()
    for entity in drawing.modelspace():
        kind = entity.dxftype()
        if kind == "3DFACE":
            faces = [entity.wcs_vertices()]
        elif kind == "MESH":
            faces = list(render.MeshBuilder.from_mesh(entity).faces_as_vertices())
        elif kind == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh):
            faces = list(render.MeshBuilder.from_polyface(entity).faces_as_vertices())
        else:
            others.add(kind)
            continue
        for face in faces:
            points = list(face)
            corners += [(points[0], b, c) for b, c in pairwise(points[1:])]
    if not corners:
        rest = f"; it holds {listing(sorted(others))}" if others else ""
        raise InputError(f"{path}: holds no faces (3DFACE, MESH or polyface){rest}")
    flat = np.array([[tuple(p) for p in face] for face in corners], dtype=np.float64)
    V, F = _welded(flat.reshape(-1, 3))
    unit = _UNITS.get(int(drawing.units))
    whole = (F != np.roll(F, 1, axis=1)).all(axis=1)
    return Surface(V, F[whole], {} if unit is None else {"unit": unit})


def write_surface(path: Path, surface: Surface) -> None:
    """Write one 3DFACE for each triangle.

    Raises
    ------
    OutputError
        A coordinate is not finite.
    """
    if not np.isfinite(surface.V).all():
        raise OutputError("DXF files need finite coordinates")
    ezdxf = require("ezdxf", "DXF")
    drawing = ezdxf.new("R2010")
    drawing.units = _code(surface.meta)
    space = drawing.modelspace()
    for face in surface.V[surface.F].tolist():
        space.add_3dface(face)
    drawing.saveas(path)


def _code(meta: Meta) -> int:
    """Return the drawing's code of a unit; 0 for none."""
    unit = unit_name(meta.get("unit", ""))
    return next((code for code, name in _UNITS.items() if name == unit), 0)


def _welded(corners: Floats) -> tuple[Floats, Ints]:
    """Return vertices in the order of their first corner, and triangles of three corners each."""
    _, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return corners[first[order]], rank[inverse.ravel()].reshape(-1, 3)
