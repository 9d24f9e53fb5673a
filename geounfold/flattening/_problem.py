"""Input of every flattener: a checked surface with its rest lengths and rest triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geounfold.flattening._border import turned_over
from geounfold.flattening._result import Flattening, Stop
from geounfold.geometry.measures import lengths, triangle_areas, unique_edges
from geounfold.geometry.mesh import Floats, Ints, TriMesh

Complex = NDArray[np.complex128]

#: Least height of a rest triangle over its longest side: lengths along arcs may break the
#: triangle inequality on a needle, which then is laid out with this height.
THINNEST = 1e-9

#: A map has collapsed if its median edge is shorter than this share of its rest length.
COLLAPSED = 1e-3


@dataclass(frozen=True, eq=False)
class Problem:
    """A surface of disk topology and the lengths it should have when flat.

    Attributes
    ----------
    mesh : TriMesh
        The folded surface, (n, 3) vertices.
    loops : tuple of (b,) int
        Border loops in face direction, the longest first: the outer one, then the holes.
    edges : (k, 2) int
        ``geometry.unique_edges`` of the faces.
    rest : (k,) float
        Rest length of each edge, in the vertices' unit.
    corners : (m, 3) complex
        Each face laid flat by its rest lengths: counter-clockwise, first corner at zero,
        second on the positive real axis.
    areas : (m,) float
        Area of each face by its rest lengths; positive.
    size : float
        Twice the largest distance of a vertex from the vertices' mean.
    own : bool
        Whether the rest lengths are the mesh's own.
    """

    mesh: TriMesh
    loops: tuple[Ints, ...]
    edges: Ints
    rest: Floats
    corners: Complex
    areas: Floats
    size: float
    own: bool


def make_problem(mesh: TriMesh, loops: tuple[Ints, ...], rest: Floats | None) -> Problem:
    """Return the problem of a checked mesh; ``rest`` None: the lengths of the mesh's edges."""
    edges = unique_edges(mesh.F)
    own = lengths(mesh.V, edges)
    wanted = own if rest is None else np.array(rest, dtype=np.float64)
    corners = lay_out(wanted[edge_of_side(mesh.F, edges, len(mesh.V))])
    if rest is None:
        areas = triangle_areas(mesh.V, mesh.F)
    else:
        areas = np.asarray(corners[:, 1].real * corners[:, 2].imag / 2)
    radius = np.linalg.norm(mesh.V - mesh.V.mean(axis=0), axis=1).max()
    return Problem(mesh, loops, edges, wanted, corners, areas, 2 * float(radius), rest is None)


def edge_of_side(F: Ints, edges: Ints, n: int) -> Ints:
    """Return the edge opposite each corner of each face, (m, 3), as a row of ``edges``."""
    a, b = F[:, [1, 2, 0]], F[:, [2, 0, 1]]
    key = np.minimum(a, b) * n + np.maximum(a, b)
    out: Ints = np.searchsorted(edges[:, 0] * n + edges[:, 1], key)
    return out


def lay_out(sides: Floats) -> Complex:
    """Return triangles (m, 3) in the complex plane from the sides opposite their corners."""
    a, b, c = sides.T
    # Differences of sides, not of squares: exact to rounding on needles (Kahan).
    x = (b * b + (c - a) * (c + a)) / (2 * c)
    s = np.sort(sides, axis=1)[:, ::-1]
    lo, mid, hi = s[:, 2], s[:, 1], s[:, 0]
    product = (hi + (mid + lo)) * (lo - (hi - mid)) * (lo + (hi - mid)) * (hi + (mid - lo))
    twice_area = np.sqrt(np.maximum(product, 0)) / 2
    y = np.maximum(twice_area, THINNEST * hi * hi) / c
    out = np.zeros((len(sides), 3), dtype=np.complex128)
    out[:, 1] = c
    out[:, 2] = x + 1j * y
    return out


@dataclass
class History:
    """Energy, area error E_s and edge strain of the recorded steps."""

    problem: Problem
    energy: list[float]
    area_error: list[float]
    edge_error: list[float]

    @classmethod
    def empty(cls, problem: Problem) -> History:
        """Return a history without steps."""
        return cls(problem, [], [], [])

    def record(self, uv: Floats, energy: float) -> None:
        """Add one step."""
        p = self.problem
        self.energy.append(energy)
        self.area_error.append(relative_area_error(uv, p.mesh.F, p.areas))
        strain = lengths(uv, p.edges) / p.rest - 1
        self.edge_error.append(float(np.sqrt(np.mean(strain * strain))))


def relative_area_error(uv: Floats, F: Ints, areas: Floats) -> float:
    """Return E_s = sum |A - A'| / sum A, A' signed (a flipped triangle counts in full)."""
    return float(np.abs(areas - triangle_areas(uv, F)).sum() / areas.sum())


def upright(uv: Floats, F: Ints) -> Floats:
    """Return the flat positions centred at zero, mirrored if their signed areas sum below zero."""
    out: Floats = uv - uv.mean(axis=0)
    if triangle_areas(out, F).sum() < 0:
        out[:, 1] = -out[:, 1]
    return out


def displacement(before: Floats, after: Floats) -> float:
    """Return the largest distance that a vertex moved."""
    step = after - before
    return float(np.hypot(step[:, 0], step[:, 1]).max())


def collapsed(problem: Problem, uv: Floats) -> bool:
    """Return whether most edges have lost their length, orientation kept or not."""
    return bool(np.median(lengths(uv, problem.edges) / problem.rest) < COLLAPSED)


def flip_count(uv: Floats, F: Ints) -> int:
    """Return the number of triangles whose flat area is not positive."""
    return int(np.count_nonzero(~(triangle_areas(uv, F) > 0)))


def finish(
    problem: Problem,
    uv: Floats,
    method: str,
    stop: Stop,
    iterations: int,
    history: History,
    note: str = "",
) -> Flattening:
    """Return the result: centred, never mirrored, flips counted."""
    flat = upright(uv, problem.mesh.F)
    flat.flags.writeable = False
    return Flattening(
        mesh=problem.mesh,
        uv=flat,
        method=method,
        stop=stop,
        iterations=iterations,
        flips=len(turned_over(flat, problem.mesh.F)),
        energy=np.array(history.energy),
        area_error=np.array(history.area_error),
        edge_error=np.array(history.edge_error),
        note=note,
        loops=problem.loops,
    )
