"""Triangle and tetrahedral meshes: frozen, checked, never reordered."""

from __future__ import annotations

from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from geounfold.errors import MeshError, OptionError
from geounfold.extras import require

if TYPE_CHECKING:
    import pyvista

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Numbers = NDArray[np.int32]
Bools = NDArray[np.bool_]

Space = Literal["folded", "unfolded"]
"""The two spaces of the map."""

_T = TypeVar("_T")


def in_space(space: Space, folded: _T, unfolded: _T) -> tuple[_T, _T, Space]:
    """Return the object in a space, its counterpart in the other space, and the other's name.

    Raises
    ------
    OptionError
        The space is neither folded nor unfolded.
    """
    if space == "folded":
        return folded, unfolded, "unfolded"
    if space == "unfolded":
        return unfolded, folded, "folded"
    raise OptionError(f"space must be folded or unfolded, but is {space!r}")


def _checked(
    vertices: Floats, cells: Ints, corners: int, kind: str, dims: tuple[int, ...]
) -> tuple[Floats, Ints]:
    """Return read-only copies of a mesh's arrays, or raise MeshError with the fault."""
    V = np.array(vertices, dtype=np.float64, order="C")
    C = np.array(cells, dtype=np.int64, order="C")
    if V.ndim != 2 or V.shape[1] not in dims:
        allowed = " or ".join(f"(n, {d})" for d in dims)
        raise MeshError(f"vertices must have shape {allowed}, but have {V.shape}")
    if C.ndim != 2 or C.shape[1] != corners:
        raise MeshError(f"{kind} must have shape (m, {corners}), but have {C.shape}")
    if not np.isfinite(V).all():
        bad = int(np.flatnonzero(~np.isfinite(V).all(axis=1))[0])
        raise MeshError(f"vertex {bad} is not finite: {V[bad]}")
    if C.size and not 0 <= C.min() <= C.max() < len(V):
        raise MeshError(f"{kind} index {C.min()}..{C.max()}, but there are {len(V)} vertices")
    V.flags.writeable = False
    C.flags.writeable = False
    return V, C


@dataclass(frozen=True, eq=False)
class TriMesh:
    """A triangulated surface.

    Parameters
    ----------
    V : (n, 3) or (n, 2) float
        Vertices, in any length unit.
    F : (m, 3) int
        Faces, counter-clockwise seen from the side to which their normal points.

    Raises
    ------
    MeshError
        Wrong shapes, indices out of range, or vertices that are not finite.

    Examples
    --------
    >>> mesh = TriMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> len(mesh.V), len(mesh.F)
    (3, 1)
    """

    V: Floats
    F: Ints

    def __post_init__(self) -> None:
        V, F = _checked(self.V, self.F, 3, "faces", (2, 3))
        object.__setattr__(self, "V", V)
        object.__setattr__(self, "F", F)

    def __repr__(self) -> str:
        """Return one line: vertices and triangles."""
        return f"<TriMesh of {len(self.V)} vertices, {len(self.F)} triangles>"

    def with_vertices(self, vertices: Floats) -> TriMesh:
        """Return the same faces over other vertices, (n, 3) or (n, 2)."""
        return TriMesh(vertices, self.F)

    def to_pyvista(self) -> pyvista.PolyData:
        """Return the surface for pyvista; flat vertices (n, 2) at height 0."""
        pyvista = require("pyvista", "pyvista's meshes")

        V = np.zeros((len(self.V), 3))
        V[:, : self.V.shape[1]] = self.V
        return pyvista.PolyData.from_regular_faces(V, self.F.copy())

    def quartered(self) -> TriMesh:
        """Return the surface with every triangle cut in four at the middles of its edges.

        >>> len(TriMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).quartered().F)
        4
        """
        V, F = self.V, self.F
        ends = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        edges, back = np.unique(ends, axis=0, return_inverse=True)
        ab, bc, ca = back.reshape(3, -1) + len(V)
        a, b, c = F.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        quarters = np.concatenate([np.stack(part, axis=1) for part in parts])
        return TriMesh(np.concatenate([V, V[edges].mean(axis=1)]), quarters)

    def submesh(self, faces: Bools | Ints) -> tuple[TriMesh, Ints]:
        """Return the mesh of some faces without unused vertices, and its vertices' old indices."""
        old, F = np.unique(self.F[faces], return_inverse=True)
        return TriMesh(self.V[old], F.reshape(-1, 3)), old


@dataclass(frozen=True, eq=False)
class TetMesh:
    """A tetrahedral mesh.

    Parameters
    ----------
    V : (n, 3) float
        Vertices, in any length unit.
    T : (m, 4) int
        Tetrahedra; right-handed (positive volume) if not inverted.

    Raises
    ------
    MeshError
        Wrong shapes, indices out of range, or vertices that are not finite.
    """

    V: Floats
    T: Ints

    def __post_init__(self) -> None:
        V, T = _checked(self.V, self.T, 4, "tetrahedra", (3,))
        object.__setattr__(self, "V", V)
        object.__setattr__(self, "T", T)

    def __repr__(self) -> str:
        """Return one line: vertices and tetrahedra."""
        return f"<TetMesh of {len(self.V)} vertices, {len(self.T)} tetrahedra>"

    def with_vertices(self, vertices: Floats) -> TetMesh:
        """Return the same tetrahedra over other vertices, (n, 3)."""
        return TetMesh(vertices, self.T)

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """Return the tetrahedra for pyvista."""
        pyvista = require("pyvista", "pyvista's meshes")

        cells = np.column_stack([np.full(len(self.T), 4), self.T]).ravel()
        kinds = np.full(len(self.T), pyvista.CellType.TETRA)
        return pyvista.UnstructuredGrid(cells, kinds, self.V.copy())


def as_trimesh(mesh: Any) -> TriMesh:
    """Return a TriMesh from a TriMesh, a (V, F) pair, or pyvista's surface or cells.

    Polygons are cut into triangles; of cells the outer faces are taken.
    """
    if isinstance(mesh, TriMesh):
        return mesh
    if hasattr(mesh, "extract_surface"):
        surface = (mesh if hasattr(mesh, "regular_faces") else _skin(mesh)).triangulate()
        return TriMesh(np.asarray(surface.points, np.float64), surface.regular_faces)
    return TriMesh(*mesh)


def _skin(cells: Any) -> Any:
    """Return the outer faces of pyvista's cells; newer versions want the algorithm named."""
    named = "algorithm" in signature(cells.extract_surface).parameters
    return cells.extract_surface(algorithm=None) if named else cells.extract_surface()
