"""The control mesh: the same tetrahedra in the folded and in the unfolded space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import Floats, Ints, Space, TetMesh, in_space

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True, eq=False)
class ControlMesh:
    """Tetrahedra with folded and unfolded vertices, and the stratigraphic coordinate on them.

    Attributes
    ----------
    folded, unfolded : TetMesh
        The same tetrahedra; right-handed in both spaces if not inverted.  Unfolded z is
        the stratigraphic coordinate: up is the top (hanging-wall) side, true thickness.
    stratigraphic : (n,) float
        0 on the bottom surface, 1 on the top, linear between, per vertex.
    """

    folded: TetMesh
    unfolded: TetMesh
    stratigraphic: Floats

    def __repr__(self) -> str:
        """Return one line: vertices and tetrahedra."""
        return f"<ControlMesh of {len(self.folded.V)} vertices, {len(self.folded.T)} tetrahedra>"

    def to_pyvista(self, space: Space = "folded") -> pyvista.UnstructuredGrid:
        """Return the tetrahedra in one space for pyvista.

        Point data: ``stratigraphic``, and each vertex's place in the other space under its name.
        """
        here, there, other = in_space(space, self.folded, self.unfolded)
        grid = here.to_pyvista()
        grid.point_data[other] = there.V
        grid.point_data["stratigraphic"] = self.stratigraphic
        return grid

    @property
    def inverted_folded(self) -> int:
        """Number of tetrahedra whose folded volume is not positive."""
        return int(np.count_nonzero(tet_volumes(self.folded.V, self.folded.T) <= 0))

    @property
    def inverted_unfolded(self) -> int:
        """Number of tetrahedra whose unfolded volume is not positive."""
        return int(np.count_nonzero(tet_volumes(self.unfolded.V, self.unfolded.T) <= 0))


DATUMS = ("mid", "top", "bottom", "proportional")
"""Surface that is flat in the unfolded space; ``proportional``: both top and bottom."""


@dataclass(frozen=True)
class Datum:
    """Conversion of heights over the flat mid surface to unfolded z.

    ``top`` and ``bottom`` shear the flat space vertically, which keeps every volume and every
    thickness; ``proportional`` also scales thicknesses to their mean.

    Attributes
    ----------
    name : str
        One of DATUMS.
    bottom, top : float
        Mean height of bottom and top, at which the flat surfaces lie.

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


def side_by_side(
    parts: Sequence[tuple[ControlMesh, ControlMesh | None]], gap: float = 10.0, apart: bool = True
) -> tuple[ControlMesh, ControlMesh | None]:
    """Return several control meshes, with their shells, as one: side by side along unfolded x.

    Parameters
    ----------
    parts : sequence of (ControlMesh, ControlMesh or None)
        Control meshes with their shells. A shell's first vertices are the control mesh's.
    gap : float
        Distance between the meshes, in working units.
    apart : bool
        False if their flat places are those of one space, and are kept.
    """
    if len(parts) == 1:
        return parts[0]
    wholes = [control if shell is None else shell for control, shell in parts]
    inner = [len(control.folded.V) for control, _ in parts]
    extra = [len(whole.folded.V) - n for whole, n in zip(wholes, inner, strict=True)]
    starts = np.concatenate([[0], np.cumsum(inner)])
    further = starts[-1] + np.concatenate([[0], np.cumsum(extra)])
    edge, columns, tets, shells = 0.0, [], [], []
    for k, (control, shell) in enumerate(parts):
        whole, n = wholes[k], inner[k]
        V = whole.unfolded.V
        moved = V + np.array([edge - float(V[:, 0].min()), 0.0, 0.0]) if apart else V
        edge += float(np.ptp(V[:, 0])) + gap
        columns.append(np.column_stack([whole.folded.V, moved, whole.stratigraphic]))
        number = np.arange(len(V)) + np.where(np.arange(len(V)) < n, starts[k], further[k] - n)
        tets.append(number[control.folded.T])
        if shell is not None:
            shells.append(number[shell.folded.T])
    table = np.concatenate([c[:n] for c, n in zip(columns, inner, strict=True)])
    joined = _from_table(table, np.concatenate(tets))
    if not shells:
        return joined, None
    rest = [c[n:] for c, n in zip(columns, inner, strict=True)]
    return joined, _from_table(np.concatenate([table, *rest]), np.concatenate(shells))


def vertex_parts(parts: Sequence[tuple[ControlMesh, ControlMesh | None]]) -> Ints:
    """Return the number of the mesh that each vertex of `side_by_side` comes from, (n,)."""
    inner = [len(control.folded.V) for control, _ in parts]
    extra = [
        0 if shell is None else len(shell.folded.V) - n
        for (_, shell), n in zip(parts, inner, strict=True)
    ]
    number = np.arange(len(parts))
    return np.concatenate([np.repeat(number, inner), np.repeat(number, extra)])


def _from_table(table: Floats, T: Ints) -> ControlMesh:
    """Return a control mesh from rows of folded, unfolded and stratigraphic coordinates."""
    return ControlMesh(TetMesh(table[:, :3], T), TetMesh(table[:, 3:6], T), table[:, 6])


def scaled(control: ControlMesh, folded: Floats, factor: float) -> ControlMesh:
    """Return the control mesh over other folded vertices, its unfolded ones times a factor."""
    return ControlMesh(
        control.folded.with_vertices(folded),
        control.unfolded.with_vertices(control.unfolded.V * factor),
        control.stratigraphic,
    )
