"""A closed surface around a solid: checked, mended if little is wrong, else refused with the place.

Wireframes come with corners that should be one, pin holes, parts that cross, triangles that face
the wrong way, and loose triangles. Each is mended if the solid does not change by it, and every
change is told. A surface that is open is refused, because nothing says what it encloses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.igl import face_components, self_intersections
from geounfold.backends.igl_solids import FastWinding, coherent, union_of_parts
from geounfold.body.check import MIN_POINTS
from geounfold.body.fill.edges import (
    Holes,
    border_edges,
    fanned,
    holes_of,
    joined_corners,
    manifold_edges,
    single_fans,
    without_slivers,
)
from geounfold.body.lattice import Lattice, measure_lattice
from geounfold.errors import BackendError, InputError
from geounfold.geometry.measures import enclosed_volume, face_normals, triangle_areas
from geounfold.geometry.mesh import Floats, Ints, TriMesh

SMALL_HOLES = 0.01
"""Share of a surface's area up to which its holes are closed.

A box without lid lacks 0.17, a horizon alone 1, one triangle of a mesh of 1,000 triangles 0.001.
"""

JOINED = (1e-6, 1e-5, 1e-4)
"""Distances that are tried for corners to be joined, in the diagonal of the surface's box.

Single precision moves corners by 6e-8 of their coordinates, which may be 1,000 times the diagonal.
"""

STAIRS = 0.98
"""Share of the area along a lattice of corners from which triangles are the faces of blocks.

The skin of a block model has 1; smoothed, 0.3.
"""

_SAMPLE = 200  # blocks of a body that are looked for in a part
_MOST = 0.5  # share of a body's blocks that its part holds
_ALONG = 0.9999  # cosine between a normal and an axis of the lattice
_THIN = 0.01  # share of the mean thickness that no corner may be moved by
_NOTHING = 1e-6  # share of the largest part's volume below which a part encloses nothing


@dataclass(frozen=True, eq=False)
class Shell:
    """A closed surface that faces outward, and what was mended of it.

    Attributes
    ----------
    mesh : TriMesh
        The surface, in the data's coordinates.
    blocks : Lattice or None
        The lattice of blocks whose faces the triangles are; None for any other surface.
    told : tuple of str
        One sentence for each kind of change.
    """

    mesh: TriMesh
    blocks: Lattice | None
    told: tuple[str, ...]

    def around(self, points: Floats) -> TriMesh | None:
        """Return the parts of the surface around a body, without voids; None if they are no hull.

        Parameters
        ----------
        points : (n, 3) float
            The body's blocks, in the data's coordinates.

        Returns
        -------
        TriMesh or None
            None for the faces of blocks, which are stairs, for a surface with an edge of four
            triangles, and if the blocks lie in several parts.
        """
        if self.blocks is not None or not manifold_edges(self.mesh.F):
            return None
        V, F = single_fans(self.mesh.V, self.mesh.F)
        part = face_components(F)
        some = points[:: 1 + len(points) // _SAMPLE]
        outer = np.flatnonzero(_volumes(V, F, part, int(part.max()) + 1) > 0)
        held = [k for k in outer if (FastWinding(V, F[part == k])(some) > 0.5).mean() > _MOST]
        return TriMesh(V, F).submesh(part == held[0])[0] if len(held) == 1 else None

    @property
    def volume(self) -> float:
        """The volume that it encloses."""
        return enclosed_volume(self.mesh.V, self.mesh.F)

    @property
    def area(self) -> float:
        """Its area."""
        return float(triangle_areas(self.mesh.V, self.mesh.F).sum())

    @property
    def thickness(self) -> float:
        """Mean thickness of a sheet of this volume and area: 2 volume / area."""
        return 2 * self.volume / self.area


def closed_shell(mesh: TriMesh) -> Shell:
    """Return a surface as the border of a solid.

    Parameters
    ----------
    mesh : TriMesh
        The surface, in any orientation.

    Raises
    ------
    InputError
        The surface is open, one-sided, encloses nothing, or crosses itself beyond mending; the
        message names the place.
    """
    told: list[str] = []
    V, F = _distinct(mesh)
    V, F = _joined(V, F, told)
    F = coherent(F) if len(border_edges(F)) else F
    V, F = _closed(V, F, told)
    F = _outward(V, F, told)
    V, F = _uncrossed(V, F, told)
    made, _ = TriMesh(V, F).submesh(np.arange(len(F)))
    return Shell(made, _blocks(made), tuple(told))


def _blocks(mesh: TriMesh) -> Lattice | None:
    """Return the lattice of the blocks whose faces the triangles of a mesh are; None if of none."""
    lattice = measure_lattice(mesh.V)
    if lattice is None:
        return None
    if enclosed_volume(mesh.V, mesh.F) < MIN_POINTS * lattice.steps.prod():
        return None
    along = np.abs(face_normals(mesh.V, mesh.F) @ lattice.axes.T).max(axis=1) > _ALONG
    area = triangle_areas(mesh.V, mesh.F)
    return lattice if area[along].sum() > STAIRS * area.sum() else None


def at(place: Floats) -> str:
    """Return a place in words of one format."""
    return f"({', '.join(f'{c:.10g}' for c in place)})"


def _distinct(mesh: TriMesh) -> tuple[Floats, Ints]:
    """Return the surface with equal corners as one vertex and without slivers."""
    V, back = np.unique(mesh.V, axis=0, return_inverse=True)
    F = without_slivers(back.ravel()[mesh.F])
    if len(F) < 4:
        raise InputError(f"the surface has {len(F)} triangles, too few to enclose anything")
    return V, F


def _joined(V: Floats, F: Ints, told: list[str]) -> tuple[Floats, Ints]:
    """Return the surface with corners joined, by the least distance that closes it most."""
    left = len(border_edges(coherent(F)))
    if not left:
        return V, F
    diagonal = float(np.linalg.norm(np.ptp(V, axis=0)))
    best = (left, V, F)
    for share in JOINED:
        tolerance = share * diagonal
        W, G = joined_corners(V, F, tolerance)
        if len(G) < 4:
            break
        found = len(border_edges(coherent(G)))
        closed = holes_of(W, coherent(G))
        if found < best[0] and tolerance <= _THIN * _thickness(W, coherent(G), closed):
            best = (found, W, G)
            told[:] = [f"corners up to {tolerance:.3g} apart were joined"]
        if not found:
            break
    return best[1], best[2]


def _thickness(V: Floats, F: Ints, holes: Holes) -> float:
    """Return twice the volume over the area, of a surface whose holes are closed by fans."""
    V, F = fanned(V, F, holes)
    area = float(triangle_areas(V, F).sum())
    return 2 * abs(enclosed_volume(V - V.mean(axis=0), F)) / max(area, np.finfo(float).tiny)


def _closed(V: Floats, F: Ints, told: list[str]) -> tuple[Floats, Ints]:
    """Return the surface with small holes closed.

    Raises
    ------
    InputError
        The holes are large, or the surface is one-sided.
    """
    F = _with_content(V, F, told)
    holes = holes_of(V, F)
    if not len(holes.edges):
        return V, F
    where = at(holes.centre[holes.largest])
    missing = float(holes.area.sum()) / float(triangle_areas(V, F).sum())
    if missing > SMALL_HOLES:
        raise InputError(
            f"the surface is not closed: {_count(len(holes.length), 'open border')} of "
            f"{len(holes.edges)} edges, the longest around {where}; close it, or give the surfaces "
            "above and below the body by --top and --bottom"
        )
    V, F = fanned(V, F, holes)
    if len(border_edges(F)):
        raise InputError(
            f"the surface has one side only, or parts that meet in an edge, at {where}"
        )
    told.append(
        f"{_count(len(holes.length), 'hole')} of {100 * missing:.2g}% of the area "
        f"{'was' if len(holes.length) == 1 else 'were'} closed, the largest at {where}"
    )
    return V, F


def _with_content(V: Floats, F: Ints, told: list[str]) -> Ints:
    """Return the triangles without the parts that enclose nothing: loose triangles and flaps."""
    part = face_components(F)
    count = int(part.max()) + 1
    if count == 1:
        return F
    volume = np.abs(_volumes(V, F, part, count))
    area = np.bincount(part, triangle_areas(V, F), count)
    empty = (volume <= _NOTHING * volume.max()) & (area <= SMALL_HOLES * area.sum())
    loose = empty[part]
    if loose.any():
        told.append(
            f"{_count(int(loose.sum()), 'loose triangle')} that enclose nothing were left out, the "
            f"first at {at(V[F[loose][0]].mean(axis=0))}"
        )
    return np.asarray(F[~loose], dtype=np.int64)


def _volumes(V: Floats, F: Ints, part: Ints, count: int) -> Floats:
    """Return the signed volume of each part, (count,), of an open one about its own middle."""
    corners = V[F]
    sums = [np.bincount(part, corners.mean(axis=1)[:, k], count) for k in range(3)]
    middle = np.stack(sums, axis=1) / np.bincount(part, minlength=count)[:, None]
    a, b, c = (corners[:, k] - middle[part] for k in range(3))
    out = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, count)
    return np.asarray(out, dtype=np.float64)


def _outward(V: Floats, F: Ints, told: list[str]) -> Ints:
    """Return the surface turned so that outermost parts face outward, and inner ones with them.

    A part inside another that faces it stays a void; one that faces the same way stays full.
    """
    part = face_components(F)
    count = int(part.max()) + 1
    volume = _volumes(V, F, part, count)
    order = np.argsort(-np.abs(volume), kind="stable")
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, V[F].min(axis=1))
    np.maximum.at(high, part, V[F].max(axis=1))
    turn = np.zeros(count, dtype=np.int64)
    full = 0
    for place, own in enumerate(order.tolist()):
        around = _around(V, F, part, own, order[:place], (low, high))
        turn[own] = turn[around] if around >= 0 else (1 if volume[own] > 0 else -1)
        full += around >= 0 and volume[own] * turn[own] > 0
    if full:
        told.append(
            f"{_count(full, 'part')} inside another face the same way, so the inside counts as "
            "full; turn their triangles over to make them voids"
        )
    return np.asarray(np.where((turn[part] < 0)[:, None], F[:, ::-1], F), dtype=np.int64)


def _around(
    V: Floats, F: Ints, part: Ints, own: int, larger: Ints, box: tuple[Floats, Floats]
) -> int:
    """Return the smallest larger part that encloses a part; -1 for none."""
    low, high = box
    inside = (low[larger] <= low[own]).all(axis=1) & (high[larger] >= high[own]).all(axis=1)
    place = V[F[part == own][0]].mean(axis=0)[None]
    for other in larger[inside][::-1].tolist():
        if abs(float(FastWinding(V, F[part == other])(place)[0])) > 0.5:
            return int(other)
    return -1


def _uncrossed(V: Floats, F: Ints, told: list[str]) -> tuple[Floats, Ints]:
    """Return the surface without crossings: the border of all that its parts enclose.

    Raises
    ------
    InputError
        The crossings cannot be resolved.
    """
    origin = (V.min(axis=0) + V.max(axis=0)) / 2
    pairs = self_intersections(V - origin, F)
    if not len(pairs):
        return V, F
    where = at(V[F[pairs[0]]].mean(axis=(0, 1)))
    crossings = f"the surface crosses or touches itself in {_count(len(pairs), 'place')}"
    try:
        W, G = union_of_parts(V - origin, F)
    except BackendError as error:
        raise InputError(
            f"{crossings}, the first at {where}, and cannot be mended ({error}); repair it in the "
            "program that made it"
        ) from error
    if len(G) == len(F):  # nothing but touches
        return V, F
    told.append(f"{crossings}, the first at {where}; all that it encloses counts as the solid")
    return W + origin, without_slivers(G)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
