"""The formats by ending, their contents, and the points and surfaces that their modules use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType

import numpy as np

from geounfold.errors import MissingDependencyError
from geounfold.extras import check
from geounfold.extras import require as require_library
from geounfold.geometry.mesh import Floats, Ints

Meta = Mapping[str, str]
"""A file's ``unit`` and ``crs`` (coordinate reference), as far as they are known."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points with values beside them.

    Attributes
    ----------
    xyz : (n, 3) float
        Coordinates, z up.
    data : dict of (n,) arrays
        Values by name: float64 (missing: NaN), int64, or text as objects (missing: empty).
    meta : dict of str
        Unit and coordinate reference, if known.
    element : str
        Name of the element that was read, if the file may hold several.
    """

    xyz: Floats
    data: Mapping[str, np.ndarray]
    meta: Meta = field(default_factory=dict)
    element: str = ""


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangulated surface.

    Attributes
    ----------
    V : (n, 3) float
        Vertices, z up.
    F : (m, 3) int
        Triangles.
    meta : dict of str
        Unit and coordinate reference, if known.
    """

    V: Floats
    F: Ints
    meta: Meta = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Strings:
    """Polylines: outlines, strings of a survey, traces.

    Attributes
    ----------
    xyz : (n, 3) float
        Vertices, one string after the other, z up.
    first : (k + 1,) int
        String k has the vertices ``first[k]`` to ``first[k + 1] - 1``.
    names : tuple of k str
        Number or layer of each string.
    meta : dict of str
        Unit and coordinate reference, if known.
    """

    xyz: Floats
    first: Ints
    names: tuple[str, ...]
    meta: Meta = field(default_factory=dict)

    def columns(self) -> dict[str, np.ndarray]:
        """Return a row for every vertex: string (its number from 1), name, x, y, z."""
        count = np.diff(self.first)
        number = np.repeat(np.arange(1, len(count) + 1), count)
        name = np.repeat(np.array(self.names, dtype=object), count)
        return {"string": number, "name": name, **dict(zip("xyz", self.xyz.T, strict=True))}


@dataclass(frozen=True)
class Format:
    """One family of files.

    Attributes
    ----------
    name : str
        Name used in messages.
    module : str
        Module of this package.
    reads_points, writes_points, reads_surface, writes_surface : tuple of str
        Endings of files with which the module can do this.
    strings : tuple of str
        Endings of files of polylines that it reads and writes.
    numbers_only : bool
        Whether text columns are written as codes (see `coded`).
    library : str
        Optional library that the module needs, at least for writing; empty for none.
    elements : bool
        Whether a file may hold several elements, of which one is read by its name.
    """

    name: str
    module: str
    reads_points: tuple[str, ...] = ()
    writes_points: tuple[str, ...] = ()
    reads_surface: tuple[str, ...] = ()
    writes_surface: tuple[str, ...] = ()
    strings: tuple[str, ...] = ()
    numbers_only: bool = False
    library: str = ""
    elements: bool = False

    def check_library(self) -> None:
        """Raise MissingDependencyError if the format's library is not installed."""
        if self.library:
            require(self.library, self.name)

    def load(self) -> ModuleType:
        """Return the module."""
        return import_module(f"geounfold.io.formats.{self.module}")


_GSLIB = (".gslib", ".geoeas", ".dat", ".gs")
_VTK = (".vtu", ".vtp", ".vti", ".vtk", ".vtr", ".vts")
_MESHES = (".ply", ".obj", ".stl", ".off")

FORMATS = (
    Format("GSLIB (GeoEAS)", "gslib", _GSLIB, _GSLIB, numbers_only=True),
    Format(
        "VTK",
        "vtk",
        _VTK,
        (".vtu", ".vtp"),
        (".vtp", ".vtk"),
        (".vtp",),
        library="pyvista",
    ),
    Format("GOCAD", "gocad", (".vs", ".ts"), (".vs",), (".ts",), (".ts",), numbers_only=True),
    Format("OMF", "omf", (".omf",), (".omf",), (".omf",), (".omf",), library="omf", elements=True),
    Format(
        "geoh5",
        "geoh5",
        (".geoh5",),
        (".geoh5",),
        (".geoh5",),
        (".geoh5",),
        library="geoh5py",
        elements=True,
    ),
    Format("DXF", "dxf", (".dxf",), (), (".dxf",), (".dxf",), strings=(".dxf",), library="ezdxf"),
    Format("Surpac strings", "surpac", (".str",), strings=(".str",)),
    Format("mesh", "meshes", (), (), _MESHES, _MESHES),
)
"""All formats except tables."""


def find_format(kind: str, what: str) -> Format | None:
    """Return the format that can do ``what`` (``reads_points``, ...) with an ending, or None.

    Examples
    --------
    >>> find_format(".ts", "reads_surface").name
    'GOCAD'
    >>> find_format(".ts", "writes_points") is None
    True
    """
    return next((f for f in FORMATS if kind in getattr(f, what)), None)


def check_library_of(kind: str) -> None:
    """Raise MissingDependencyError if files of an ending need a library that is not installed."""
    if kind == ".parquet":
        check("pyarrow", "Parquet files")
    for found in FORMATS:
        if found.library and kind in (*found.writes_points, *found.writes_surface):
            check(found.library, f"{found.name} files")


def point_endings(*, writing: bool = False) -> tuple[str, ...]:
    """Return the endings of files of points that can be read, or written."""
    return sum((f.writes_points if writing else f.reads_points for f in FORMATS), ())


def surface_endings(*, writing: bool = False) -> tuple[str, ...]:
    """Return the endings of files of surfaces that can be read, or written."""
    return sum((f.writes_surface if writing else f.reads_surface for f in FORMATS), ())


def string_endings() -> tuple[str, ...]:
    """Return the endings of files of polylines."""
    return sum((f.strings for f in FORMATS), ())


def require(name: str, what: str) -> ModuleType:
    """Return an optional library; raise MissingDependencyError with its extra's name without it."""
    try:
        return require_library(name, f"{what} files")
    except MissingDependencyError as error:
        if name.partition(".")[0] != "geoh5py":
            raise
        raise MissingDependencyError(f"{error} (from Python 3.12 on)") from error
