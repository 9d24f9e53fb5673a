"""Tents: single tetrahedra over the border of a mesh, for blocks that lie just outside it.

At an inner hinge a block may lie beyond the line on which the sheet's normals cross, so that no
prism can reach it.  A tent is a tetrahedron on the nearest face of the border, with the block just
below its tip.  The tip is carried by the affine map of the element behind that face, so the map is
continued and has an exact inverse.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geounfold.backends.igl import SurfaceIndex, barycentric_in_tets
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.mapping.certificate import Gluing, examine
from geounfold.methods.sheet.meshing.prism_columns import Laid

_TIP = 0.05  # blocks: height of a tent's tip above its block
_MOST = 2000  # largest number of tents tried at once
_ROUNDS = 6


def with_tents(laid: Laid, points: Floats) -> tuple[Laid, Ints]:
    """Return proved prisms with tents over points outside them, and the points left out.

    Parameters
    ----------
    laid : Laid
        Prisms that are proved.
    points : (k, 3) float
        Points that neither the prisms nor their shell hold.

    Returns
    -------
    Laid
        The prisms with tents, proved too; tents are part of the shell.
    (j,) int
        Rows of the points without one.
    """
    left = np.arange(len(points))
    for _ in range(_ROUNDS):
        if not len(left) or len(left) > _MOST:
            break
        more, kept = _raised(laid, points[left])
        if not kept.any():
            break
        laid, left = more, left[~kept]
    return laid, left


def _raised(laid: Laid, points: Floats) -> tuple[Laid, Bools]:
    """Return the prisms with tents, and which points have one: as many as leave them proved.

    If several points lie over one face, the farthest gets the tent; the others may lie inside it.
    """
    T = laid.all_tets
    gluing = Gluing.of(T)
    distance, face, foot = SurfaceIndex(laid.folded, gluing.F).closest(points)
    order = np.lexsort((-distance, face))
    first = np.ones(len(order), dtype=bool)
    first[1:] = face[order][1:] != face[order][:-1]
    chosen = order[first]
    kept = np.zeros(len(points), dtype=bool)
    while len(chosen):
        away = points[chosen] - foot[chosen]
        length = np.maximum(distance[chosen], 1e-12)[:, None]
        tips = points[chosen] + _TIP * away / length
        more = _with_tips(laid, tips, gluing, face[chosen])
        whole = Gluing.of(more.all_tets)
        flaws = [examine(V, whole) for V in (more.folded, more.unfolded)]
        bad = [whole.misglued, *(f.elements(whole) for f in flaws)]
        if not whole.closed:
            bad.append(np.flatnonzero(np.isin(whole.T, whole.pinched).any(axis=1)))
        fallen = np.unique(np.concatenate(bad)) - len(T)
        fallen = fallen[fallen >= 0]
        if whole.sound and all(f.none for f in flaws):
            kept[chosen] = True
            return more, kept
        if not len(fallen):
            break
        chosen = np.delete(chosen, fallen)
    return laid, kept


def _with_tips(laid: Laid, tips: Floats, gluing: Gluing, faces: Ints) -> Laid:
    """Return the prisms with tents of given tips (k, 3) on faces (k,) of their border."""
    owner = gluing.T[gluing.owner[faces]]
    share = barycentric_in_tets(tips, laid.folded, owner)
    base = gluing.F[faces]
    number = len(laid.folded) + np.arange(len(tips))
    return replace(
        laid,
        folded=np.concatenate([laid.folded, tips]),
        unfolded=np.concatenate(
            [laid.unfolded, np.einsum("ij,ijk->ik", share, laid.unfolded[owner])]
        ),
        stratigraphic=np.concatenate(
            [laid.stratigraphic, np.einsum("ij,ij->i", share, laid.stratigraphic[owner])]
        ),
        height=np.concatenate([laid.height, np.einsum("ij,ij->i", share, laid.height[owner])]),
        node=np.concatenate([laid.node, laid.node[base[:, 0]]]),
        shell=np.concatenate([laid.shell, np.column_stack([base, number])]),
    )
