"""Result of every hull method."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.geometry.mesh import Floats, TriMesh

UNEQUAL = 1.2
"""Ratio of block sides from which the density is blurred per axis."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A closed, outward-oriented, manifold surface around the blocks, in working units.

    Attributes
    ----------
    mesh : TriMesh
        One component of the body's genus; edges of about 1.5 working units.
    method : str
        The method that made it: alpha, ball_pivoting, poisson or density.
    volume : float
        Enclosed volume, working units cubed (a block has volume 1 on a lattice).
    blocks_volume : float
        Volume of the blocks: their count, as one block is one cubic working unit.
    inset : float
        Depth of the surface below the blocks' outer faces, in working units: 0.5 if it passes
        through the outermost centroids, 0 if it encloses the blocks, negative outside of them.
    blur : float
        Standard deviation (working units per unit of block side) of the Gaussian blur of the
        surface; its curvature bias is corrected later.  0 if there was none.
    dropped : int
        Faces of cavities and specks that were left out.
    even : bool
        True if the blur was as wide along every axis, ``blur`` in working units, though the
        blocks' sides differ.
    reason : str
        Reason for the method if the choice was automatic; else empty.
    strays : float
        Share of the blocks that lie more than a block outside the blurred density's surface, if
        the automatic choice passed that over because of them; else 0.
    """

    mesh: TriMesh
    method: str
    volume: float
    blocks_volume: float
    inset: float
    blur: float
    dropped: int = 0
    even: bool = False
    reason: str = ""
    strays: float = 0.0

    def __repr__(self) -> str:
        """Return one line: the method, faces, and both volumes in blocks."""
        return (
            f"<Hull by {self.method} of {len(self.mesh.F)} faces: volume {self.volume:.6g} for "
            f"{self.blocks_volume:.6g} blocks>"
        )

    def scaled(self, factor: float) -> Hull:
        """Return the hull in another unit: lengths times a factor."""
        return replace(
            self,
            mesh=self.mesh.with_vertices(self.mesh.V * factor),
            volume=self.volume * factor**3,
            blocks_volume=self.blocks_volume * factor**3,
            inset=self.inset * factor,
            blur=self.blur * factor,
        )

    def blur_variance(self, steps: Floats | None) -> Floats:
        """Return the blur's variance along each working axis, (3,).

        Parameters
        ----------
        steps : (3,) float or None
            Block sides in working units, as given to the hull.
        """
        alike = self.even or steps is None or steps.max() / steps.min() <= UNEQUAL
        sides = np.ones(3) if alike or steps is None else steps
        out: Floats = self.blur**2 * sides * sides
        return out
