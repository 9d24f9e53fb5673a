"""Split a closed hull into top (hanging wall), bottom (footwall) and rim.

``signed`` finds the pairs of opposite sides that the body has, its flanks and ends among them,
takes the pair of largest extent for the sheet's, and labels its faces by the lowest eigenvector
of a signed graph Laplacian: neighbours pull towards the same sign, faces that look at each other
across the body towards opposite signs.  It knows no vertical, so it holds on overturned folds.
``normal`` is the thesis's filter on the normals' vertical component (section 3.2.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.sparse.csgraph import connected_components, dijkstra

from geounfold.backends import igl as _igl
from geounfold.errors import NoSheetError, OptionError, SplitError
from geounfold.geometry import (
    bilateral_normals,
    face_normals,
    triangle_areas,
    unit,
    vertex_normals,
)
from geounfold.mesh import Bools, Floats, Ints, TriMesh, as_trimesh

CREASE_WIDTH = 0.05  # 1 - cosine at which two neighbours' pull has fallen to 1/e
WEAKEST_PULL = 1e-3  # pull that is left across the sharpest edge
CREASE_COSINE = 0.866  # neighbours' normals more than 30 degrees apart: the rim's crease
FACING = 0.5  # faces are opposite when -N.N' exceeds this
THICKEST = 2.0  # a ray longer than this many medians has missed the other side
NEARBY = 1.5  # medians within which the nearest face of the other side is opposite ...
AHEAD = 0.866  # ... if it lies within 30 degrees of the inward normal
NORMAL_THRESHOLD = 0.3  # |normal's component along up| above which a face is top or bottom
DECISIVE = 0.05  # |mean cosine| of the top's normals along an axis that decides which is top
MIN_EXTENT = 4.5  # area of a side over the squared thickness below which there is no sheet ...
MIN_PARTED = 2.5  # ... the same where flanks are told from the sides ...
FLANKED = 0.15  # ... (share of the hull from which flanks are) ...
MIN_LENGTH = 5.0  # ... unless it is a strip of so many thicknesses in length
RIDGE_COSINE = 0.9  # smoothed normals' cosine below which a ridge parts two sides of a body
LOOKS_BACK = 0.85  # faces of a pair of sides are opposite when smoothed -N.N' exceeds this
PAIRS = 3  # largest pairs of opposite sides that are compared: top, flanks, ends
SPECK = 30  # faces: what a ridge surrounds is a roughness, not another side
SWEEPS = 12  # bilateral sweeps that smooth the normals
PLANE = 0.03  # thicknesses off its plane, rms, up to which a side is plane ...
LEVEL = 0.98  # ... where its smoothed normals' mean is longer than this
BENT_ADVANTAGE = 8.0  # a bent pair of sides is preferred to a plane one of up to this the extent
COARSE_ABOVE = 12_000  # faces above which the graph is contracted before it is solved
COARSENINGS = 2  # rounds of contraction, each to about 40 % of the nodes
SMOOTHINGS = 15  # damped Jacobi sweeps after it


@dataclass(frozen=True, eq=False)
class SurfaceSplit:
    """A hull's faces labelled as top, bottom or rim.

    Attributes
    ----------
    mesh : TriMesh
        The hull that was split, in working units.
    side : (m,) int
        +1 on the top's half of the hull, -1 on the bottom's, 0 undecided.
    rim : (m,) bool
        True on the rim: no opposite face, or near the change of side, or past a crease.
    opposite : (m,) int
        Face met first by the ray along the inward normal; -1 for none.
    thickness : (m,) float
        Length of that ray, working units; inf for none.
    median_thickness : float
        Median thickness where the opposite face looks back.
    adjacency : (m, 3) int
        Neighbouring face across each edge; -1 for none.
    flipped_up : bool
        True when the caller's ``up`` (or the default) turned the two sides round.
    beyond : (m,) bool
        True on flanks and ends: faces that a ridge parts from top and bottom.
    """

    mesh: TriMesh
    side: Ints
    rim: Bools
    opposite: Ints
    thickness: Floats
    median_thickness: float
    adjacency: Ints
    flipped_up: bool
    beyond: Bools

    def scaled(self, factor: float) -> SurfaceSplit:
        """Return the split in another unit: lengths times a factor."""
        return replace(
            self,
            mesh=self.mesh.with_vertices(self.mesh.V * factor),
            thickness=self.thickness * factor,
            median_thickness=self.median_thickness * factor,
        )


@dataclass(frozen=True, eq=False)
class _Faces:
    """What both methods measure on the hull's faces.

    ``facing`` is -N.N' of a face and its opposite one, ``blunt`` the same of normals averaged
    over the vertices' faces: at the inside of a tight hinge a ray may meet any of its steep
    faces.  ``other`` marks faces known to belong to another pair of sides than the sheet's.
    """

    centre: Floats
    normal: Floats
    smoothed: Floats
    area: Floats
    adjacency: Ints
    hit: Ints
    distance: Floats
    facing: Floats
    blunt: Floats
    median: float
    other: Bools


def split(mesh: TriMesh, method: str = "signed", up: Floats | None = None) -> SurfaceSplit:
    """Split a closed hull into top, bottom and rim.

    Parameters
    ----------
    mesh : TriMesh
        A closed, outward, manifold hull in working units, or its (V, F).
    method : str
        A name in SPLITS: ``signed`` or ``normal``.
    up : (3,) float, optional
        Direction towards the top, in working coordinates.  Decides once for the whole sheet:
        the top is the side whose area-weighted normals look along it.  Default: the frame's
        third axis.

    Returns
    -------
    SurfaceSplit

    Raises
    ------
    OptionError
        Unknown method, or ``up`` is no direction.
    NoSheetError
        The body has no two opposite surfaces.
    SplitError
        The mesh is not closed, or the eigenproblem failed.

    Notes
    -----
    Where the mean cosine between ``up`` and the top's normals is below 0.05 (a vertical
    sheet), the frame's third, second and first axis are asked in this order, and the larger
    side is the top when none of them decides.
    """
    if method not in SPLITS:
        raise OptionError(f"unknown split '{method}'; valid: {', '.join(SPLITS)}")
    mesh = as_trimesh(mesh)
    result = SPLITS[method](mesh, _direction(up))
    check_sheet(result)
    return result


def split_signed(mesh: TriMesh, up: Floats | None = None) -> SurfaceSplit:
    """Split by the lowest eigenvector of the signed Laplacian of the face graph.

    Neighbours i, j pull to the same sign with weight ``exp((N_i.N_j - 1) / 0.05) + 0.001``
    over a ridge and 1.001 over a valley, a face and the one its inward ray meets to opposite
    signs with weight ``max(0, -N_i.N_j)^2 exp(-d / median d)``.

    A body has several pairs of opposite sides, which ridges part: top and bottom, flanks, ends.
    A valley parts nothing: it is the inside of a tight hinge.  The eigenvector is that of the
    sheet's pair alone (see `_sheet_pair`), for that of the whole hull may be the flanks' or one
    limb's; the other faces take the sign to which it is continued, ``L x = 0``.

    Parameters and errors as in `split`; ``side`` is +1 or -1 on every face.
    """
    faces = _measure(mesh)
    L = _signed_laplacian(faces)
    pair = _sheet_pair(faces, L)
    if pair is None:
        return _result(mesh, faces, _signs(_lowest_vector(L)), up)
    faces = replace(faces, median=pair.thickness, other=pair.others)
    return _result(mesh, faces, _signs(_continued(L, pair)), up)


def split_normal(mesh: TriMesh, up: Floats | None = None) -> SurfaceSplit:
    """Split by the normals' component along up, as the thesis does (section 3.2.2).

    Faces whose component exceeds 0.3 are top, below -0.3 bottom, the others (``side`` 0) rim.
    Overturned limbs are labelled wrongly; kept for comparison.

    Parameters and errors as in `split`; ``up`` defaults to the frame's third axis.
    """
    faces = _measure(mesh)
    along = faces.normal @ (_AXES[2] if up is None else up)
    side = np.where(along > NORMAL_THRESHOLD, 1, 0) - np.where(along < -NORMAL_THRESHOLD, 1, 0)
    result = _result(mesh, faces, side, up)
    return replace(result, side=side, flipped_up=False)


SPLITS: dict[str, Callable[[TriMesh, Floats | None], SurfaceSplit]] = {
    "signed": split_signed,
    "normal": split_normal,
}

_AXES = np.eye(3)


def _signs(x: Floats) -> Ints:
    return np.where(x >= 0, 1, -1)


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two opposite sides of a body.

    ``rows`` (k,) its faces and ``side`` (k,) +1 or -1 for each; ``thickness`` their median
    distance; ``extent`` the smaller side's area over the squared thickness; ``flat``: both
    sides are plane; ``others`` (m,) marks the faces of other pairs.
    """

    rows: Ints
    side: Ints
    thickness: float
    extent: float
    flat: bool
    others: Bools


def _sheet_pair(faces: _Faces, L: sp.csc_array) -> _Pair | None:
    """Return the pair of opposite sides of the largest extent; None where there is none.

    A fold no wider than it is thick is a bent layer and, seen from its flanks, a plane one:
    plane sides are taken only where their extent is BENT_ADVANTAGE times that of bent ones.
    """
    rank = _families(faces)
    pairs = [_pair(rank, k, faces, L) for k in range(min(rank.max() + 1, PAIRS))]
    if not pairs:
        return None
    return max(pairs, key=lambda pair: pair.extent / (BENT_ADVANTAGE if pair.flat else 1.0))


def _families(faces: _Faces) -> Ints:
    """Return the pair of sides to which each face belongs, (m,): 0 the largest, -1 for none.

    Faces beside a ridge, and those without an opposite one, belong to none; others are joined
    with their neighbours and with the face opposite.
    """
    N, near = faces.smoothed, faces.adjacency
    back = np.where(faces.hit >= 0, -np.einsum("ij,ij->i", N, N[faces.hit]), 0.0)
    good = (back > LOOKS_BACK) & ~_ridges(faces, N, RIDGE_COSINE).any(axis=1)
    own = np.arange(len(N))
    row = np.concatenate([np.repeat(own, 3), own[good]])
    column = np.concatenate([near.ravel(), faces.hit[good]])
    both = good[row] & good[column]
    links = sp.coo_array((np.ones(both.sum()), (row[both], column[both])), (len(N), len(N)))
    found = connected_components(links, directed=False)[1]
    size = np.bincount(found[good], faces.area[good], minlength=found.max() + 1)
    rank = np.empty(len(size), dtype=np.int64)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    return np.where(good, rank[found], -1)


def _pair(rank: Ints, k: int, faces: _Faces, L: sp.csc_array) -> _Pair:
    """Return the two sides that family k has, by its own lowest eigenvector."""
    rows = np.flatnonzero(rank == k)
    part = L.tocsr()[rows][:, rows].tocoo()
    off = part.row != part.col
    row, column, value = part.row[off], part.col[off], part.data[off]
    degree = np.bincount(row, np.abs(value), len(rows))
    own = np.arange(len(rows))
    at = np.concatenate([own, row]), np.concatenate([own, column])
    alone = sp.coo_array((np.concatenate([degree, value]), at), (len(rows), len(rows)))
    side = _signs(_lowest_vector(alone.tocsc())) if len(rows) > 2 else np.ones(len(rows), int)
    thickness = float(np.median(faces.distance[rows]))
    sides = [rows[side == s] for s in (1, -1)]
    areas = [float(faces.area[mine].sum()) for mine in sides]
    flat = all(_is_plane(faces, mine, thickness) for mine in sides)
    others = ((rank >= 0) & (rank != k)) | _parted(faces, rows)
    return _Pair(rows, side, thickness, min(areas) / thickness**2, flat, others)


def _is_plane(faces: _Faces, rows: Ints, thickness: float) -> bool:
    """Return whether faces lie in a plane, as far as the staircase of blocks lets them.

    The flanks of strips were 0.015 to 0.023 thicknesses off theirs, with mean normals from 0.987
    on, the sides of a gently bent layer with a hole 0.03 to 0.05 and 0.978.
    """
    area = faces.area[rows]
    if not len(rows):
        return True
    mean = float(np.linalg.norm(area @ faces.smoothed[rows]) / area.sum())
    apart = faces.centre[rows] - area @ faces.centre[rows] / area.sum()
    least = np.linalg.eigvalsh((apart * area[:, None]).T @ apart / area.sum())[0]
    return mean > LEVEL and float(np.sqrt(max(least, 0.0))) <= PLANE * thickness


def _parted(faces: _Faces, rows: Ints) -> Bools:
    """Return the faces that ridges part from all of some rows, specks excepted, (m,)."""
    n = len(faces.area)
    open_ = ~_ridges(faces, faces.smoothed, RIDGE_COSINE).ravel()
    row, column = np.repeat(np.arange(n), 3)[open_], faces.adjacency.ravel()[open_]
    links = sp.coo_array((np.ones(len(row)), (row, column)), (n, n))
    _, part = connected_components(links, directed=True, connection="weak")
    far = np.bincount(part) > SPECK
    far[part[rows]] = False
    out: Bools = far[part]
    return out


def _continued(L: sp.csc_array, pair: _Pair) -> Floats:
    """Return a pair's sides continued over the other faces, (m,): ``L x = 0`` there."""
    x = np.zeros(L.shape[0])
    x[pair.rows] = pair.side
    free = np.ones(len(x), dtype=bool)
    free[pair.rows] = False
    if free.any():
        pull = -(L @ x)[free]
        rest = L.tocsr()[free][:, free] + 1e-9 * sp.eye_array(int(free.sum()))
        options = {"SymmetricMode": True}
        x[free] = spl.splu(sp.csc_array(rest), permc_spec="MMD_AT_PLUS_A", options=options).solve(
            pull
        )
    return x


def _direction(up: Floats | None) -> Floats | None:
    if up is None:
        return None
    vector = np.asarray(up, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise OptionError(f"up must be three finite numbers, not all zero, but is {up}")
    out: Floats = vector / np.linalg.norm(vector)
    return out


def _measure(mesh: TriMesh) -> _Faces:
    """Return normals, areas, neighbours and opposite faces."""
    V = mesh.V - mesh.V.mean(axis=0)
    N = face_normals(V, mesh.F)
    adjacency = _igl.triangle_adjacency(mesh.F)
    if (adjacency < 0).any():
        raise SplitError("the hull is not closed, so it has no inside; try hull 'density'")
    centre = V[mesh.F].mean(axis=1)
    start = centre - 1e-3 * N
    hit, distance = _igl.SurfaceIndex(V, mesh.F).first_hit(start, -N)
    facing = np.where(hit >= 0, -np.einsum("ij,ij->i", N, N[hit]), 0.0)
    across = facing > FACING
    if not across.any():
        raise NoSheetError("no two faces of the body look at each other, so there is no sheet")
    area = triangle_areas(V, mesh.F)
    M = unit(vertex_normals(V, mesh.F)[mesh.F].sum(axis=1))
    blunt = np.where(hit >= 0, -np.einsum("ij,ij->i", M, M[hit]), 0.0)
    smoothed = bilateral_normals(mesh, adjacency, SWEEPS, CREASE_WIDTH)
    median = float(np.median(distance[across]))
    other = np.zeros(len(N), dtype=bool)
    return _Faces(centre, N, smoothed, area, adjacency, hit, distance, facing, blunt, median, other)


def _valleys(faces: _Faces, normal: Floats) -> Bools:
    """Return which of each face's neighbours rise above its plane, (m, 3)."""
    rise = faces.centre[faces.adjacency] - faces.centre[:, None]
    return np.asarray(np.einsum("ikj,ij->ik", rise, normal) > 0)


def _ridges(faces: _Faces, normal: Floats, limit: float) -> Bools:
    """Return across which edges the surface falls away at a cosine below the limit, (m, 3)."""
    cosine = np.einsum("ij,ikj->ik", normal, normal[faces.adjacency])
    out: Bools = (cosine < limit) & ~_valleys(faces, normal)
    return out


def _signed_laplacian(faces: _Faces) -> sp.csc_array:
    """Return D - A + B: A the pull of neighbours, B the push of opposite faces (symmetrised)."""
    n = len(faces.normal)
    i, j = np.repeat(np.arange(n), 3), faces.adjacency.ravel()
    cosine = np.einsum("ij,ij->i", faces.normal[i], faces.normal[j]).clip(-1, 1)
    pull = (
        np.where(_valleys(faces, faces.normal).ravel(), 1.0, np.exp((cosine - 1) / CREASE_WIDTH))
        + WEAKEST_PULL
    )
    seen = np.flatnonzero(faces.facing > 0)
    hit = faces.hit[seen]
    push = faces.facing[seen] ** 2 * np.exp(-faces.distance[seen] / faces.median) / 2
    rows, columns = np.concatenate([i, seen, hit]), np.concatenate([j, hit, seen])
    degree = np.bincount(rows, np.concatenate([pull, push, push]), n)
    values = np.concatenate([degree, -pull, push, push])
    diagonal = np.arange(n)
    at = np.concatenate([diagonal, rows]), np.concatenate([diagonal, columns])
    return sp.coo_array((values, at), (n, n)).tocsc()


def _lowest_vector(L: sp.csc_array) -> Floats:
    """Return the eigenvector (n,) of the lowest eigenvalue of the signed Laplacian.

    A large graph is first contracted along its strongest pulls, so that the factorisation stays
    small; the eigenvector of the contracted graph, constant on each cluster, is then smoothed.
    """
    if L.shape[0] <= COARSE_ABOVE:
        return _lowest_exact(L)[1]
    cluster = _clusters(L, COARSENINGS)
    size = np.bincount(cluster)
    scale = 1 / np.sqrt(size)
    coarse = _contract(L, cluster)
    value, y = _lowest_exact(sp.csc_array(sp.diags_array(scale) @ coarse @ sp.diags_array(scale)))
    x: Floats = (scale * y)[cluster]
    diagonal = L.diagonal()
    for _ in range(SMOOTHINGS):
        x = x - 0.6 * (L @ x - value * x) / diagonal
    return x


def _lowest_exact(L: sp.csc_array) -> tuple[float, Floats]:
    """Return the lowest eigenvalue and its eigenvector, by shift-invert Lanczos."""
    n = L.shape[0]
    shifted = sp.csc_array(L + 1e-6 * sp.eye_array(n))
    lu = spl.splu(shifted, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solve = spl.LinearOperator((n, n), matvec=lu.solve, dtype=np.float64)
    start = np.cos(np.arange(n) * 2.399963)
    options = {"sigma": -1e-6, "which": "LM", "OPinv": solve, "v0": start, "tol": 1e-6}
    try:
        values, vectors = spl.eigsh(L, k=1, ncv=min(n, 12), **options)
    except spl.ArpackNoConvergence as error:
        raise SplitError("the signed split did not converge; try split 'normal'") from error
    return float(values[0]), vectors[:, 0]


def _clusters(L: sp.csc_array, rounds: int) -> Ints:
    """Return a cluster for each node, (n,): mutual strongest pulls are joined, round by round."""
    cluster = np.arange(L.shape[0])
    for _ in range(rounds):
        joined = _match(L)
        cluster = joined[cluster]
        L = _contract(L, joined)
    return cluster


def _match(L: sp.csc_array) -> Ints:
    """Return a cluster number per node, (n,): pairs that pull each other most, and followers.

    Equal pulls are told apart by a fixed hash of the pair, so that a flat face is cut into
    compact clusters.
    """
    graph = L.tocoo()
    pulls = (graph.row != graph.col) & (graph.data < 0)
    row, column = graph.row[pulls].astype(np.int64), graph.col[pulls].astype(np.int64)
    low, high = np.minimum(row, column), np.maximum(row, column)
    order = np.lexsort(((low * 7919 + high * 104729) % 1000003, -graph.data[pulls].round(6), row))
    last = np.append(row[order][1:] != row[order][:-1], True)
    own = np.arange(L.shape[0])
    best = own.copy()
    best[row[order][last]] = column[order][last]
    mutual = best[best] == own
    root = np.where(mutual, np.minimum(best, own), own)
    root = np.where(mutual, root, root[best])
    return np.unique(root, return_inverse=True)[1].astype(np.int64)


def _contract(L: sp.csc_array, cluster: Ints) -> sp.csc_array:
    """Return the Laplacian of the graph whose nodes are the clusters of L's."""
    graph = L.tocoo()
    n = int(cluster.max()) + 1
    return sp.coo_array((graph.data, (cluster[graph.row], cluster[graph.col])), (n, n)).tocsc()


def _result(mesh: TriMesh, faces: _Faces, side: Ints, up: Floats | None) -> SurfaceSplit:
    """Return the split with its rim, turned so that the top looks up."""
    near = faces.adjacency
    rim = (side == 0) | faces.other | (side[near] != side[:, None]).any(axis=1)
    rim |= _ridges(faces, faces.normal, CREASE_COSINE).any(axis=1)
    faces = _met_nearby(mesh, faces, np.where(rim, 0, side))
    rim |= _unmet(faces, side)
    default = _orientation(faces, np.where(rim, 0, side), None)
    turn = default if up is None else _orientation(faces, np.where(rim, 0, side), up)
    return SurfaceSplit(
        mesh=mesh,
        side=side * turn,
        rim=rim,
        opposite=faces.hit,
        thickness=faces.distance,
        median_thickness=faces.median,
        adjacency=faces.adjacency,
        flipped_up=turn != default,
        beyond=faces.other,
    )


def _unmet(faces: _Faces, side: Ints) -> Bools:
    """Return the faces whose inward ray met no face of the other side that looks back, (m,)."""
    unmet: Bools = (faces.hit < 0) | (np.maximum(faces.facing, faces.blunt) < FACING)
    unmet |= (faces.distance > THICKEST * faces.median) | (side[faces.hit] == side)
    return unmet


def _met_nearby(mesh: TriMesh, faces: _Faces, side: Ints) -> _Faces:
    """Return the faces, those that met nothing opposite the nearest face of the other side.

    The ray from the outside of a tight hinge misses the slit between the limbs and runs on
    along one of them, though the slit's end is near.  The nearest point counts where it lies
    within 30 degrees of the inward normal and 1.5 thicknesses away.  ``side`` (m,) is 0 on
    faces already known to be rim.
    """
    unmet = _unmet(faces, side)
    hit, distance, facing = faces.hit.copy(), faces.distance.copy(), faces.facing.copy()
    for s in (1, -1):
        mine, theirs = np.flatnonzero(unmet & (side == s)), np.flatnonzero(side == -s)
        if not (len(mine) and len(theirs)):
            continue
        index = _igl.SurfaceIndex(mesh.V - mesh.V.mean(axis=0), mesh.F[theirs])
        far, face, foot = index.closest(faces.centre[mine])
        way = unit(foot - faces.centre[mine])
        ahead = -np.einsum("ij,ij->i", way, faces.smoothed[mine]) > AHEAD
        good = ahead & (far < NEARBY * faces.median)
        rows = mine[good]
        hit[rows], distance[rows], facing[rows] = theirs[face[good]], far[good], 1.0
    return replace(faces, hit=hit, distance=distance, facing=facing)


def _orientation(faces: _Faces, side: Ints, up: Floats | None) -> int:
    """Return +1 where side +1 is the top already, else -1 (see `split` for the rule)."""
    weight = faces.area * side
    covered = faces.area[side != 0].sum()
    for axis in [*([] if up is None else [up]), _AXES[2], _AXES[1], _AXES[0]]:
        looks = float(weight @ (faces.normal @ axis))
        if abs(looks) > DECISIVE * covered:
            return 1 if looks > 0 else -1
    return 1 if weight.sum() >= 0 else -1


def side_extent(result: SurfaceSplit) -> tuple[float, float]:
    """Return the area of top and of bottom away from the rim, over the squared thickness."""
    area = triangle_areas(result.mesh.V, result.mesh.F) / result.median_thickness**2
    top, bottom = (float(area[(result.side == s) & ~result.rim].sum()) for s in (1, -1))
    return top, bottom


def side_length(result: SurfaceSplit) -> float:
    """Return how many thicknesses long the top is, along its surface."""
    rows = np.flatnonzero((result.side > 0) & ~result.beyond)
    if not len(rows):
        return 0.0
    number = np.full(len(result.side), -1)
    number[rows] = np.arange(len(rows))
    start, end = np.repeat(number[rows], 3), number[result.adjacency[rows]].ravel()
    start, end = start[end >= 0], end[end >= 0]
    centre = result.mesh.V[result.mesh.F[rows]].mean(axis=1)
    step = np.linalg.norm(centre[start] - centre[end], axis=1)
    links = sp.coo_array((step, (start, end)), (len(rows), len(rows))).tocsr()
    part = connected_components(links, directed=False)[1]
    far = int(np.argmax(part == np.bincount(part).argmax()))
    for _ in range(2):  # the face farthest from any face is one end of the longest way
        reach = np.asarray(dijkstra(links, indices=np.array([far])))[0]
        reach[~np.isfinite(reach)] = 0.0
        far = int(reach.argmax())
    return float(reach[far]) / result.median_thickness


def check_sheet(result: SurfaceSplit) -> None:
    """Raise NoSheetError where a side is too small for its thickness: a ball, a cube.

    Where ridges part the sides from flanks they are told from them by more than size, and the
    least extent is MIN_PARTED, flanks left out; a strip no wider than it is thick may be long
    instead.
    """
    extent = min(side_extent(result))
    if extent >= MIN_EXTENT:
        return
    area = triangle_areas(result.mesh.V, result.mesh.F) / result.median_thickness**2
    if area[result.beyond].sum() > FLANKED * area.sum():
        parted = min(float(area[(result.side == s) & ~result.beyond].sum()) for s in (1, -1))
        if parted >= MIN_PARTED or (parted >= 1 and side_length(result) >= MIN_LENGTH):
            return
    raise NoSheetError(
        "the body has no two opposite surfaces to flatten: each covers only "
        f"{extent:.1f} times its thickness squared (a sheet has at least {MIN_EXTENT:g}, or a "
        f"strip {MIN_LENGTH:g} times its thickness in length)"
    )
