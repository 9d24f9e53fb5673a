"""The columns of a control mesh: everything except its heights above and below."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.flattening._result import Flattening
from geounfold.geometry.mesh import Floats, Ints, TetMesh, TriMesh
from geounfold.mapping.control_mesh import ControlMesh, Datum
from geounfold.methods.sheet.meshing.footprint import Footprint
from geounfold.methods.sheet.meshing.prism_layers import Layers
from geounfold.methods.sheet.meshing.shell import Surround, surround
from geounfold.methods.sheet.meshing.top_and_bottom import Horizons

_BARE = 0.15  # blocks: height past top and bottom if there is no room for more


@dataclass(frozen=True, eq=False)
class Laid:
    """Prisms in both spaces, with the shell around them.

    Attributes
    ----------
    layers : Layers
        The body's prisms.
    folded, unfolded : (v, 3) float
        Vertices in both spaces, the body's first.
    stratigraphic : (v,) float
        Stratigraphic coordinate of each vertex.
    node : (v,) int
        Node of each vertex.
    T, shell : (m, 4), (s, 4) int
        Tetrahedra of the body and of the shell.
    inner : int
        Number of the body's vertices.
    """

    layers: Layers
    folded: Floats
    unfolded: Floats
    stratigraphic: Floats
    height: Floats
    node: Ints
    T: Ints
    shell: Ints
    inner: int

    @property
    def all_tets(self) -> Ints:
        """Tetrahedra of the body, then of the shell."""
        return np.concatenate([self.T, self.shell])

    def without_shell(self) -> Laid:
        """Return the body's prisms alone."""
        n = self.inner
        return replace(
            self,
            folded=self.folded[:n],
            unfolded=self.unfolded[:n],
            stratigraphic=self.stratigraphic[:n],
            height=self.height[:n],
            node=self.node[:n],
            shell=np.empty((0, 4), np.int64),
        )

    def taking_in(self, rows: Ints) -> Laid:
        """Return the prisms with some of the shell's tetrahedra added to the body's."""
        moved = np.zeros(len(self.shell), dtype=bool)
        moved[rows] = True
        used = np.unique(self.shell[moved])
        first = np.zeros(len(self.folded), dtype=bool)
        first[: self.inner], first[used] = True, True
        order = np.argsort(~first, kind="stable")
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        return replace(
            self,
            folded=self.folded[order],
            unfolded=self.unfolded[order],
            stratigraphic=self.stratigraphic[order],
            height=self.height[order],
            node=self.node[order],
            T=np.concatenate([self.T, number[self.shell[moved]]]),
            shell=number[self.shell[~moved]],
            inner=int(first.sum()),
        )

    def control(self) -> ControlMesh:
        """Return the control mesh of the body."""
        n = self.inner
        return ControlMesh(
            TetMesh(self.folded[:n], self.T),
            TetMesh(self.unfolded[:n], self.T),
            self.stratigraphic[:n],
        )

    def over_mid(self) -> Laid:
        """Return the same with the mid surface flat, whatever the datum."""
        flat = np.column_stack([self.unfolded[:, :2], self.height])
        return replace(self, unfolded=flat)

    def shell_mesh(self) -> ControlMesh | None:
        """Return the shell, over all vertices; None if it is empty."""
        if not len(self.shell):
            return None
        return ControlMesh(
            TetMesh(self.folded, self.shell),
            TetMesh(self.unfolded, self.shell),
            self.stratigraphic,
        )


@dataclass(frozen=True, eq=False)
class Columns:
    """Nodes of a control mesh with their normals, flat places and slip.

    Attributes
    ----------
    prints : Footprint
        The footprint with n nodes; the ring around it has r more.
    P, normal : (n + r, 3) float
        Mid surface and its unit normals at the nodes.
    slip : (n + r, 2) float
        Fitted slip per height.
    flat, slope_up, slope_down : (n, 2) float
        See Layers.
    curvature : (2, n + r) float
        See Layers.
    low, high : (n,) float
        Heights at which the nodes' normals meet bottom and top.
    flattenings : dict of Flattening
        Flattenings of the mid surface and its parallel surfaces.
    horizons : Horizons
        Top and bottom, for the stratigraphic coordinate.
    datum : Datum
        Which surface is flat.
    reach : float
        Distance, in blocks, to which the shell should reach past the body.
    """

    prints: Footprint
    P: Floats
    normal: Floats
    slip: Floats
    flat: Floats
    slope_up: Floats
    slope_down: Floats
    curvature: Floats
    low: Floats
    high: Floats
    flattenings: dict[str, Flattening]
    horizons: Horizons
    datum: Datum
    reach: float

    @property
    def count(self) -> int:
        """Number of the footprint's nodes, n."""
        return len(self.prints.U)

    @property
    def U(self) -> Floats:
        """Parameters of all nodes, (n + r, 2)."""
        return np.concatenate([self.prints.U, self.prints.ring.U])

    def layers(self, offsets: Floats, fractions: tuple[float, ...]) -> Layers:
        """Return the body's prisms with offsets (2, n) above and below."""
        n = self.count
        return Layers(
            self.P[:n],
            self.normal[:n],
            self.flat,
            self.slope_up,
            self.slope_down,
            self.prints.F,
            self.curvature[:, :n],
            offsets[0],
            offsets[1],
            fractions,
        )

    def bare(self, layers: Layers) -> Layers:
        """Return prisms that reach only `_BARE` past top and bottom."""
        up, down = self.high + _BARE, -self.low + _BARE
        return replace(layers, up=np.maximum(up, _BARE), down=np.maximum(down, _BARE))

    def narrowed(self, nodes: Ints) -> Columns:
        """Return the columns without the empty ones at some nodes."""
        return replace(self, prints=self.prints.without(nodes))

    def surround(self, layers: Layers) -> Surround:
        """Return the body's prisms with those around it."""
        return surround(
            layers,
            self.P,
            self.normal,
            self.U,
            self.slip,
            self.curvature,
            self.prints.ring.F,
            self.reach,
        )

    def lay_out(self, around: Surround, body: tuple[Floats, Floats] | None = None) -> Laid:
        """Return the prisms and their shell in both spaces.

        Parameters
        ----------
        around : Surround
            The prisms.
        body : (folded, unfolded), optional
            Places of the body's vertices, (v, 3) each, if they were moved.
        """
        layer, node = around.vertices
        height = np.stack(around.heights)[layer, node]
        whole = around.whole
        folded = whole.P[node] + height[:, None] * whole.normal[node]
        unfolded, stratigraphic = self._unfolded(whole, height, node)
        n, count = len(around.layers.P), len(around.layers.fractions)
        if body is not None:
            folded[: n * count], unfolded[: n * count] = body
        return Laid(
            around.layers,
            folded,
            unfolded,
            stratigraphic,
            height,
            node,
            around.layers.tets(),
            around.tets(),
            n * count,
        )

    def _unfolded(self, whole: Layers, height: Floats, node: Ints) -> tuple[Floats, Floats]:
        """Return unfolded places (v, 3) and stratigraphic coordinates at heights over nodes."""
        low, high = self.horizons.heights(self.U[node] - height[:, None] * self.slip[node])
        slope = np.where(height[:, None] >= 0, whole.slope_up[node], whole.slope_down[node])
        plane = whole.flat[node] + np.abs(height)[:, None] * slope
        z = self.datum.z(height, low, high)
        return np.column_stack([plane, z]), (height - low) / (high - low)

    def surface(self, layers: Layers, height: Floats) -> tuple[TriMesh, TriMesh]:
        """Return the surface at a height over every node of the footprint, in both spaces."""
        folded = layers.P + height[:, None] * layers.normal
        unfolded = self._unfolded(layers, height, np.arange(self.count))[0]
        return TriMesh(folded, layers.F), TriMesh(unfolded, layers.F)
