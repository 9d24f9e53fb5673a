"""The control mesh of a fitted sheet: footprint, flattening, offsets, repair."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from geounfold.backends.igl import SurfaceIndex
from geounfold.backends.progress import within
from geounfold.flattening._result import Flattening
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.mapping.control_mesh import ControlMesh, Datum
from geounfold.methods.sheet.meshing.footprint import Footprint, footprint, principal_direction
from geounfold.methods.sheet.meshing.prism_columns import Columns
from geounfold.methods.sheet.meshing.prism_layers import (
    FINE_FRACTIONS,
    FRACTIONS,
    Layers,
    bounded_slope,
)
from geounfold.methods.sheet.meshing.repair import Rung, climb
from geounfold.methods.sheet.meshing.top_and_bottom import Horizons
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.mid_surface.pin_line import CrossSection, fold_axes
from geounfold.methods.sheet.mid_surface.surface import (
    Foot,
    MidSurface,
    normals,
    principal_curvatures,
)

Flatten = Callable[[TriMesh, Floats | None], Flattening]
"""``flatten(mesh, start)``: a surface laid flat from a start, (n, 2) or None."""

CELL = 1.5
"""Side of the footprint's cells, in blocks."""

PAD = 0.6
"""Height of the mesh past the outermost blocks, in blocks, for constant offsets."""

PAD_CAPPED = 1.0
"""The same for offsets that follow the blocks."""

SHELL = 3.0
"""Distance, in blocks, to which the shell reaches past the control mesh."""

_WIDEST = 3.0  # blocks: largest side of the cells on footprints of more than _MANY cells
_MANY = 8000
_TURN = 0.1  # radians by which the surface may turn across one of these wider cells
_TURN_MERGED = 0.25  # the same if blocks were merged; it sets the cells' side
_DILATION = 1  # rings of cells past the blocks
_FOCAL = 0.9  # largest offset, as a share of the focal distance
_FOCAL_REFINED = 0.95  # the same with cells of half the side
_SLOPES = (0.3, 0.6, 1.2)  # slopes of the caps (largest offsets) along the sheet, tried in order
_SAFE = 0.7  # share of the caps within which the flattened parallel surfaces lie
_FILTER = 3  # radius, in cells, of the filter on varying offsets


@dataclass(frozen=True)
class MeshPlan:
    """Settings of a control mesh.

    Attributes
    ----------
    flatten : callable
        ``flatten(mesh, start)`` lays a surface flat from a start, (n, 2) or None.
    datum : str
        Which surface is flat: mid, top, bottom or proportional.
    cell : float
        Side of the footprint's cells, in blocks.
    shell : float
        Distance, in blocks, to which the shell reaches past the control mesh.
    count : int or None
        Number of blocks of the body, if those at its surface alone are held.
    """

    flatten: Flatten
    datum: str = "mid"
    cell: float = CELL
    shell: float = SHELL
    count: int | None = None


@dataclass(frozen=True, eq=False)
class SheetMesh:
    """The control mesh of a body by the sheet method, in working units.

    Attributes
    ----------
    control : ControlMesh
        Tetrahedra in both spaces.
    shell : ControlMesh or None
        Tetrahedra around the control mesh; its vertices come first.
    flattenings : dict of Flattening
        The mid surface (``mid``) and the parallel surfaces above and below it (``top``,
        ``bottom``), over the same footprint, as they were flattened.
    layers : Layers
        The prisms.
    rungs : tuple of Rung
        Result of every rung of the ladder that was tried; the last is the one taken.
    surfaces : dict of (TriMesh, TriMesh)
        Mid, top and bottom surface, folded and unfolded, over the footprint.
    over_mid : (ControlMesh, ControlMesh or None)
        Control mesh and shell with the mid surface flat, whatever the datum.
    """

    control: ControlMesh
    shell: ControlMesh | None
    flattenings: dict[str, Flattening]
    layers: Layers
    rungs: tuple[Rung, ...]
    surfaces: dict[str, tuple[TriMesh, TriMesh]]
    over_mid: tuple[ControlMesh, ControlMesh | None]

    @property
    def lost(self) -> float:
        """Least number of blocks that a proved rung does not hold; infinite if none was proved."""
        proved = [r.lost for r in self.rungs if not r.flaws and r.lost is not None]
        return min(proved, default=float("inf"))

    @property
    def sound(self) -> bool:
        """Whether some rung was proved and lost no block."""
        return self.lost == 0


def register(A: Floats, B: Floats, weight: Floats) -> Floats:
    """Return A (n, 2) moved rigidly, never mirrored, onto B (n, 2) by weighted least squares."""
    w = weight / weight.sum()
    a, b = w @ A, w @ B
    u, _, vt = np.linalg.svd(((A - a) * w[:, None]).T @ (B - b))
    d = np.sign(np.linalg.det(u @ vt))
    out: Floats = (A - a) @ (u @ np.diag([1.0, d]) @ vt) + b
    return out


def block_feet(fitted: FittedSheet, points: Floats, reach: float) -> Foot:
    """Return the feet of all blocks, each on its own limb (`FittedSheet.own_feet`)."""
    return fitted.own_feet(points, (reach / 5, reach / 2, reach))


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Places of the control mesh's nodes on the normals of the mid surface, (n, 3) each.

    A mesh whose nodes lie on a curved surface is shorter than the surface, and lies on its inner
    side.  If the nodes are lifted by 1/24 of the second difference over a cell, chords are as long
    as arcs; if lifted by 1/12, the flat cells have the arcs' mean height (Simpson's rule).  The
    points at height t are ``P + t normal`` of either pair.
    """

    chord_points: Floats
    chord_normal: Floats
    mean_points: Floats
    mean_normal: Floats


def _lifted_nodes(sheet: MidSurface, U: Floats, prints: Footprint) -> _Nodes:
    """Return the nodes of both kinds at parameters U (n, 2) of a footprint's grid."""
    jet = sheet.jet(U)
    P, normal = jet.value, normals(jet)
    bend_P, bend_n = np.zeros_like(P), np.zeros_like(P)
    for axis in prints.axes * prints.cell:
        for step in (axis, -axis):
            near = sheet.jet(U + step)
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
    nodes: _Nodes,
    prints: Footprint,
    profile: CrossSection,
    slip: Floats,
    reach: tuple[float, float],
    flatten: Flatten,
) -> _FlatSheet:
    """Flatten the mid surface and the parallel surfaces ``reach`` above and below it.

    The two parallel surfaces start from the fitted ``slip`` (n, 2) per height; their mean slip over
    the ``profile`` is zero.
    """
    n = len(prints.U)
    P, normal = nodes.chord_points[:n], nodes.chord_normal[:n]
    middle = flatten(TriMesh(P, prints.F), prints.U)
    mid = register(middle.uv, prints.U, prints.weight)
    above = flatten(TriMesh(P + reach[0] * normal, prints.F), mid - reach[0] * slip)
    below = flatten(TriMesh(P - reach[1] * normal, prints.F), mid + reach[1] * slip)
    slopes = []
    for f, q in zip((above, below), reach, strict=True):
        slope = (register(f.uv, mid, prints.weight) - mid) / q
        slopes.append(slope - profile.mean(slope, prints.U, prints.weight, prints.cell))
    flattenings = {"mid": middle, "top": above, "bottom": below}
    return _FlatSheet(mid, (slopes[0], slopes[1]), flattenings)


def _safely_flat(
    nodes: _Nodes,
    prints: Footprint,
    profile: CrossSection,
    slip: Floats,
    reach: tuple[float, float],
    flatten: Flatten,
) -> _FlatSheet:
    """Flatten at the full reach, or nearer to the mid surface if that would fold over.

    Slip is linear in height on a developable sheet, so nearer surfaces give the same slopes.
    """
    for share in (1.0, 0.6, 0.35, 0.2):
        near = (share * reach[0], share * reach[1])
        result = _flatten_sheet(nodes, prints, profile, slip, near, flatten)
        if not result.flips:
            break
    return result


_OFF = 1e-3  # blocks: distance from top or bottom at which rays towards other limbs start
_HALF = 0.45  # share of the distance to another limb that the mesh may use
_TIP = 1.5  # blocks: distance before the sheet's end at which the tip's thickness is measured
_FARTHEST = 8.0  # blocks: how far a sheet too thin for blocks goes on past the last one
_STRAIGHT = 1e-9  # curvature below which a surface counts as plane, without a focal distance


def _focal_caps(curvature: Floats, focal: float) -> Floats:
    return np.asarray(focal / np.maximum(curvature, _STRAIGHT))


def _offsets(columns: Columns, foot: Foot, caps: Floats) -> Floats:
    """Return offsets (2, n) that follow the blocks, at most the caps (2, n)."""
    prints, use = columns.prints, foot.miss < 0.5
    need = [prints.cell_max(s * foot.t, use) for s in (1.0, -1.0)]
    follow = [prints.at_nodes(q, _FILTER) + PAD_CAPPED for q in need]
    return np.minimum(np.stack(follow), caps)


def _room(columns: Columns, share: float) -> Floats:
    """Return the largest heights of the mesh above and below, (2, n).

    A share of the distance at which neighbouring normals meet; and, past top and bottom, less than
    half of the distance to another limb.
    """
    P, normal = (a[: columns.count] for a in (columns.P, columns.normal))
    sides = (columns.high, columns.low)
    walls = [P + height[:, None] * normal for height in sides]
    F, n = columns.prints.F, columns.count
    index = SurfaceIndex(np.concatenate(walls), np.concatenate([F, F + n]))
    room = _focal_caps(columns.curvature[:, :n], share)
    for k, (side, wall, height) in enumerate(zip((1.0, -1.0), walls, sides, strict=True)):
        out = side * normal
        gap = index.first_hit(wall + _OFF * out, out)[1]
        room[k] = np.minimum(room[k], side * height + _HALF * gap)
    return room


def _sloping_caps(columns: Columns, share: float, slope: float) -> Floats:
    """Return caps (2, n) on the offsets: the largest heights, with a bounded slope.

    At a hinge the mesh's border has to stay nearly parallel to the sheet.  If it dips towards a
    focal line and out again, a column crosses the column next but one.
    """
    F, U = columns.prints.F, columns.prints.U
    return np.stack([bounded_slope(cap, U, F, slope) for cap in _room(columns, share)])


def _footprint(
    sheet: MidSurface, U: Floats, plan: MeshPlan, unit: float, side: float | None
) -> Footprint:
    """Return the footprint of feet U (b, 2), with cells as wide as its size and curvature allow.

    ``unit``: side of the cells that blocks were merged into, 1 if they were not; ``side``: side of
    the footprint's cells, None to choose it by size and curvature.
    """
    angle = principal_direction(sheet, U)

    def prints_of(cell: float) -> Footprint:
        rings = int(np.ceil(plan.shell / cell))
        return footprint(U, angle, cell, _DILATION, rings)

    start = plan.cell if side is None else side
    if side is None and unit > 1:
        start = float(np.clip(_TURN_MERGED / _bend(sheet, U), start, start * unit))
    prints = prints_of(start)
    if side is not None or len(prints.F) <= 2 * _MANY:
        return prints
    cell = min(_WIDEST, _TURN / _bend(sheet, prints.U))
    return prints_of(cell) if cell > start else prints


def _bend(sheet: MidSurface, U: Floats) -> float:
    """Return the curvature exceeded at one in a hundred places U (n, 2)."""
    k1, k2 = principal_curvatures(sheet.jet(U))
    return max(float(np.percentile(np.maximum(k1, -k2), 99)), 1e-9)


def _columns(
    fitted: FittedSheet,
    horizons: Horizons,
    foot: Foot,
    cell: float | None,
    plan: MeshPlan,
) -> Columns:
    """Return the columns over the blocks' footprint; ``cell`` None: side chosen by curvature."""
    sheet = fitted.sheet
    prints = _footprint(sheet, foot.U, plan, fitted.unit, cell)
    every = np.concatenate([prints.U, prints.ring.U])
    k1, k2 = principal_curvatures(sheet.jet(every))
    curvature = np.stack([k1, -k2])
    n = len(prints.U)
    reach = _reach(foot)
    caps = _focal_caps(curvature[:, :n], _FOCAL)
    safe = [min(reach, _SAFE * float(np.percentile(c, 0.5))) for c in caps]
    nodes = _lifted_nodes(sheet, every, prints)
    slip = sheet.grid.value(fitted.slip, every)
    flat = _safely_flat(
        nodes, prints, _profile(fitted, foot), slip[:n], (safe[0], safe[1]), plan.flatten
    )
    bottom, top = horizons.crossings(prints.U, slip[:n], limit=2 * reach)
    means = [float(np.average(h, weights=prints.weight)) for h in (bottom, top)]
    return Columns(
        prints=prints,
        P=nodes.mean_points,
        normal=nodes.mean_normal,
        slip=slip,
        flat=flat.flat,
        slope_up=flat.slopes[0],
        slope_down=flat.slopes[1],
        curvature=curvature,
        low=bottom,
        high=top,
        flattenings=flat.flattenings,
        horizons=horizons,
        datum=Datum(plan.datum, means[0], means[1]),
        reach=plan.shell,
    )


def _profile(fitted: FittedSheet, foot: Foot) -> CrossSection:
    """Return the cross-section of the mid surface.

    It spans the places, before slip, of the blocks within one block of the mid surface.  If the
    layer tapers, it goes on from there to zero thickness, past the last block.
    """
    axes = fold_axes(fitted.sheet, foot.U)
    near = np.flatnonzero(np.abs(foot.t) < 1)
    near = near if len(near) else np.arange(len(foot.t))
    U = foot.U[near]
    U = U - foot.t[near, None] * fitted.sheet.grid.value(fitted.slip, U)
    stations = U @ axes.T
    span = np.empty((2, 2))
    for k, axis in enumerate(axes):
        for side, sign in enumerate((-1.0, 1.0)):
            x = sign * stations[:, k]
            end = float(x.max())
            half, hu, hv = fitted.sheet.grid.gradient(fitted.half, U[x > end - _TIP])
            taper = -sign * float(np.median(hu * axis[0] + hv * axis[1]))
            left = max(float(np.median(half)) - taper * _TIP / 2, 0.0)
            on = left / taper if left < 1 and taper > left / _FARTHEST else 0.5
            span[side, k] = sign * (end + max(on, 0.5))
    return CrossSection(axes, span)


def _reach(foot: Foot) -> float:
    """Return the least offset that holds every block."""
    return float(np.abs(foot.t[foot.miss < 0.5]).max()) + PAD


def build_control(
    fitted: FittedSheet,
    horizons: Horizons,
    points: Floats,
    blocks: Floats,
    plan: MeshPlan,
) -> SheetMesh:
    """Return the control mesh that holds the blocks, in both spaces (see SheetMesh).

    Prism edges are normals of the mid surface.  Surfaces parallel to it above and below are
    flattened on their own and registered rigidly to the flat mid surface.  This reproduces flexural
    slip with zero mean slip over the cross-section (the pin line).

    Parameters
    ----------
    fitted : FittedSheet
        Mid surface.
    horizons : Horizons
        Top and bottom, for the stratigraphic coordinate.
    points : (n, 3) float
        Points that the sheet was fitted to, working units.
    blocks : (b, 3) float
        Blocks as the user gave them; the mesh has to hold all of them.
    plan : MeshPlan
        Settings of the mesh.
    """
    foot = block_feet(fitted, points, reach=10.0 * fitted.unit)
    with within(0.1, 0.5):
        columns = _columns(fitted, horizons, foot, None, plan)
    reach = _reach(foot)

    def constant() -> tuple[Columns, Layers]:
        offsets = np.full((2, columns.count), reach)
        return columns, columns.layers(offsets, FRACTIONS)

    def capped(slope: float) -> tuple[Columns, Layers]:
        caps = _sloping_caps(columns, _FOCAL, slope)
        return columns, columns.layers(_offsets(columns, foot, caps), FRACTIONS)

    def refined() -> tuple[Columns, Layers]:
        cell = columns.prints.cell / 2
        finer = _columns(fitted, horizons, foot, cell, plan)
        caps = _sloping_caps(finer, _FOCAL_REFINED, _SLOPES[-1])
        return finer, finer.layers(_offsets(finer, foot, caps), FINE_FRACTIONS)

    rungs: list[tuple[str, Callable[[], tuple[Columns, Layers]]]]
    rungs = [("capped", partial(capped, slope)) for slope in _SLOPES]
    rungs.append(("refined", refined))
    if not (_room(columns, _FOCAL) < reach).any():
        rungs.insert(0, ("constant", constant))
    with within(0.5, 1.0):
        climbed = climb(rungs, blocks, plan.count)
    columns, laid = climbed.columns, climbed.laid
    heights = {"mid": np.zeros(columns.count), "top": columns.high, "bottom": columns.low}
    surfaces = {name: columns.surface(laid.layers, height) for name, height in heights.items()}
    control, shell = laid.control(), laid.shell_mesh()
    level = laid.over_mid()
    return SheetMesh(
        control=control,
        shell=shell,
        flattenings=columns.flattenings,
        layers=laid.layers,
        rungs=climbed.rungs,
        surfaces=surfaces,
        over_mid=(control, shell) if plan.datum == "mid" else (level.control(), level.shell_mesh()),
    )
