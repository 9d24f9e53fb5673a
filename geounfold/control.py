"""The control mesh: the same tetrahedra in the folded and in the unfolded space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import OptionError
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


DATUMS = ("mid", "top", "bottom", "proportional")
"""Which surface is flat in the unfolded space; ``proportional``: top and bottom both."""


@dataclass(frozen=True)
class Datum:
    """How heights over the flat mid surface become unfolded z.

    ``top`` and ``bottom`` shear the flat space vertically, so that every volume and every
    thickness stays; ``proportional`` also scales thicknesses to their mean.

    Attributes
    ----------
    name : str
        One of DATUMS.
    bottom, top : float
        Mean height of bottom and top, which the flat ones come to lie at.

    Raises
    ------
    OptionError
        An unknown datum.
    """

    name: str
    bottom: float
    top: float

    def __post_init__(self) -> None:
        if self.name not in DATUMS:
            raise OptionError(f"unknown datum {self.name!r}; valid: {', '.join(DATUMS)}")

    def z(self, height: Floats, bottom: Floats, top: Floats) -> Floats:
        """Return z (n,) of points at heights over places with these bottoms and tops."""
        if self.name == "top":
            return height - top + self.top
        if self.name == "bottom":
            return height - bottom + self.bottom
        if self.name == "proportional":
            return ((height - bottom) / (top - bottom) - 0.5) * (self.top - self.bottom)
        return height


def scaled(control: ControlMesh, folded: Floats, factor: float) -> ControlMesh:
    """Return the control mesh over other folded vertices, its unfolded ones times a factor."""
    return ControlMesh(
        control.folded.with_vertices(folded),
        control.unfolded.with_vertices(control.unfolded.V * factor),
        control.stratigraphic,
    )
