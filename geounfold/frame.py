"""The working frame: an invertible similarity between the data's coordinates and the solver's."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.lattice import Lattice
from geounfold.mesh import Floats


@dataclass(frozen=True, eq=False)
class Frame:
    """A similarity: ``work = (world - origin) @ rotation.T / scale``.

    In the working frame one unit is one block (the geometric mean of the block's sides, or
    the typical point spacing), the points' mean is near the origin and the axes are the
    lattice's, or the principal axes where there is no lattice; the third axis is the one
    across the body.

    Attributes
    ----------
    origin : (3,) float
        World coordinates of the frame's origin.
    rotation : (3, 3) float
        Proper rotation; rows are the frame's axes in world coordinates.
    scale : float
        Length of one working unit in the input's unit.
    steps : (3,) float or None
        Block sides along the frame's axes in working units (product 1), None without a lattice.
    """

    origin: Floats
    rotation: Floats
    scale: float
    steps: Floats | None

    def to_work(self, points: Floats) -> Floats:
        """Return world points (n, 3) in the working frame."""
        return (points - self.origin) @ self.rotation.T / self.scale

    def to_world(self, points: Floats) -> Floats:
        """Return working points (n, 3) in world coordinates."""
        return (points * self.scale) @ self.rotation + self.origin


def working_frame(points: Floats, lattice: Lattice | None) -> Frame:
    """Return the canonical working frame of a cloud (see Frame)."""
    raise NotImplementedError
