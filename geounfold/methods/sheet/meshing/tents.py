"""Tents: single tetrahedra over the border of a mesh, for blocks that lie just outside it.

At an inner hinge a block may lie beyond the line on which the sheet's normals cross, so that no
prism can reach it.  A tent is a tetrahedron on the nearest face of the border, with the block just
below its tip.  The tip is carried by the affine map of the element behind that face, so the map is
continued and has an exact inverse.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.backends.igl import (
    SurfaceIndex,
    barycentric_in_tets,
    self_intersections,
    upright,
)
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.mapping.certificate import Gluing
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
    left, gluing = np.arange(len(points)), Gluing.of(laid.all_tets)
    for _ in range(_ROUNDS):
        if not len(left) or len(left) > _MOST:
            break
        laid, gluing, kept = _raised(laid, gluing, points[left])
        if not kept.any():
            break
        left = left[~kept]
    return laid, left


def _raised(laid: Laid, gluing: Gluing, points: Floats) -> tuple[Laid, Gluing, Bools]:
    """Return the prisms with tents, their gluing, and which points have one.

    As many points as leave the prisms proved.  If several points lie over one face, the farthest
    gets the tent; the others may lie inside it.
    """
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
        whole = _glued(gluing, face[chosen], more.all_tets)
        fallen = _flawed(more, whole, len(chosen))
        if not fallen.any():
            kept[chosen] = True
            return more, whole, kept
        chosen = chosen[~fallen]
    return laid, gluing, kept


def _glued(gluing: Gluing, faces: Ints, T: Ints) -> Gluing:
    """Return the gluing with tents, the last rows of ``T``, on the border's ``faces`` (k,).

    A tent's base takes the place of the face, and its tip is a new vertex: a closed manifold stays
    one.
    """
    last = len(T) - len(faces)
    sides = T[last:][:, [[0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    return Gluing(
        T,
        np.concatenate([np.delete(gluing.F, faces, axis=0), sides]),
        np.concatenate(
            [np.delete(gluing.owner, faces), np.repeat(np.arange(last, len(T)), 3)],
        ),
        gluing.misglued,
        gluing.closed,
    )


def _flawed(laid: Laid, gluing: Gluing, count: int) -> Bools:
    """Return which of the last ``count`` tetrahedra, the tents, are inverted or cross the border.

    Only faces close enough to touch a tent are compared: the others are the proved prisms' own.
    """
    tents = gluing.T[-count:]
    bad = np.zeros(count, dtype=bool)
    for V in (laid.folded, laid.unfolded):
        bad |= ~upright(V, tents)
        middle, radius = _balls(V[tents])
        centre, size = _balls(V[gluing.F])
        near = np.flatnonzero(cKDTree(middle).query(centre)[0] <= size + radius.max())
        owner = gluing.owner[near[self_intersections(V, gluing.F[near])]].ravel()
        bad[owner[owner >= len(gluing.T) - count] - (len(gluing.T) - count)] = True
    return bad


def _balls(corners: Floats) -> tuple[Floats, Floats]:
    """Return centre (n, 3) and radius (n,) of a ball that holds each simplex (n, k, 3)."""
    centre: Floats = corners.mean(axis=1)
    radius: Floats = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return centre, radius


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
