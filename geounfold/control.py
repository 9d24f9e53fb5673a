"""The control mesh: the same tetrahedra in the folded and in the unfolded space."""

from __future__ import annotations

from dataclasses import dataclass, replace

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


def with_datum(
    control: ControlMesh, bottom: Floats, top: Floats, weight: Floats, datum: str
) -> ControlMesh:
    """Return the control mesh with another surface flat.

    Heights are sheared along the prisms, so ``top`` and ``bottom`` keep every volume and every
    thickness; ``proportional`` also scales them to the mean thickness.

    Parameters
    ----------
    control : ControlMesh
        With the mid surface flat; vertices in layers of n.
    bottom, top : (n,) float
        Height of the bottom and of the top at the vertices of a layer.
    weight : (n,) float
        Weights of the means.
    datum : str
        One of DATUMS.

    Raises
    ------
    OptionError
        An unknown datum.
    """
    if datum not in DATUMS:
        raise OptionError(f"unknown datum {datum!r}; valid: {', '.join(DATUMS)}")
    if datum == "mid":
        return control
    V = np.array(control.unfolded.V)
    if datum == "proportional":
        thickness = float(np.average(top - bottom, weights=weight))
        V[:, 2] = (control.stratigraphic - 0.5) * thickness
    else:
        surface = top if datum == "top" else bottom
        shift = np.average(surface, weights=weight) - surface
        V[:, 2] += np.tile(shift, len(V) // len(shift))
    return replace(control, unfolded=control.unfolded.with_vertices(V))


def scaled(control: ControlMesh, folded: Floats, factor: float) -> ControlMesh:
    """Return the control mesh over other folded vertices, its unfolded ones times a factor."""
    return ControlMesh(
        control.folded.with_vertices(folded),
        control.unfolded.with_vertices(control.unfolded.V * factor),
        control.stratigraphic,
    )
