"""Fault surfaces moved onto the blocks that end at them, if wireframe and model disagree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.block_cells import connected
from geounfold.body.fault_surface import FaultSurface
from geounfold.body.working_frame import Frame
from geounfold.faults.cutoffs import refined
from geounfold.faults.cutting import crossing_pairs
from geounfold.faults.from_blocks import exposed_faces
from geounfold.geometry.mesh import Floats

_REACH = 2.5  # blocks off a surface up to which faces may end at it
_LOOKS = 0.8  # cosine with its normal from which they do
_FEWEST = 40  # faces from which a surface is moved
_ROUNDS = ((1.2, 0), (1.2, 1), (1.0, 1), (1.0, 2), (0.9, 2))
"""Blocks from the moved surface within which faces are fitted, and the shift's degree."""

_CRUMB = 2.2  # blocks from a surface within which all of a crumb lies
_WORSE = (1.5, 0.004)
"""Crumbs as given over those once moved, and further share of the blocks, from which it is moved.

Measured: exact surfaces leave up to 0.6 % of the blocks in crumbs, and more once moved; surfaces
half a block off leave 2 to 3 %, and half or less of that once moved.
"""


_TOLD = 0.01  # share of the blocks in crumbs above which it is told that surfaces do not fit


def moved_onto_blocks(
    points: Floats, surfaces: tuple[FaultSurface, ...], frame: Frame
) -> tuple[tuple[FaultSurface, ...], list[str]]:
    """Return the surfaces, moved onto the blocks' ends if that leaves far fewer crumbs, and notes.

    Parameters
    ----------
    points : (n, 3) float
        Blocks, working units.
    surfaces : tuple of FaultSurface
        As given, working units.
    frame : Frame
        The working frame.
    """
    given = _crumbs(points, surfaces, frame)
    if given <= _WORSE[1] * len(points):
        return surfaces, []
    faces = exposed_faces(points, frame)
    moved = tuple(_moved(s, faces.centres, faces.normals) for s in surfaces)
    left = _crumbs(points, moved, frame)
    if given <= _WORSE[0] * left + _WORSE[1] * len(points):
        return surfaces, [] if given <= _TOLD * len(points) else [
            f"{given} blocks lie between the fault surfaces and the ends of the fault blocks: "
            "surfaces and blocks disagree"
        ]
    return moved, [
        f"the fault surfaces were moved onto the blocks: {given} blocks lay between a surface and "
        f"the ends of the fault blocks, {left} do now"
    ]


def _crumbs(points: Floats, surfaces: Sequence[FaultSurface], frame: Frame) -> int:
    """Return the number of blocks in pieces that lie along a surface."""
    pairs, parted, nearest = crossing_pairs(points, surfaces, frame)
    label = connected(pairs[~parted, 0], pairs[~parted, 1], len(points))
    far = np.zeros(int(label.max()) + 1)
    np.maximum.at(far, label, nearest)
    return int((far[label] < _CRUMB).sum())


def _moved(surface: FaultSurface, centres: Floats, normals: Floats) -> FaultSurface:
    """Return a surface shifted along its normals, quadratically over it, onto faces (n, 3)."""
    fine = refined(surface)
    seen = fine.sides(centres)
    looks = np.abs(np.einsum("ij,ij->i", normals, fine.normal[seen.face]))
    ok = (np.abs(seen.signed) < _REACH) & ~seen.past & (looks > _LOOKS)
    if ok.sum() < _FEWEST:
        return surface
    off, P = seen.signed[ok], centres[ok]
    grid = np.linspace(-_REACH, _REACH, 101)
    likely = np.exp(-0.5 * ((off[:, None] - grid) / 0.5) ** 2).sum(axis=0)
    middle = fine.V.mean(axis=0)
    axes = np.linalg.svd((fine.V - middle)[:: max(1, len(fine.V) // 2000)], full_matrices=False)[2]
    scale = np.abs((P - middle) @ axes[:2].T).max(axis=0)

    def terms(Q: Floats, degree: int) -> Floats:
        a, b = np.clip((Q - middle) @ axes[:2].T / scale, -1.2, 1.2).T
        powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        return np.stack([a**i * b**j for i, j in powers], axis=1)

    fit, degree = np.array([grid[likely.argmax()]]), 0
    for within, more in _ROUNDS:
        rows = np.abs(off - terms(P, degree) @ fit) < within
        if rows.sum() < _FEWEST:
            break
        B = terms(P[rows], more)
        ridge = 1e-2 * rows.sum() * np.diag((np.arange(B.shape[1]) > 0).astype(float))
        fit, degree = np.linalg.solve(B.T @ B + ridge, B.T @ off[rows]), more
    n = np.zeros_like(fine.V)
    for k in range(3):
        np.add.at(n, fine.F[:, k], fine.normal)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
    return fine.moved(fine.V + n * (terms(fine.V, degree) @ fit)[:, None])
