"""Changes of lengths, areas, volumes and layers by a control mesh.

Ratios are unfolded over folded, so that 1 is no change.  Signs are kept: a volume ratio is negative
if an element is turned inside out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.threads import over_slices
from geounfold.errors import ControlMeshError
from geounfold.geometry.measures import lengths, sorted_distinct
from geounfold.geometry.mesh import Floats, Ints, TetMesh
from geounfold.mapping.control_mesh import ControlMesh

_SLICE = 1 << 12  # tetrahedra at a time


def deformation_gradients(control: ControlMesh, elements: Ints | None = None) -> Floats:
    """Return the deformation gradient of each tetrahedron, folded to unfolded.

    Parameters
    ----------
    control : ControlMesh
        The tetrahedra in both spaces.
    elements : (m,) int, optional
        Indices of tetrahedra; the default is all.

    Returns
    -------
    (m, 3, 3) float
        J such that an edge e of the folded tetrahedron is J e when unfolded; dimensionless.
        det J is negative if exactly one of the two is inverted.

    Raises
    ------
    ControlMeshError
        A folded tetrahedron has no volume.
    """
    T = control.folded.T if elements is None else control.folded.T[elements]
    before, after = _edge_matrices(control.folded.V, T), _edge_matrices(control.unfolded.V, T)
    flat = np.linalg.det(before) == 0
    if flat.any():
        raise ControlMeshError(f"{np.count_nonzero(flat)} folded tetrahedra have no volume")
    # J before = after, with edges as columns; solved transposed, edges as rows.
    return np.asarray(np.linalg.solve(before, after).swapaxes(1, 2), dtype=np.float64)


def _edge_matrices(V: Floats, T: Ints) -> Floats:
    """Edges from the first to the other three vertices, as rows, (m, 3, 3)."""
    out: Floats = V[T[:, 1:]] - V[T[:, :1]]
    return out


@dataclass(frozen=True, eq=False)
class Distortion:
    """Changes of volumes, lengths and layers by deformation gradients J, (m,) each.

    Attributes
    ----------
    volume_ratio : (m,) float
        det J: unfolded over folded volume; negative if turned inside out.
    stretch_min, stretch_max : (m,) float
        Smallest and largest singular value of J: principal stretches.
    shear : (m,) float
        Layer-parallel shear: tangent of the angle by which the layers' folded normal is tilted
        when unfolded.  With g = J^T e_z (the gradient, in folded space, of unfolded z) and the
        folded normal n = g / |g|: ``|(J n)_xy| / (J n)_z``.  In flexural slip it is the change
        of the layer's heading since the pin line, in radians.
    thickness_ratio : (m,) float
        (J n)_z = |g|: unfolded over folded thickness, across the layers.
    area_ratio : (m,) float
        det J / |g|: unfolded over folded area, in the layers.
    """

    volume_ratio: Floats
    stretch_min: Floats
    stretch_max: Floats
    shear: Floats
    thickness_ratio: Floats
    area_ratio: Floats


def distortion(J: Floats) -> Distortion:
    """Return the distortion of deformation gradients (m, 3, 3).

    Raises
    ------
    ControlMeshError
        A gradient leaves no thickness: unfolded z is constant in the element.

    Examples
    --------
    >>> slip = distortion(np.array([[[1.0, 0, 0.5], [0, 1, 0], [0, 0, 1]]]))
    >>> float(slip.volume_ratio[0]), float(slip.shear[0]), float(slip.thickness_ratio[0])
    (1.0, 0.5, 1.0)
    """
    J = np.asarray(J, dtype=np.float64)
    stretch = np.empty((len(J), 3))

    def work(rows: slice) -> None:
        stretch[rows] = np.linalg.svd(J[rows], compute_uv=False)

    over_slices(work, len(J), _SLICE)
    volume = np.linalg.det(J)
    gradient = J[:, 2, :]  # J^T e_z
    thickness: Floats = np.linalg.norm(gradient, axis=1)
    if not thickness.all():
        flat = np.count_nonzero(thickness == 0)
        raise ControlMeshError(f"{flat} tetrahedra have no thickness when unfolded")
    image = np.einsum("mij,mj->mi", J, gradient / thickness[:, None])
    return Distortion(
        volume_ratio=volume,
        stretch_min=stretch[:, 2],
        stretch_max=stretch[:, 0],
        shear=np.hypot(image[:, 0], image[:, 1]) / thickness,
        thickness_ratio=thickness,
        area_ratio=volume / thickness,
    )


def tet_edges(T: Ints) -> Ints:
    """Return the undirected edges of tetrahedra, (k, 2), lower index first, sorted.

    >>> len(tet_edges(np.array([[0, 1, 2, 3]])))
    6
    """
    corners = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    E = np.sort(np.concatenate([T[:, list(pair)] for pair in corners]), axis=1)
    key = sorted_distinct(E[:, 0] * (int(T.max(initial=0)) + 1) + E[:, 1])
    return np.stack(np.divmod(key, int(T.max(initial=0)) + 1), axis=1)


def edge_change(folded: TetMesh, unfolded: TetMesh) -> Floats:
    """Return the relative change of length of each edge, (k,); positive if it grew.

    Raises
    ------
    ControlMeshError
        An edge of the folded mesh has no length.
    """
    E = tet_edges(folded.T)
    before = lengths(folded.V, E)
    if not before.all():
        raise ControlMeshError(f"{np.count_nonzero(before == 0)} folded edges have no length")
    return lengths(unfolded.V, E) / before - 1
