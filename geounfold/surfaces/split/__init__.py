"""Split a closed hull into top (hanging wall), bottom (footwall) and rim.

``signed`` labels the faces of each pair of opposite sides by the lowest eigenvector of a signed
graph Laplacian: neighbours pull towards the same sign, faces that face each other across the body
towards opposite signs.  It then takes one pair from a list of candidates, by the measure in
`geounfold.surfaces.split.pairs`.  It uses no vertical, so it holds on overturned folds.
``normal`` is the thesis's filter on the normals' vertical component (section 3.2.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints, TriMesh, as_trimesh
from geounfold.surfaces.split.faces import (
    SAME_WAY,
    Faces,
    measure_faces,
    met_nearby,
    ridges,
    unmet_faces,
)
from geounfold.surfaces.split.is_sheet import check_sheet
from geounfold.surfaces.split.pairs import continued_sides, flanks, sheet_pair, signs
from geounfold.surfaces.split.result import SurfaceSplit
from geounfold.surfaces.split.signed_graph import signed_laplacian

NORMAL_THRESHOLD = 0.3
"""Component of a normal along up above which the method ``normal`` calls a face top.

Section 3.2.2 of the thesis.  Measured: half moves 18 % of the area to other labels, twice 42 %.
"""

DECISIVE = 0.05
"""Mean cosine of the top's normals along an axis from which that axis decides which side is top.

Of 106 hulls, half turns two over and twice one, their labels otherwise equal.
"""


def split(
    mesh: TriMesh,
    method: str = "signed",
    up: Floats | None = None,
    walls: Bools | None = None,
) -> SurfaceSplit:
    """Split a closed hull into top, bottom and rim.

    Parameters
    ----------
    mesh : TriMesh
        A closed, outward, manifold hull in working units, or its (V, F).
    method : str
        A name in SPLITS: ``signed`` or ``normal``.
    up : (3,) float, optional
        Direction towards the top, in working coordinates.  Decides once for the whole sheet:
        the top is the side whose area-weighted normals look along it.  Default: the frame's
        third axis.
    walls : (m,) bool, optional
        Faces at known faults, which are rim and on neither side.

    Returns
    -------
    SurfaceSplit

    Raises
    ------
    OptionError
        Unknown method, or ``up`` is no direction.
    NoSheetError
        The body has no two opposite surfaces.
    SplitError
        The mesh is not closed, or the eigenproblem failed.

    Notes
    -----
    If the mean cosine between ``up`` and the top's normals is below 0.05 (a vertical sheet),
    the frame's third, second and first axis decide, the first of them that can.  If none can,
    the larger side is the top.
    """
    if method not in SPLITS:
        raise OptionError(f"unknown split '{method}'; valid: {', '.join(SPLITS)}")
    mesh = as_trimesh(mesh)
    if walls is None or method != "signed":
        result = SPLITS[method](mesh, _direction(up))
    else:
        result = split_signed(mesh, _direction(up), walls)
    if walls is not None:
        result = replace(result, rim=result.rim | walls)
    check_sheet(result)
    return result


def split_signed(
    mesh: TriMesh, up: Floats | None = None, walls: Bools | None = None
) -> SurfaceSplit:
    """Split by the lowest eigenvector of the signed Laplacian of the face graph.

    Neighbours i, j pull to the same sign with weight ``exp((N_i.N_j - 1) / 0.05) + 0.001``
    over a ridge and 1.001 over a valley, a face and the one its inward ray meets to opposite
    signs with weight ``max(0, -N_i.N_j)^2 exp(-d / median d)``.

    A body has several pairs of opposite sides, which ridges part: top and bottom, flanks, ends.
    A valley parts nothing: it is the inside of a tight hinge.  Each candidate pair gets its own
    eigenvector, because that of the whole hull may be the flanks' or one limb's.  The pair of
    the largest measure is taken (see `geounfold.surfaces.split.pairs`).  Its signs are continued
    to the other faces by ``L x = 0``.

    Parameters and errors as in `split`; ``side`` is +1 or -1 on every face, ``candidates`` holds
    the pairs that were judged.
    """
    faces = measure_faces(mesh)
    L = signed_laplacian(faces)
    pair, candidates = sheet_pair(faces, L, walls)
    side = signs(continued_sides(L, pair))
    faces = replace(faces, median=pair.thickness, other=flanks(faces, pair, side))
    result = _result(mesh, faces, side, up)
    return replace(result, candidates=candidates)


def split_normal(mesh: TriMesh, up: Floats | None = None) -> SurfaceSplit:
    """Split by the normals' component along up, as the thesis does (section 3.2.2).

    Faces whose component exceeds 0.3 are top, below -0.3 bottom, the others (``side`` 0) rim.
    Overturned limbs are labelled wrongly; kept for comparison.

    Parameters and errors as in `split`; ``up`` defaults to the frame's third axis.
    """
    faces = measure_faces(mesh)
    along = faces.normal @ (_AXES[2] if up is None else up)
    side = np.where(along > NORMAL_THRESHOLD, 1, 0) - np.where(along < -NORMAL_THRESHOLD, 1, 0)
    result = _result(mesh, faces, side, up)
    return replace(result, side=side, flipped_up=False)


SPLITS: dict[str, Callable[[TriMesh, Floats | None], SurfaceSplit]] = {
    "signed": split_signed,
    "normal": split_normal,
}


_AXES = np.eye(3)


def _direction(up: Floats | None) -> Floats | None:
    if up is None:
        return None
    vector = np.asarray(up, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise OptionError(f"up must be three finite numbers, not all zero, but is {up}")
    out: Floats = vector / np.linalg.norm(vector)
    return out


def _result(mesh: TriMesh, faces: Faces, side: Ints, up: Floats | None) -> SurfaceSplit:
    """Return the split with its rim, turned so that the top looks up."""
    near = faces.adjacency
    rim = (side == 0) | faces.other | (side[near] != side[:, None]).any(axis=1)
    rim |= ridges(faces, faces.normal, SAME_WAY).any(axis=1)
    faces = met_nearby(mesh, faces, np.where(rim, 0, side))
    rim |= unmet_faces(faces, side)
    default = _orientation(faces, np.where(rim, 0, side), None)
    turn = default if up is None else _orientation(faces, np.where(rim, 0, side), up)
    return SurfaceSplit(
        mesh=mesh,
        side=side * turn,
        rim=rim,
        opposite=faces.hit,
        thickness=faces.distance,
        median_thickness=faces.median,
        adjacency=faces.adjacency,
        flipped_up=turn != default,
        beyond=faces.other,
    )


def _orientation(faces: Faces, side: Ints, up: Floats | None) -> int:
    """Return +1 if side +1 is the top already, else -1 (see `split` for the rule)."""
    weight = faces.area * side
    covered = faces.area[side != 0].sum()
    for axis in [*([] if up is None else [up]), _AXES[2], _AXES[1], _AXES[0]]:
        looks = float(weight @ (faces.normal @ axis))
        if abs(looks) > DECISIVE * covered:
            return 1 if looks > 0 else -1
    return 1 if weight.sum() >= 0 else -1
