"""The shell around a control mesh, which carries points outside the body.

The prisms go on past the body, above, below and past the rim, up to the reach.  They end short of
the mid surface's focal distance, and of other limbs.  The shell has the same tetrahedra in both
spaces, so that a point carried by it comes back exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from geounfold.backends.igl import SurfaceIndex
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.geometry.prisms import prism_tets
from geounfold.methods.sheet.meshing.prism_layers import Layers, bounded_slope
from geounfold.methods.sheet.mid_surface.normal_equations import graph_laplacian, spd_solver

_LEAST = 0.2  # share of the reach below which a node gets no shell
_SHARE = 0.45  # share of the distance to another limb that a shell may use
_FOCAL = 0.95  # share of the focal distance that the shell may reach
_SLOPE = 0.6  # largest change of the shell's height along the sheet
_STEP = 1e-3  # blocks: distance from the border at which rays towards other limbs start


@dataclass(frozen=True, eq=False)
class Surround:
    """Prisms of the body and those around it, on one set of nodes, the body's first.

    Attributes
    ----------
    layers : Layers
        The body's prisms.
    whole : Layers
        The same nodes and those of the ring; the body's offsets are continued to the ring.
    ring : (k, 3) int
        Triangles of the ring around the footprint, nodes of ``whole``.
    up, down : (w,) float
        Height of the shell past the offsets, above and below each node of ``whole``.
    """

    layers: Layers
    whole: Layers
    ring: Ints
    up: Floats
    down: Floats

    @property
    def none(self) -> bool:
        """Whether the shell is empty."""
        return not (len(self.ring) or self.up.any() or self.down.any())

    @property
    def heights(self) -> list[Floats]:
        """Signed height of the shell's bottom, every layer and the shell's top, at every node."""
        inner = self.whole.heights
        return [inner[0] - self.down, *inner, inner[-1] + self.up]

    @property
    def vertices(self) -> tuple[Ints, Ints]:
        """Layer (in ``heights``) and node of every vertex, (v,) each; the body's vertices first."""
        n, count = len(self.layers.P), len(self.layers.fractions)
        body = np.divmod(np.arange(n * count), n)
        used = np.zeros(len(self.whole.P), dtype=bool)
        used[self.layers.F], used[self.ring] = True, True
        rest = np.tile(used, (count + 2, 1))
        rest[1:-1, :n] = False
        rest[0] &= self.down > 0
        rest[-1] &= self.up > 0
        layer, node = np.nonzero(rest)
        return np.concatenate([body[0] + 1, layer]), np.concatenate([body[1], node])

    def tets(self) -> Ints:
        """Return the shell's tetrahedra, right-handed if upright, as rows of ``vertices``."""
        w, count = len(self.whole.P), len(self.layers.fractions)
        layer, node = self.vertices
        number = np.full((count + 2, w), -1, dtype=np.int64)
        number[layer, node] = np.arange(len(layer))
        # If the shell has no height at a node, the vertex there is that of the layer below.
        number[0] = np.where(number[0] < 0, number[1], number[0])
        number[-1] = np.where(number[-1] < 0, number[-2], number[-1])
        slabs = []
        around = np.concatenate([self.layers.F, self.ring])
        for F, first, last in ((around, 0, 1), (self.ring, 1, count), (around, count, count + 1)):
            T = prism_tets(F, w, last - first + 1)
            slabs.append(number[first:].ravel()[T])
        T = np.concatenate(slabs)
        ordered = np.sort(T, axis=1)
        whole: Ints = T[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
        return whole


def surround(
    layers: Layers,
    P: Floats,
    normal: Floats,
    U: Floats,
    slip: Floats,
    curvature: Floats,
    ring: Ints,
    reach: float,
) -> Surround:
    """Return the prisms around the body, not yet checked.

    Parameters
    ----------
    layers : Layers
        The body's, over n nodes.
    P, normal : (n + r, 3) float
        Mid surface and its normals at the body's nodes and the ring's.
    U, slip : (n + r, 2) float
        Parameters there, and the fitted slip per height.  They predict the flat places; the body's
        departure from this prediction is continued harmonically to the ring.
    curvature : (2, n + r) float
        See Layers.
    ring : (k, 3) int
        Triangles of the ring.
    reach : float
        Largest height of the shell, in blocks.
    """
    n = len(layers.P)
    F = np.concatenate([layers.F, ring])
    known = np.column_stack(
        [
            layers.flat - U[:n],
            layers.slope_up + slip[:n],
            layers.slope_down - slip[:n],
            layers.up,
            layers.down,
        ]
    )
    fields = _continued(F, known, len(P))
    flat, slope_up, slope_down = fields[:, :2] + U, fields[:, 2:4] - slip, fields[:, 4:6] + slip
    whole = replace(
        layers,
        P=P,
        normal=normal,
        flat=flat,
        slope_up=slope_up,
        slope_down=slope_down,
        F=F,
        curvature=curvature,
        up=fields[:, 6],
        down=fields[:, 7],
    )
    room = _room(whole, layers.F, U, reach)
    return Surround(layers, whole, ring, room[0], room[1])


def _continued(F: Ints, known: Floats, count: int) -> Floats:
    """Return values at the first nodes, (n, d), continued harmonically to all, (count, d)."""
    n = len(known)
    if count == n:
        return known
    L = graph_laplacian(F, count).tocsr()
    pull = sp.csr_array(L[n:, :n])
    rest: Floats = spd_solver(sp.csc_array(L[n:, n:]))(-(pull @ known))
    return np.concatenate([known, rest])


def _room(whole: Layers, body: Ints, U: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return the largest height of the shell above and below each node, (w,): 0 up to the reach.

    The shell ends short of the focal distance and of the middle between two limbs, and its slope
    along the sheet is bounded.

    Parameters
    ----------
    whole : Layers
        Nodes of body and ring.
    body : (m, 3) int
        The footprint's triangles.
    U : (w, 2) float
        The nodes' parameters.
    reach : float
        Largest height of the shell, in blocks.
    """
    top, bottom = (whole.P + q[:, None] * whole.normal for q in (whole.up, -whole.down))
    n = len(whole.P)
    border = SurfaceIndex(np.concatenate([top, bottom]), np.concatenate([body, body + n]))
    found = []
    for V, side, offset, curvature in (
        (top, 1.0, whole.up, whole.curvature[0]),
        (bottom, -1.0, whole.down, whole.curvature[1]),
    ):
        out = side * whole.normal
        way = border.first_hit(V + _STEP * out, out)[1]
        room = np.minimum(_FOCAL / np.maximum(curvature, 1e-9) - offset, _SHARE * way)
        room = bounded_slope(np.clip(room, 0, reach), U, whole.F, _SLOPE)
        found.append(_shortened(room, reach))
    return found[0], found[1]


def _shortened(room: Floats, reach: float) -> Floats:
    """Return the heights, set to 0 if they are too small."""
    return np.where(room < _LEAST * reach, 0.0, room)


def less(around: Surround, touched: Bools) -> Surround:
    """Return the shell with halved height at some nodes (w,), 0 if little is left.

    Triangles of the ring at a node left without a shell above and below are removed.
    """
    reach = float(max(around.up.max(), around.down.max()))
    up, down = (np.where(touched, _shortened(q / 2, reach), q) for q in (around.up, around.down))
    bare = touched & (up == 0) & (down == 0)
    return replace(around, ring=around.ring[~bare[around.ring].any(axis=1)], up=up, down=down)
