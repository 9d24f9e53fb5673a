"""Flat places of blocks on slightly different mid surfaces, without a control mesh each.

The mid surface of the answer is laid flat once, over a coarse footprint.  Another mid surface over
the same parameters has slightly other edge lengths; the flat nodes move by least squares so that
the flat edges change alike.  That matrix is factored once for all members.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.measures import lengths, unique_edges
from geounfold.geometry.mesh import Floats, Ints, TriMesh
from geounfold.methods.sheet.meshing.build import block_feet, register
from geounfold.methods.sheet.meshing.footprint import Footprint, footprint, principal_direction
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.mid_surface.normal_equations import Solve, spd_solver
from geounfold.methods.sheet.mid_surface.pin_line import CrossSection, fold_axes
from geounfold.methods.sheet.mid_surface.surface import Foot
from geounfold.methods.sheet.sharpening.displace import follow_feet

CELL = 3.0
"""Side of the footprint's cells, in blocks: twice that of the control mesh."""

_STEPS = 3
"""Newton steps from the feet on the answer's mid surface to those on a member's."""

_LOOSE = 1e-6
"""Weight that keeps the nodes in place, for the rigid motions that no edge resists."""

_LOST = 0.1
"""Blocks by which a foot may miss its point; farther off, the member does not place the block."""


@dataclass(frozen=True, eq=False)
class FlatPlaces:
    """Where a mid surface and its slip place blocks in the flat space.

    Attributes
    ----------
    points : (n, 3) float
        Blocks, working units.
    foot : Foot
        Their feet on the answer's mid surface.
    prints : Footprint
        Coarse footprint of the feet.
    flat : (k, 2) float
        Its nodes, flat.
    edges : (e, 2) int
        Edges between nodes.
    weights : (n, k) sparse
        From values at nodes to values at the feet.
    profile : CrossSection
        The section over which the mean slip is zero.
    pull : sparse
        From changes of edge lengths to the right-hand side of the moves, (2 k, e).
    solve : callable
        From there to the moves.
    length : (e,) float
        Lengths of the edges on the answer's mid surface.
    """

    points: Floats
    foot: Foot
    prints: Footprint
    flat: Floats
    edges: Ints
    weights: sp.csr_array
    profile: CrossSection
    pull: sp.csr_array
    solve: Solve
    length: Floats

    @classmethod
    def of(
        cls,
        fitted: FittedSheet,
        points: Floats,
        flatten: Callable[[TriMesh, Floats | None], Floats],
    ) -> FlatPlaces:
        """Lay the answer's mid surface flat and prepare the moves of other ones.

        Parameters
        ----------
        fitted : FittedSheet
            The answer's mid surface.
        points : (n, 3) float
            Blocks, working units.
        flatten : callable
            ``flatten(mesh, start)`` returns a flattening, (n, 2).
        """
        sheet = fitted.sheet
        foot = block_feet(fitted, points, reach=10.0 * fitted.unit)
        cell = CELL * max(1.0, fitted.unit)
        prints = footprint(foot.U, principal_direction(sheet, foot.U), cell, 1)
        P = sheet.at(prints.U)
        flat = register(flatten(TriMesh(P, prints.F), prints.U), prints.U, prints.weight)
        E = unique_edges(prints.F)
        pull, solve = _moves(flat, E)
        axes = fold_axes(sheet, foot.U)
        stations = foot.U @ axes.T
        profile = CrossSection(axes, np.stack([stations.min(axis=0), stations.max(axis=0)]))
        weights = _bilinear(prints, foot.U)
        return cls(points, foot, prints, flat, E, weights, profile, pull, solve, lengths(P, E))

    def slope(self, fitted: FittedSheet) -> Floats:
        """Return the move per height at the nodes, (k, 2); its mean over the section is zero."""
        prints = self.prints
        slope = -fitted.sheet.grid.value(fitted.slip, prints.U)
        return slope - self.profile.mean(slope, prints.U, prints.weight, prints.cell)

    def place(self, fitted: FittedSheet) -> Floats:
        """Return the blocks' flat places, (n, 3), by a mid surface over the same parameters.

        Blocks without a foot are NaN.
        """
        sheet = fitted.sheet
        foot = follow_feet(sheet, self.points, self.foot.U, _STEPS)
        change = lengths(sheet.at(self.prints.U), self.edges) - self.length
        move = self.solve(self.pull @ change).reshape(-1, 2)
        mid = self.weights @ (self.flat + move) + (foot.U - self.foot.U)
        plan = mid + foot.t[:, None] * (self.weights @ self.slope(fitted))
        out: Floats = np.column_stack([plan, foot.t])
        out[foot.miss > _LOST] = np.nan
        return out


def _moves(flat: Floats, E: Ints) -> tuple[sp.csr_array, Solve]:
    """Return what turns changes of edge lengths into moves of flat nodes by least squares."""
    side = flat[E[:, 1]] - flat[E[:, 0]]
    size = np.linalg.norm(side, axis=1)
    toward = side / size[:, None]
    row = np.repeat(np.arange(len(E)), 4)
    column = np.stack([2 * E[:, 0], 2 * E[:, 0] + 1, 2 * E[:, 1], 2 * E[:, 1] + 1], axis=1)
    J = sp.csr_array(
        (np.concatenate([-toward, toward], axis=1).ravel(), (row, column.ravel())),
        shape=(len(E), 2 * len(flat)),
    )
    K = J.T @ J + _LOOSE * sp.eye_array(2 * len(flat))
    return sp.csr_array(J.T), spd_solver(sp.csc_array(K))


def _bilinear(prints: Footprint, U: Floats) -> sp.csr_array:
    """Return the matrix from values at a footprint's nodes to bilinear ones at its feet U."""
    width = prints.shape[1] + 1
    number = np.full((prints.shape[0] + 1) * width, -1)
    number[prints.node] = np.arange(len(prints.node))
    first = np.array(divmod(int(prints.node[0]), width), float)
    low = prints.U[0] @ prints.axes.T - prints.cell * first
    f = (U @ prints.axes.T - low) / prints.cell - prints.cell_of
    corner = prints.cell_of @ np.array([width, 1])
    columns = number[corner[:, None] + np.array([0, 1, width, width + 1])]
    a, b = f[:, :1], f[:, 1:]
    values = np.concatenate([(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b], axis=1)
    rows = np.repeat(np.arange(len(U)), 4)
    return sp.csr_array((values.ravel(), (rows, columns.ravel())), (len(U), len(prints.node)))
