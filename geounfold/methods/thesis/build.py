"""The thesis's control mesh: vertical pairs between two sheets laid flat at their mean heights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.errors import InputError, OptionError, SplitError
from geounfold.flattening import Flattening, flatten
from geounfold.geometry.mesh import Floats, TetMesh, TriMesh
from geounfold.geometry.prisms import prism_tets
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods.thesis.joint import JointPlan, PlanField, barycentric, joint_plan
from geounfold.methods.thesis.options import ThesisOptions
from geounfold.methods.thesis.surfaces import CURE, two_sides, upright_frame

GAP = 0.5  # working units: least vertical distance of top and bottom, which are moved apart to it
PAD = 0.5  # working units: height of the mesh above and below the outermost blocks

Flatten = Callable[[TriMesh, Floats | None], Flattening]
"""``flatten(mesh, start)``: a surface laid flat from a start, (n, 2)."""


def _by_springs(mesh: TriMesh, start: Floats | None) -> Flattening:
    return flatten(mesh, start=start, repair=False)


@dataclass(frozen=True, eq=False)
class ThesisMesh:
    """What the thesis's method made of a body, in working units.

    Attributes
    ----------
    control : ControlMesh
        Three layers of prisms, each cut into three tetrahedra, in both spaces: a pad below, the
        thesis's prisms, a pad above.
    top, bottom : TriMesh
        The two folded surfaces; both look up.
    top_flat, bottom_flat : Flattening
        The same laid flat; ``uv`` are rotated and shifted into the control mesh's coordinates.
    thickness : float
        Distance of the two flat sheets: the difference of the surfaces' mean heights.
    bottom_missed, top_missed : int
        Vertices of the bottom vertically under (over) no triangle of the top, and the reverse.
    extended : int
        Vertices of the joint triangulation where a surface was continued past its border.
    squeezed : int
        Vertices where top and bottom were moved apart to the least gap.
    hidden, pieces : float
        Share of a side that lay behind itself, and share that was torn off; the larger of both
        sides.
    steep : float
        Share of the hull, away from its rim, that the orientation filter missed or put on the wrong
        side.
    """

    control: ControlMesh
    top: TriMesh
    bottom: TriMesh
    top_flat: Flattening
    bottom_flat: Flattening
    thickness: float
    bottom_missed: int
    top_missed: int
    extended: int
    squeezed: int
    hidden: float
    pieces: float
    steep: float


def thesis_control(
    points: Floats,
    hull: TriMesh,
    up: Floats | None = None,
    options: ThesisOptions | None = None,
    inset: float = 0.0,
    flatten: Flatten = _by_springs,
) -> ThesisMesh:
    """Return the control mesh of the thesis (sections 3.2.2 to 3.2.4), and every part of it.

    The body is rotated to its principal axes.  Hull faces with normals up or down form the top and
    the bottom; each is flattened on its own by springs and laid flat at its mean height.  The
    vertices of each, projected vertically, are inserted into the other (Algorithm 1), so that both
    get one plane triangulation; heights and flat positions are interpolated linearly.  Aligned
    triangles make prisms, prisms three tetrahedra.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    hull : TriMesh
        Closed hull, faces outward; in the thesis an alpha shape through the outermost blocks.
    up : (3,) float, optional
        Direction towards the top; default the frame's third axis.  It chooses between the two
        directions of the principal axis across the body, along which the surfaces are paired.
    options : ThesisOptions, optional
        Axis of the pairing and rings to trim.
    inset : float
        How far the hull runs inside the blocks' outer faces (``Hull.inset``).  Only the
        stratigraphic coordinate uses it, so that 0 and 1 are the body's own faces.
    flatten : callable
        ``flatten(mesh, start)`` lays a side flat from a start; default springs, as in the thesis.

    Returns
    -------
    ThesisMesh
        Unfolded z is zero midway between the sheets and grows towards the top; never mirrored.
        ``stratigraphic`` is linear in unfolded z, in the pads too.

    Raises
    ------
    InputError
        Points of a wrong shape or not finite.
    OptionError
        ``up`` is no direction, or ``flatten`` refused its options.
    SplitError
        The body overhangs, is too steep for the filter, or has a top not over its bottom.
    NoSheetError
        The body has no two opposite surfaces.
    ControlMeshError
        A block lies outside the joint triangulation.

    Notes
    -----
    Defects of the thesis's method that are kept on purpose:

    * *Vertical pairing.*  A prism's edges are vertical, not normal to the layers.  So on slopes,
      layers that slipped over each other come out sheared.
    * *Flat at mean heights.*  The two sheets' distance is the difference of the surfaces' mean
      heights.  For parallel layers under a vertical outline, that is the average of their thickness
      over the cosine of the dip, so folded layers come out too thick.  A thickness that varies is
      lost: a lens comes out as a slab, stretched where it was thin.
    * *Orientation filter.*  Slopes steeper than 72 degrees (normal's z below 0.3) belong to
      neither surface; in the gap both are continued by planes.  A rim that leans by more than 17
      degrees counts as top or bottom.
    * *No overhang.*  A surface that overhangs itself is no height field and is refused.
    * *Independent flattening* of top and bottom, by edge springs alone.

    Defects not kept:

    * A rim rounded by the hull's remeshing counted as top and bottom: the outermost ring of
      faces is left out (``ThesisOptions.trim``).
    * Bottom vertices outside the top's triangulation snapped to its nearest vertex.  Both
      surfaces are continued past their borders instead: from the nearest point of the border,
      along the plane fitted to the 24 nearest vertices, in height and in flat position alike.
    * 18 to 23 % of the blocks lay outside the mesh.  Now it holds all of them: it has a ring of
      border vertices around the blocks, and a pad above and below that continues each prism
      linearly.
    * Neighbouring prisms cut along different diagonals (T1, T2, T3 in an arbitrary order of
      the vertices).  They are cut by vertex index, so that neighbours share them.
    * The two flat sheets had no defined relative position.  The bottom's is moved rigidly onto the
      top's by least squares over the vertical pairs (mean slip zero).
    * Alpha of the hull was found by trial; the body was rotated by theta sin(theta), where the
      computed axes are used here; the springs stopped at once or never.
    """
    chosen = options or ThesisOptions()
    P = _checked_points(points)
    turn = upright_frame(P, _checked_up(up), chosen.axis)
    blocks = P @ turn.T
    top, bottom, steep = two_sides(hull.with_vertices(hull.V @ turn.T), chosen.trim)
    flat_top, flat_bottom = (_flat(side.mesh, flatten) for side in (top, bottom))
    flat_top = _moved(flat_top, flat_top.uv, top.mesh.V[:, :2])
    above = _field(top.mesh, flat_top)
    under, paired = above.at(bottom.mesh.V[:, :2])
    thickness = top.height - bottom.height
    if not (paired.any() and thickness > 0):
        raise SplitError(f"the top does not lie over the bottom; {CURE}")
    flat_bottom = _moved(flat_bottom, flat_bottom.uv[paired], under[paired, 1:])
    below = _field(bottom.mesh, flat_bottom)
    plan = joint_plan(blocks[:, :2], above, below)
    prisms = _prisms(plan, above, below)
    return ThesisMesh(
        control=_control(plan, prisms, blocks, turn, thickness, inset),
        top=top.mesh.with_vertices(top.mesh.V @ turn),
        bottom=bottom.mesh.with_vertices(bottom.mesh.V @ turn),
        top_flat=flat_top,
        bottom_flat=flat_bottom,
        thickness=thickness,
        bottom_missed=int((~paired).sum()),
        top_missed=int((~below.at(top.mesh.V[:, :2])[1]).sum()),
        extended=prisms.extended,
        squeezed=prisms.squeezed,
        hidden=max(top.hidden, bottom.hidden),
        pieces=max(top.pieces, bottom.pieces),
        steep=steep,
    )


@dataclass(frozen=True, eq=False)
class _Prisms:
    """Height and flat position (n, 3) of top and bottom at the joint vertices."""

    top: Floats
    bottom: Floats
    extended: int
    squeezed: int

    def at(self, share: Floats) -> tuple[Floats, Floats]:
        """Return height (n,) and flat position (n, 2) at a share of the way up, (n,)."""
        out = self.bottom + share[:, None] * (self.top - self.bottom)
        return out[:, 0], out[:, 1:]


def _checked_points(points: Floats) -> Floats:
    P = np.asarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3 or not len(P) or not np.isfinite(P).all():
        raise InputError(f"points must be finite and of shape (n, 3), but have shape {P.shape}")
    return P


def _checked_up(up: Floats | None) -> Floats | None:
    if up is None:
        return None
    vector = np.asarray(up, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise OptionError(f"up must be three finite numbers, not all zero, but is {up}")
    return vector


def _flat(mesh: TriMesh, flatten: Flatten) -> Flattening:
    """Return one side laid flat, starting from its plan as in Wang's springs."""
    return flatten(mesh, mesh.V[:, :2] - mesh.V[:, :2].mean(axis=0))


def _moved(flat: Flattening, source: Floats, target: Floats) -> Flattening:
    """Return a flattening moved by the rigid motion that best fits source to target (k, 2)."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    p, q = source - a, target - b
    angle = np.angle(np.vdot(p[:, 0] + 1j * p[:, 1], q[:, 0] + 1j * q[:, 1]))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return replace(flat, uv=(flat.uv - a) @ turn + b)


def _field(mesh: TriMesh, flat: Flattening) -> PlanField:
    """Return height and flat position as functions of the position in plan."""
    return PlanField(mesh, np.column_stack([mesh.V[:, 2], flat.uv]))


def _prisms(plan: JointPlan, above: PlanField, below: PlanField) -> _Prisms:
    """Return both surfaces at the joint vertices, at least GAP apart."""
    (top, top_in), (bottom, bottom_in) = above.at(plan.xy), below.at(plan.xy)
    lack = np.maximum(GAP - (top[:, 0] - bottom[:, 0]), 0)
    top[:, 0] += lack / 2
    bottom[:, 0] -= lack / 2
    extended = int((~(top_in & bottom_in)).sum())
    return _Prisms(top, bottom, extended, int((lack > 0).sum()))


def _pads(plan: JointPlan, prisms: _Prisms, blocks: Floats) -> tuple[Floats, Floats]:
    """Return how far the mesh reaches below the bottom and above the top at each vertex, (n,)."""
    corners = plan.F[plan.block_face]
    share = barycentric(plan.xy[corners], blocks[:, :2])
    out = []
    for surface, outward in ((prisms.bottom, -1.0), (prisms.top, 1.0)):
        level = np.einsum("ij,ij->i", share, surface[corners, 0])
        reach = np.zeros(len(plan.xy))
        # Repeated, not broadcast: numpy 2.4's maximum.at reads past the end of the latter.
        np.maximum.at(reach, corners.ravel(), np.repeat(outward * (blocks[:, 2] - level), 3))
        out.append(reach + PAD)
    return out[0], out[1]


def _control(
    plan: JointPlan,
    prisms: _Prisms,
    blocks: Floats,
    turn: Floats,
    thickness: float,
    inset: float,
) -> ControlMesh:
    """Return the tetrahedra of the prisms and their pads in both spaces."""
    n = len(plan.xy)
    gap = prisms.top[:, 0] - prisms.bottom[:, 0]
    under, over = _pads(plan, prisms, blocks)
    folded, unfolded = [], []
    for share in (-under / gap, np.zeros(n), np.ones(n), 1 + over / gap):
        height, uv = prisms.at(share)
        folded.append(np.column_stack([plan.xy, height]))
        unfolded.append(np.column_stack([uv, (share - 0.5) * thickness]))
    V, W = np.concatenate(folded) @ turn, np.concatenate(unfolded)
    T = prism_tets(plan.F, n, len(folded))
    whole = thickness + 2 * inset
    return ControlMesh(TetMesh(V, T), TetMesh(W, T), W[:, 2] / whole + 0.5)
