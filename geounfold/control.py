"""The control mesh: the same tetrahedra in the folded and in the unfolded space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry import tet_volumes
from geounfold.mesh import Floats, TetMesh


@dataclass(frozen=True, eq=False)
class ControlMesh:
    """Tetrahedra with folded and unfolded vertices, and the stratigraphic coordinate on them.

    Attributes
    ----------
    folded, unfolded : TetMesh
        The same tetrahedra; right-handed in both spaces where not inverted.  Unfolded z is
        the stratigraphic coordinate: up is the top (hanging-wall) side, true thickness.
    stratigraphic : (n,) float
        0 on the bottom surface, 1 on the top, linear between, per vertex.
    """

    folded: TetMesh
    unfolded: TetMesh
    stratigraphic: Floats

    @property
    def inverted_folded(self) -> int:
        """Number of tetrahedra whose folded volume is not positive."""
        return int(np.count_nonzero(tet_volumes(self.folded.V, self.folded.T) <= 0))

    @property
    def inverted_unfolded(self) -> int:
        """Number of tetrahedra whose unfolded volume is not positive."""
        return int(np.count_nonzero(tet_volumes(self.unfolded.V, self.unfolded.T) <= 0))
