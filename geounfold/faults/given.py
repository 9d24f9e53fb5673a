"""What the user gives on faults: surfaces, fault blocks, slip directions, the outline's meaning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.body.fault_surface import FaultSurface
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, MeshError, OptionError
from geounfold.geometry.mesh import Bools, Floats, TriMesh, as_trimesh
from geounfold.io.surfaces import read_surface

OUTLINES = ("ore", "model")
"""Whether rims are the ore's own, and mark the slip along faults, or limits of the model."""

MOST = 50
"""Most fault blocks of a body."""

Surfaces = Mapping[str, Any] | Sequence[Any]
"""Surfaces by name, or a sequence of files, meshes or (name, V, F)."""


@dataclass(frozen=True, eq=False)
class FaultsGiven:
    """Faults as the user gives them.

    Attributes
    ----------
    surfaces : dict of TriMesh
        By the fault's name, in the data's coordinates.
    blocks : (n,) object or None
        Fault block of every point; None if surfaces cut the body.
    directions : dict of (3,) float
        Direction of slip by the fault's name, in the data's coordinates.
    outline : str
        A name in OUTLINES.
    """

    surfaces: dict[str, TriMesh]
    blocks: np.ndarray | None = None
    directions: dict[str, Floats] = field(default_factory=dict)
    outline: str = "ore"

    @classmethod
    def of(
        cls,
        faults: Surfaces | None,
        blocks: Any | None,
        slip_direction: Mapping[str, Any] | None,
        outline: str,
        count: int,
    ) -> FaultsGiven | None:
        """Return the faults given; None if there are none.

        Parameters
        ----------
        faults : mapping or sequence, optional
            Surfaces as (V, F), TriMesh or file, by name or in a sequence.
        blocks : (n,) array, optional
            Fault block of every point, numbers or texts.
        slip_direction : mapping, optional
            By the fault's name (TREND, PLUNGE) in degrees.
        outline : str
            A name in OUTLINES.
        count : int
            Number of points.

        Raises
        ------
        OptionError
            Options without faults, of faults that were not given, or outside their valid values.
        InputError
            Fault blocks that do not fit the points; a file that is no surface.
        """
        if outline not in OUTLINES:
            raise OptionError(f"outline must be {' or '.join(OUTLINES)}, but is {outline!r}")
        if faults is None and blocks is None:
            if slip_direction:
                raise OptionError("slip_direction is of faults: give faults or fault_blocks too")
            return None
        surfaces = {} if faults is None else named_surfaces(faults)
        if faults is not None and not surfaces:
            raise OptionError("faults is empty: give at least one surface")
        directions = {str(k): slip_vector(str(k), v) for k, v in (slip_direction or {}).items()}
        unknown = sorted(set(directions) - set(surfaces)) if surfaces else []
        if unknown:
            raise OptionError(
                f"slip_direction: there is no fault {unknown[0]!r}; given: {', '.join(surfaces)}"
            )
        return cls(surfaces, _checked_blocks(blocks, count), directions, outline)

    def in_work(self, frame: Frame) -> tuple[FaultSurface, ...]:
        """Return the surfaces in working units, hanging walls up."""
        up = frame.up_in_work()
        return tuple(
            FaultSurface.facing(name, frame.to_work(mesh.V), mesh.F, up)
            for name, mesh in self.surfaces.items()
        )

    def direction(self, name: str, frame: Frame) -> Floats | None:
        """Return the slip direction of a fault in the working frame; None if it is not given."""
        given = self.directions.get(name)
        return None if given is None else frame.rotation @ given


def block_column(blocks: Any | None, table: pd.DataFrame | None, rows: Bools | None) -> Any | None:
    """Return the fault blocks of the chosen rows of a table.

    Parameters
    ----------
    blocks : (n,) array, str or None
        Fault block of every row, or the name of the column with them.
    table : DataFrame or None
        The table, if the points came in one.
    rows : (n,) bool or None
        Rows that are chosen; None for all.

    Raises
    ------
    InputError
        There is no such column, or no table.
    """
    if isinstance(blocks, str):
        if table is None or blocks not in table.columns:
            known = "" if table is None else f"; there are {', '.join(map(str, table.columns))}"
            raise InputError(f"fault_blocks: there is no column {blocks!r}{known}")
        blocks = table[blocks]
    if blocks is None or rows is None:
        return blocks
    given = np.asarray(blocks)
    return given[np.asarray(rows)] if len(given) == len(rows) else given


def named_surfaces(faults: Surfaces) -> dict[str, TriMesh]:
    """Return surfaces by name; files take their stem, meshes without a name f1, f2, ...

    Raises
    ------
    InputError
        A file that cannot be read, or a mesh that is no surface.
    OptionError
        Two faults of one name.
    """
    given: list[tuple[str | None, Any]]
    if isinstance(faults, Mapping):
        given = [(str(name), mesh) for name, mesh in faults.items()]
    elif isinstance(faults, str | Path | TriMesh):
        given = [(None, faults)]
    else:
        given = [(None, mesh) for mesh in faults]
    out: dict[str, TriMesh] = {}
    for number, (name, mesh) in enumerate(given, 1):
        if isinstance(mesh, tuple) and len(mesh) == 3:
            name, mesh = str(mesh[0]), (mesh[1], mesh[2])
        if isinstance(mesh, str | Path):
            name = name or Path(mesh).name.split(".")[0]
        own = name or f"f{number}"
        if own in out:
            raise OptionError(f"two faults are called {own!r}: give each surface a name of its own")
        out[own] = _mesh(own, mesh)
    return out


def _mesh(name: str, mesh: Any) -> TriMesh:
    if isinstance(mesh, str | Path):
        return _sound(name, read_surface(mesh))
    try:
        return _sound(name, as_trimesh(mesh))
    except (MeshError, TypeError, ValueError) as error:
        raise InputError(f"fault {name}: is not a surface: {error}") from error


def _sound(name: str, mesh: TriMesh) -> TriMesh:
    """Return a surface without repeated vertices and triangles of no area."""
    if mesh.V.shape[1] != 3:
        raise InputError(f"fault {name}: vertices must have x, y and z")
    used, row = np.unique(mesh.V, axis=0, return_inverse=True)
    F = row.ravel()[mesh.F]
    area = np.linalg.norm(
        np.cross(used[F[:, 1]] - used[F[:, 0]], used[F[:, 2]] - used[F[:, 0]]), axis=1
    )
    F = F[area > 0]
    if not len(F):
        raise InputError(f"fault {name}: the surface has no triangle of any area")
    return TriMesh(used, F).submesh(np.ones(len(F), bool))[0]


def slip_vector(name: str, given: Any) -> Floats:
    """Return the direction (3,) of (TREND, PLUNGE) in degrees, x east, y north, z up.

    Raises
    ------
    OptionError
        The value is no pair of finite numbers, or the plunge is not within -90 to 90.
    """
    try:
        trend, plunge = (float(x) for x in given)
    except (TypeError, ValueError):
        raise OptionError(
            f"slip_direction of {name} must be TREND/PLUNGE in degrees, but is {given}"
        ) from None
    if not (np.isfinite([trend, plunge]).all() and -90 <= plunge <= 90):
        raise OptionError(
            f"slip_direction of {name}: the plunge must be -90 to 90 degrees, but is {given}"
        )
    a, p = np.radians([trend, plunge])
    return np.array([np.sin(a) * np.cos(p), np.cos(a) * np.cos(p), -np.sin(p)])


def _checked_blocks(blocks: Any | None, count: int) -> np.ndarray | None:
    """Return the fault block of every point as numbers from 0, in the order of their names."""
    if blocks is None:
        return None
    given = np.asarray(blocks)
    if given.shape != (count,):
        raise InputError(
            f"fault_blocks must have one value per point, ({count},), but has {given.shape}"
        )
    text = np.array([str(value).strip() for value in given.tolist()])
    missing = np.isin(text, ("", "nan", "None", "<NA>"))
    if missing.any():
        raise InputError(
            f"fault_blocks: {int(missing.sum())} points have no fault block, the first is row "
            f"{int(missing.argmax()) + 1}; give every point one"
        )
    names, number = np.unique(text, return_inverse=True)
    if len(names) > MOST:
        raise InputError(
            f"fault_blocks has {len(names)} different values; a body has at most {MOST} fault "
            "blocks: is it the right column?"
        )
    return number.astype(np.int64)
