"""OMF, the Open Mining Format, version 1, through its reference library (extra ``formats``).

A file holds a project of elements; one of them is read: a point set, else a volume (block model),
whose cells' centres become points. The project's unit is carried. Floats come back bit for bit.
Version 2 is another format (a zip archive); the library's stable release does not read it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.errors import InputError, OutputError
from geounfold.io._text import listing
from geounfold.io.formats.frames import flattened
from geounfold.io.formats.registry import Meta, Points, Surface, require
from geounfold.io.formats.units import unit_name
from geounfold.mesh import Floats


@contextmanager
def _library() -> Iterator[Any]:
    """Yield the library, and keep what it says of NumPy's later versions to itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        yield require("omf", "OMF")


def read_points(path: Path) -> Points:
    """Return the one point set of a file, or the one volume's cells where there is no point set.

    Raises
    ------
    InputError
        Not OMF 1, or not one such element.
    """
    with _library() as omf:
        project = _project(path, omf)
        for kind, xyz_of, location in (
            (omf.PointSetElement, _vertices, "vertices"),
            (omf.VolumeElement, _centres, "cells"),
        ):
            element = _one(path, project, kind)
            if element is not None:
                xyz = xyz_of(element.geometry) + _origin(project)
                return Points(xyz, _values(element, location, len(xyz)), _meta(project))
    raise InputError(f"{path}: holds neither a point set nor a volume")


def write_points(path: Path, points: Points) -> None:
    """Write a project of one point set."""
    if not np.isfinite(points.xyz).all():
        raise OutputError("OMF files need finite coordinates")
    with _library() as omf:
        data = [
            omf.StringData(name=name, location="vertices", array=[str(v) for v in values])
            if values.dtype == object
            else omf.ScalarData(name=name, location="vertices", array=values)
            for name, values in points.data.items()
        ]
        geometry = omf.PointSetGeometry(vertices=points.xyz)
        element = omf.PointSetElement(name="points", geometry=geometry, data=data)
        _write(path, omf, element, points.meta)


def read_surface(path: Path) -> Surface:
    """Return the one triangulated surface of a file."""
    with _library() as omf:
        project = _project(path, omf)
        element = _one(path, project, omf.SurfaceElement)
        if element is None or not isinstance(element.geometry, omf.SurfaceGeometry):
            raise InputError(f"{path}: holds no surface of triangles")
        V = _vertices(element.geometry) + _origin(project)
        F = np.asarray(element.geometry.triangles.array, dtype=np.int64)
        return Surface(V, F, _meta(project))


def write_surface(path: Path, surface: Surface) -> None:
    """Write a project of one surface."""
    with _library() as omf:
        geometry = omf.SurfaceGeometry(vertices=surface.V, triangles=surface.F)
        _write(path, omf, omf.SurfaceElement(name="surface", geometry=geometry), surface.meta)


def _project(path: Path, omf: Any) -> Any:
    with path.open("rb") as stream:
        head = stream.read(12)
    if head[:2] == b"PK":
        raise InputError(f"{path}: is an OMF file of version 2; export it as version 1")
    if head[:4] != b"\x84\x83\x82\x81":
        raise InputError(f"{path}: is not an OMF file")
    try:
        return omf.OMFReader(str(path)).get_project()
    except Exception as error:  # the library raises whatever its parts do
        words = " ".join(str(error).split())
        raise InputError(f"{path}: is not an OMF 1 file, or is damaged: {words}") from error


def _one(path: Path, project: Any, kind: Any) -> Any:
    """Return the only element of a kind, or None where there is none."""
    found = [element for element in project.elements if isinstance(element, kind)]
    if len(found) > 1:
        raise InputError(
            f"{path}: holds several elements of one kind ({listing(e.name for e in found)}); "
            "export the one that is meant"
        )
    return found[0] if found else None


def _origin(project: Any) -> Floats:
    return np.asarray(project.origin, dtype=np.float64).reshape(3)


def _vertices(geometry: Any) -> Floats:
    own = np.asarray(geometry.origin, dtype=np.float64).reshape(3)
    return np.asarray(np.asarray(geometry.vertices.array).reshape(-1, 3) + own, dtype=np.float64)


def _centres(geometry: Any) -> Floats:
    """Return the centres of a grid's cells, in the order of its data: w runs fastest."""
    sizes = [np.asarray(getattr(geometry, f"tensor_{a}"), dtype=np.float64) for a in "uvw"]
    middles = [np.cumsum(size) - 0.5 * size for size in sizes]
    along = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 3)
    axes = np.array([np.asarray(getattr(geometry, f"axis_{a}")).reshape(3) for a in "uvw"])
    return np.asarray(np.asarray(geometry.origin).reshape(3) + along @ axes, dtype=np.float64)


def _values(element: Any, location: str, rows: int) -> dict[str, np.ndarray]:
    """Return an element's data; mapped ones as their legend's words."""
    columns: dict[str, np.ndarray] = {}
    for data in element.data:
        if data.location != location:
            continue
        array = np.asarray(getattr(data.array, "array", data.array))
        if getattr(data, "legends", None):
            words = np.array([str(v) for v in data.legends[0].values], dtype=object)
            index = np.asarray(data.indices.array, dtype=np.int64)
            array = np.where(index >= 0, words[index], "")
        columns |= flattened(data.name or f"data_{len(columns)}", array, rows)
    return columns


def _meta(project: Any) -> Meta:
    return {"unit": unit_name(project.units)} if project.units else {}


def _write(path: Path, omf: Any, element: Any, meta: Meta) -> None:
    project = omf.Project(name=path.stem, description="", units=meta.get("unit", ""))
    project.elements = [element]
    project.validate()
    omf.OMFWriter(project, str(path))
