"""The control mesh of a fitted sheet: footprint, flattening, offsets, repair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.backends.igl import TetIndex
from geounfold.control import ControlMesh, Datum
from geounfold.flattening._result import Flattening
from geounfold.mesh import Floats, Ints, TetMesh, TriMesh
from geounfold.sheet.fit import FittedSheet
from geounfold.sheet.footprint import Footprint, footprint, principal_direction
from geounfold.sheet.horizons import Horizons
from geounfold.sheet.layers import Layers, bad_nodes, neighbour_mean, shrink
from geounfold.sheet.surface import Foot, Sheet, normals, principal_curvatures

Flatten = Callable[[TriMesh, Floats | None], Flattening]
"""``flatten(mesh, start)``: a surface laid flat from a start, (n, 2) or None."""


@dataclass(frozen=True, kw_only=True)
class ControlOptions:
    """Shape of the control mesh; lengths in blocks.

    ``cell``: side of the footprint's cells, and ``widest``, ``turn``, ``many``: on footprints of
    more cells than ``many`` cells grow up to the widest while the surface turns by no more than
    ``turn`` radians over one; ``dilation``: rings of cells past the blocks;
    ``pad``: height of the mesh past the blocks where offsets are constant; ``pad_capped``:
    where they vary; ``focal``: largest share of the focal distance; ``reach``: radius, in
    cells, of the filter on varying offsets; ``shrinks``: most steps of the repair;
    ``trip``: largest round-trip error of a block.
    """

    cell: float = 1.5
    widest: float = 3.0
    turn: float = 0.1
    many: int = 8000
    dilation: int = 1
    pad: float = 0.6
    pad_capped: float = 1.0
    focal: float = 0.9
    slope: float = 0.7
    reach: int = 3
    shrinks: int = 40
    trip: float = 1e-6


@dataclass(frozen=True, eq=False)
class SheetMesh:
    """What the sheet method made of a body, in working units.

    Attributes
    ----------
    control : ControlMesh
        Tetrahedra in both spaces.
    flattenings : dict of Flattening
        The mid surface (``mid``) and the parallel surfaces above and below it (``top``,
        ``bottom``), over the same footprint, as they were flattened.
    layers : Layers
        The prisms.
    rung : str
        Last rung of the ladder that was needed: constant, capped or shrunk.
    shrinks : int
        Steps of the shrinking rung.
    surfaces : dict of (TriMesh, TriMesh)
        Mid, top and bottom surface, folded and unfolded, over the footprint.
    indices : tuple of TetIndex
        Trees that were built over the prisms in either space; none after a repair that failed.
    """

    control: ControlMesh
    flattenings: dict[str, Flattening]
    layers: Layers
    rung: str
    shrinks: int
    surfaces: dict[str, tuple[TriMesh, TriMesh]]
    indices: tuple[TetIndex, ...] = ()


def register(A: Floats, B: Floats, weight: Floats) -> Floats:
    """Return A (n, 2) moved rigidly, never mirrored, onto B (n, 2) by weighted least squares."""
    w = weight / weight.sum()
    a, b = w @ A, w @ B
    u, _, vt = np.linalg.svd(((A - a) * w[:, None]).T @ (B - b))
    d = np.sign(np.linalg.det(u @ vt))
    out: Floats = (A - a) @ (u @ np.diag([1.0, d]) @ vt) + b
    return out


def block_feet(fitted: FittedSheet, points: Floats, reach: float) -> Foot:
    """Return the feet of all blocks; those past the trimmed sheet are searched on all of it."""
    foot = fitted.sheet.search(fitted.near, reach).feet(points)
    missed = foot.miss > 0.05
    if missed.any():
        again = fitted.sheet.search().feet(points[missed], newton=3)
        for mine, theirs in zip(foot, again, strict=True):
            mine[missed] = theirs
    return foot


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Places of the control mesh's nodes on the normals of the mid surface, (n, 3) each.

    A mesh whose nodes lie on a curved surface is shorter than it, and lies on its inner side.
    Nodes lifted by 1/24 of the second difference over a cell have chords as long as the arcs;
    lifted by 1/12, the flat cells have the arcs' mean height (Simpson's rule).  The points at
    height t are ``P + t normal`` of either pair.
    """

    chord_points: Floats
    chord_normal: Floats
    mean_points: Floats
    mean_normal: Floats


def _lifted_nodes(sheet: Sheet, prints: Footprint) -> _Nodes:
    """Return the nodes of both kinds at the footprint's parameters."""
    jet = sheet.jet(prints.U)
    P, normal = jet.value, normals(jet)
    bend_P, bend_n = np.zeros_like(P), np.zeros_like(P)
    for axis in prints.axes * prints.cell:
        for step in (axis, -axis):
            near = sheet.jet(prints.U + step)
            bend_P += near.value - P
            bend_n += normals(near) - normal
    return _Nodes(P - bend_P / 24, normal - bend_n / 24, P - bend_P / 12, normal - bend_n / 12)


@dataclass(frozen=True, eq=False)
class _FlatSheet:
    """The mid surface at the footprint's nodes, flat, with slopes above and below."""

    flat: Floats
    slopes: tuple[Floats, Floats]
    flattenings: dict[str, Flattening]

    @property
    def flips(self) -> int:
        return sum(f.flips for f in self.flattenings.values())


def _flatten_sheet(
    nodes: _Nodes, prints: Footprint, slip: Floats, reach: tuple[float, float], flatten: Flatten
) -> _FlatSheet:
    """Flatten the mid surface and the parallel surfaces ``reach`` above and below it.

    The fitted ``slip`` (n, 2) per height is the start of the latter two.
    """
    P, normal = nodes.chord_points, nodes.chord_normal
    middle = flatten(TriMesh(P, prints.F), prints.U)
    mid = register(middle.uv, prints.U, prints.weight)
    above = flatten(TriMesh(P + reach[0] * normal, prints.F), mid - reach[0] * slip)
    below = flatten(TriMesh(P - reach[1] * normal, prints.F), mid + reach[1] * slip)
    slopes = tuple(
        (register(f.uv, mid, prints.weight) - mid) / q
        for f, q in zip((above, below), reach, strict=True)
    )
    flattenings = {"mid": middle, "top": above, "bottom": below}
    return _FlatSheet(mid, (slopes[0], slopes[1]), flattenings)


def _safely_flat(
    nodes: _Nodes, prints: Footprint, slip: Floats, reach: tuple[float, float], flatten: Flatten
) -> _FlatSheet:
    """Flatten at the full reach, or nearer to the mid surface where that would fold over.

    Slip is linear in height on a developable sheet, so nearer surfaces give the same slopes.
    """
    for share in (1.0, 0.6, 0.35, 0.2):
        near = (share * reach[0], share * reach[1])
        result = _flatten_sheet(nodes, prints, slip, near, flatten)
        if not result.flips:
            break
    return result


def _focal_caps(curvature: Floats, focal: float) -> Floats:
    return np.asarray(focal / np.maximum(curvature, 1e-9))


def _offsets(prints: Footprint, foot: Foot, caps: Floats, options: ControlOptions) -> Floats:
    """Return offsets (2, n) that follow the blocks, capped at a share of the focal distance."""
    use = foot.miss < 0.5
    need = [prints.cell_max(s * foot.t, use) for s in (1.0, -1.0)]
    follow = [prints.at_nodes(q, options.reach) + options.pad_capped for q in need]
    return np.minimum(np.stack(follow), caps)


def _round_trip_misses(there: TetIndex, back: TetIndex, points: Floats, limit: float) -> Ints:
    """Return the vertices of tetrahedra holding blocks that do not come back."""
    folded, unfolded, T = there.V, back.V, there.T
    first = there.locate(points)
    inside = first >= 0
    b = there.barycentric(points[inside], first[inside])
    flat = np.einsum("ij,ijk->ik", b, unfolded[T[first[inside]]])
    second = back.locate(flat)
    other = np.where(second >= 0, second, first[inside])
    returned = np.einsum("ij,ijk->ik", back.barycentric(flat, other), folded[T[other]])
    missed = np.abs(returned - points[inside]).max(axis=1) > limit
    vertices: Ints = T[np.concatenate([first[inside][missed], other[missed]])].ravel()
    return vertices


def _climb(
    layers: Layers, follow: Floats, constant: bool, points: Floats, options: ControlOptions
) -> tuple[Layers, str, int, tuple[TetIndex, ...]]:
    """Return layers that are upright in both spaces and bring every block back.

    With them the last rung, the shrinks, and where blocks were carried the trees of both spaces.

    Rungs: constant offsets (parallel surfaces), offsets that follow the blocks under the
    focal cap, then shrinking around what is still wrong.
    """
    T = layers.tets()
    mean = neighbour_mean(layers.F, len(layers.P))
    rung = "constant" if constant else "capped"
    for shrinks in range(options.shrinks + 1):
        nodes = bad_nodes(layers, T)
        indices: tuple[TetIndex, ...] = ()
        if not len(nodes):
            there, back = TetIndex(layers.folded, T), TetIndex(layers.unfolded, T)
            indices = (there, back)
            missed = _round_trip_misses(there, back, points, options.trip)
            nodes = np.unique(missed % len(layers.P))
        if not len(nodes) or shrinks == options.shrinks:
            break
        if rung == "constant":
            rung, layers = "capped", replace(layers, up=follow[0], down=follow[1])
            continue
        rung, layers = "shrunk", shrink(layers, nodes, mean)
    return layers, rung, shrinks, indices


def _footprint(sheet: Sheet, U: Floats, options: ControlOptions) -> Footprint:
    """Return the footprint of feet U (b, 2), with cells as wide as size and bends allow."""
    angle = principal_direction(sheet, U)
    prints = footprint(U, angle, options.cell, options.dilation)
    if len(prints.F) <= 2 * options.many:
        return prints
    k1, k2 = principal_curvatures(sheet.jet(prints.U))
    bend = float(np.percentile(np.maximum(k1, -k2), 99))
    cell = min(options.widest, options.turn / max(bend, 1e-9))
    return footprint(U, angle, cell, options.dilation) if cell > options.cell else prints


def build_control(
    fitted: FittedSheet,
    horizons: Horizons,
    points: Floats,
    flatten: Flatten,
    options: ControlOptions,
    datum: str = "mid",
) -> SheetMesh:
    """Return the control mesh that holds the blocks, in both spaces (see SheetMesh).

    Prism edges are normals of the mid surface; surfaces parallel to it above and below are
    flattened on their own and registered rigidly to the flat mid surface, which reproduces
    flexural slip with zero mean slip (the pin line).

    Parameters
    ----------
    fitted : FittedSheet
        Mid surface.
    horizons : Horizons
        Top and bottom, for the stratigraphic coordinate.
    points : (n, 3) float
        Blocks, working units.
    flatten : callable
        See Flatten.
    options : ControlOptions
        See there.
    datum : str
        Which surface is flat; see Datum.
    """
    sheet = fitted.sheet
    foot = block_feet(fitted, points, reach=10.0)
    prints = _footprint(sheet, foot.U, options)
    k1, k2 = principal_curvatures(sheet.jet(prints.U))
    curvature = np.stack([k1, -k2])
    caps = _focal_caps(curvature, options.focal)
    use = foot.miss < 0.5
    reach = float(np.abs(foot.t[use]).max()) + options.pad
    constant = not (caps < reach).any()
    safe = [min(reach, options.slope * float(np.percentile(c, 0.5))) for c in caps]
    nodes = _lifted_nodes(sheet, prints)
    slip = sheet.grid.value(fitted.slip, prints.U)
    flat = _safely_flat(nodes, prints, slip, (safe[0], safe[1]), flatten)
    follow = _offsets(prints, foot, caps, options)
    offsets = np.full_like(follow, reach) if constant else follow
    layers = Layers(
        nodes.mean_points,
        nodes.mean_normal,
        flat.flat,
        flat.slopes[0],
        flat.slopes[1],
        prints.F,
        curvature,
        offsets[0],
        offsets[1],
    )
    layers, rung, shrinks, indices = _climb(layers, follow, constant, points, options)
    bottom, top = horizons.crossings(prints.U, slip, limit=2 * reach)
    means = [float(np.average(h, weights=prints.weight)) for h in (bottom, top)]
    flat_datum = Datum(datum, means[0], means[1])

    def unfolded(height: Floats) -> tuple[Floats, Floats]:
        """Return unfolded vertices and stratigraphic coordinate at heights over the nodes."""
        low, high = horizons.heights(prints.U - height[:, None] * slip)
        plane = layers.flat_at(height)
        z = flat_datum.z(height, low, high)
        return np.column_stack([plane, z]), (height - low) / (high - low)

    surfaces = {}
    for name, height in (("mid", np.zeros(len(top))), ("top", top), ("bottom", bottom)):
        folded = layers.P + height[:, None] * layers.normal
        surfaces[name] = (TriMesh(folded, prints.F), TriMesh(unfolded(height)[0], prints.F))
    T = layers.tets()
    vertices, stratigraphic = zip(*(unfolded(q) for q in layers.heights), strict=True)
    control = ControlMesh(
        TetMesh(layers.folded, T),
        TetMesh(np.concatenate(vertices), T),
        np.concatenate(stratigraphic),
    )
    return SheetMesh(control, flat.flattenings, layers, rung, shrinks, surfaces, indices)
