"""DXF drawings through ezdxf (extra ``formats``): wireframes, and lines as strings.

Wireframes are 3DFACE entities, polyface and other meshes; strings are lines and polylines. Entities
in inserted blocks count as if they stood in the drawing. Corners at the same coordinates become one
vertex, because 3DFACE has no vertex numbers. The drawing's unit is kept. Coordinates are read back
bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OutputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.formats.registry import Meta, Strings, Surface, require
from geounfold.io.formats.units import unit_name
from geounfold.io.messages import listing

_DEEPEST = 8  # blocks within blocks that are followed
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 21: "us-ft"}


def read_surface(path: Path) -> Surface:
    """Return the triangles of a drawing's model space; quadrangles are cut in two.

    Raises
    ------
    InputError
        The file is no DXF file, or holds no faces.
    """
    drawing = _drawing(path)
    render = require("ezdxf.render", "DXF")
    corners: list[tuple[Any, Any, Any]] = []
    others: set[str] = set()
    for entity in _entities(drawing.modelspace()):
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
    whole = (F != np.roll(F, 1, axis=1)).all(axis=1)
    return Surface(V, F[whole], _meta(drawing))


def read_strings(path: Path) -> Strings:
    """Return the lines and polylines of a drawing's model space; a closed one ends where it began.

    The straight lines between vertices count; arcs between them are not followed. A string's name
    is its layer.

    Raises
    ------
    InputError
        The file is no DXF file, or holds no lines.
    """
    drawing = _drawing(path)
    lines: list[list[tuple[float, ...]]] = []
    names: list[str] = []
    others: set[str] = set()
    for entity in _entities(drawing.modelspace()):
        points = _vertices(entity)
        if points is None or len(points) < 2:
            others.add(entity.dxftype())
            continue
        lines.append(points)
        names.append(str(entity.dxf.layer))
    if not lines:
        rest = f"; it holds {listing(sorted(others))}" if others else ""
        raise InputError(f"{path}: holds no lines (LINE, LWPOLYLINE or POLYLINE){rest}")
    first = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    xyz = np.array([point for line in lines for point in line], dtype=np.float64)
    return Strings(xyz, first.astype(np.int64), tuple(names), _meta(drawing))


def read_frame(path: Path) -> pd.DataFrame:
    """Return the vertices of a drawing's lines as rows: string, name, x, y, z."""
    return pd.DataFrame(read_strings(path).columns())


def write_strings(path: Path, strings: Strings) -> None:
    """Write one 3D polyline for each string, in a layer of its name."""
    if not np.isfinite(strings.xyz).all():
        raise OutputError("DXF files need finite coordinates")
    ezdxf = require("ezdxf", "DXF")
    drawing = ezdxf.new("R2010")
    drawing.units = _code(strings.meta)
    space = drawing.modelspace()
    for name, points in zip(strings.names, np.split(strings.xyz, strings.first[1:-1]), strict=True):
        layer = "".join("_" if c in '<>/\\":;?*|=`' else c for c in name) or "0"
        space.add_polyline3d(points.tolist(), dxfattribs={"layer": layer})
    drawing.saveas(path)


def _drawing(path: Path) -> Any:
    ezdxf = require("ezdxf", "DXF")
    try:
        return ezdxf.readfile(path)
    except (ezdxf.DXFError, OSError, ValueError) as error:
        words = " ".join(str(error).split())
        raise InputError(f"{path}: is not a DXF file, or is damaged: {words}") from error


def _meta(drawing: Any) -> Meta:
    unit = _UNITS.get(int(drawing.units))
    return {} if unit is None else {"unit": unit}


def _entities(space: Iterable[Any], depth: int = 0) -> Iterator[Any]:
    """Yield entities; those of inserted blocks in their place."""
    for entity in space:
        if entity.dxftype() == "INSERT" and depth < _DEEPEST:
            for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _entities(copy.virtual_entities(), depth + 1)
        else:
            yield entity


def _vertices(entity: Any) -> list[tuple[float, ...]] | None:
    """Return the vertices of a line or polyline; None of any other entity."""
    kind = entity.dxftype()
    if kind == "LINE":
        return [tuple(entity.dxf.start), tuple(entity.dxf.end)]
    if kind == "LWPOLYLINE":
        points = [tuple(p) for p in entity.vertices_in_wcs()]
        closed = bool(entity.closed)
    elif kind == "POLYLINE" and (entity.is_3d_polyline or entity.is_2d_polyline):
        points = [tuple(p) for p in entity.points_in_wcs()]
        closed = bool(entity.is_closed)
    else:
        return None
    return [*points, points[0]] if closed and points else points


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
