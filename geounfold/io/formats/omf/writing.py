"""OMF files, written by the installed library in its own version."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.errors import OutputError
from geounfold.io.formats.registry import Meta, Points, Surface, require


def write_points(path: Path, points: Points) -> None:
    """Write a project of one point set."""
    if not np.isfinite(points.xyz).all():
        raise OutputError("OMF files need finite coordinates")
    with _library() as omf:
        if _first(omf):
            data = [
                omf.StringData(name=name, location="vertices", array=[str(v) for v in values])
                if values.dtype == object
                else omf.ScalarData(name=name, location="vertices", array=values)
                for name, values in points.data.items()
            ]
            geometry = omf.PointSetGeometry(vertices=points.xyz)
            element = omf.PointSetElement(name="points", geometry=geometry, data=data)
        else:
            attributes = [
                omf.StringAttribute(name=name, location="vertices", array=[str(v) for v in values])
                if values.dtype == object
                else omf.NumericAttribute(name=name, location="vertices", array=values)
                for name, values in points.data.items()
            ]
            element = omf.PointSet(name="points", vertices=points.xyz, attributes=attributes)
        _write(path, omf, element, points.meta)


def write_surface(path: Path, surface: Surface) -> None:
    """Write a project of one surface."""
    with _library() as omf:
        if _first(omf):
            geometry = omf.SurfaceGeometry(vertices=surface.V, triangles=surface.F)
            element = omf.SurfaceElement(name="surface", geometry=geometry)
        else:
            element = omf.Surface(name="surface", vertices=surface.V, triangles=surface.F)
        _write(path, omf, element, surface.meta)


@contextmanager
def _library() -> Iterator[Any]:
    """Yield the library; its warnings about later versions of NumPy are suppressed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        yield require("omf", "OMF")


def _first(omf: Any) -> bool:
    """Return whether the library is one of version 1."""
    return hasattr(omf, "OMFWriter")


def _write(path: Path, omf: Any, element: Any, meta: Meta) -> None:
    if _first(omf):
        project = omf.Project(name=path.stem, description="", units=meta.get("unit", ""))
        project.elements = [element]
        project.validate()
        omf.OMFWriter(project, str(path))
        return
    # This version has an entry for the coordinate reference, and accepts any other entry.
    names = {"crs": "coordinate_reference_system", "unit": "units"}
    project = omf.Project(name=path.stem, description="", elements=[element])
    project.metadata = {name: meta[key] for key, name in names.items() if key in meta}
    omf.save(project, str(path), mode="w")
