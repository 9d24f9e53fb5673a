"""The block lattice behind a cloud of centroids: its axes and its step along each."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.mesh import Floats


@dataclass(frozen=True, eq=False)
class Lattice:
    """A regular lattice on which (nearly all) centroids lie.

    Attributes
    ----------
    axes : (3, 3) float
        Unit lattice directions as rows, a right-handed rotation of the world's axes.
    steps : (3,) float
        Block size along each axis, in the input's unit.
    share : float
        Share of the neighbour differences that are whole multiples of the steps.
    """

    axes: Floats
    steps: Floats
    share: float
