"""Solids to fill with blocks: from files, meshes and pyvista surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from geounfold.body.fill import FilledSolid, fill_between, fill_solid
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import TriMesh, as_trimesh
from geounfold.io.paths import ending, existing_file
from geounfold.io.surfaces import holds_surface, points_alone, read_surface

SurfaceLike = Any
"""A TriMesh, (V, F), a file of a surface, or a pyvista.PolyData."""


def fill(
    solid: SurfaceLike | None = None,
    block_size: float | Sequence[float] | None = None,
    *,
    top: SurfaceLike | None = None,
    bottom: SurfaceLike | None = None,
    sub_blocks: int = 1,
    element: str | None = None,
) -> FilledSolid:
    """Fill a closed surface with blocks, or the body between two open ones.

    Parameters
    ----------
    solid : TriMesh, (V, F), path or pyvista.PolyData, optional
        A closed surface in any orientation. Corners that should be one are joined, small holes and
        loose triangles mended, parts that cross taken together; ``told`` of the result says so.
    block_size : float or three floats, optional
        Sides of a block, in the surface's unit. By default an eighth of the mean thickness.
    top, bottom : as solid, optional
        The surfaces above and below the body, in place of a closed one.
    sub_blocks : int
        2, 4 or 8 splits the sides of blocks that the surface cuts into as many parts; 1 none.
    element : str, optional
        Name of the surface in a file of several.

    Returns
    -------
    FilledSolid
        ``points`` and ``sizes`` of the blocks, ``table`` with both. A block belongs to the solid
        if the winding number of its centre is above 0.5 (Barill and others 2018, Fast winding
        numbers for soups and clouds). ``unfold`` takes the result in place of points, and the
        solid's surface becomes the horizons.

    Raises
    ------
    InputError
        The surface is open, or crosses itself beyond mending: the message names the place. No
        block lies inside.
    OptionError
        A size or split outside the valid values; neither a solid nor two surfaces, or both.

    Examples
    --------
    >>> V = [[x, y, z] for x in (0, 40) for y in (0, 40) for z in (0, 10)]
    >>> F = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    >>> F += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    >>> fill((V, F), 5)
    <FilledSolid of 128 blocks of 5 x 5 x 5: volume 16000 for 16000>
    """
    if (solid is None) == (top is None and bottom is None) or (top is None) != (bottom is None):
        raise OptionError("fill takes a closed surface, or top and bottom")
    if solid is not None:
        if isinstance(solid, str | Path) and points_alone(Path(solid)):
            raise InputError(
                f"{solid}: holds points without triangles, which enclose nothing: fill takes a "
                "closed mesh; blocks are unfolded as they are"
            )
        return fill_solid(surface_of(solid, element), block_size, sub_blocks)
    return fill_between(surface_of(top), surface_of(bottom), block_size, sub_blocks)


def surface_of(given: SurfaceLike, element: str | None = None) -> TriMesh:
    """Return a surface as a TriMesh: from a file, (V, F), or a pyvista.PolyData."""
    if isinstance(given, str | Path):
        return read_surface(given, element)
    return as_trimesh(given)


def is_wireframe(path: str | Path, element: str | None = None) -> bool:
    """Return whether a file that may hold points or a surface holds triangles.

    Raises
    ------
    InputError
        No such file; or the file holds surfaces and points, and no element is named.
    """
    if not holds_surface(path, element):
        return False
    path = existing_file(Path(path))
    return ending(path) != ".ts" or b"\nTRGL" in path.read_bytes()
