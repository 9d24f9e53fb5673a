"""Ends of cut-offs: marks of the slip along a fault, if they are the ore's own outline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.fault_surface import FaultSurface
from geounfold.faults.block_map import BlockMap
from geounfold.faults.cutoffs import Cutoff
from geounfold.faults.joints import Joint
from geounfold.geometry.measures import face_normals
from geounfold.geometry.mesh import Floats

_JUNCTION = 2.5  # blocks from another fault within which an end is a junction of faults
_LIMIT = 7.0  # blocks around an end whose outline is compared on both sides
_PLANE = 0.5  # blocks off one plane up to which both outlines are a limit of the model
_HORIZON = 0.75  # cosine with the layers' normal from which a face of the hull is top or bottom

End = tuple[Floats, Floats]
"""Place of a cut-off's end in the joint flat space, (2,), and in the folded space, (3,)."""


def ends(cut: Cutoff, placed: Floats, axis: Floats) -> list[End | None]:
    """Return the two ends of a cut-off along a direction of the flat plane, from its middle levels.

    Parameters
    ----------
    cut : Cutoff
        The cut-off.
    placed : (n, 3) float
        Its samples in the joint flat space.
    axis : (2,) float
        The direction.
    """
    out: list[End | None] = []
    for sign in (-1, 1):
        flat, folded = [], []
        for level in (1, 2, 3):
            rows = cut.rows(level)
            if len(rows) < 3:
                continue
            last = rows[(sign * (placed[rows, :2] @ axis)).argmax()]
            flat.append(placed[last, :2])
            folded.append(cut.folded[last])
        out.append((np.mean(flat, axis=0), np.mean(folded, axis=0)) if flat else None)
    return out


class Outlines:
    """The outline of every fault block, and which ends of cut-offs lie on it.

    Parameters
    ----------
    blocks : sequence of BlockMap
        The fault blocks.
    surfaces : sequence of FaultSurface
        All faults, working units.
    """

    def __init__(self, blocks: Sequence[BlockMap], surfaces: Sequence[FaultSurface]) -> None:
        self._blocks, self._surfaces = blocks, surfaces
        self._rims: dict[int, tuple[Floats, Floats]] = {}
        self._known: dict[tuple[int, ...], str] = {}

    def flaw(self, number: int, joint: Joint, foot: Floats, hanging: Floats) -> str:
        """Return why a pair of ends marks no slip: junction or model limit; empty if it does.

        Parameters
        ----------
        number : int
            Of the joint.
        joint : Joint
            The joint.
        foot, hanging : (3,) float
            The ends, folded.
        """
        key = (number, *np.rint(np.concatenate([foot, hanging]) / 2).astype(int).tolist())
        if key not in self._known:
            self._known[key] = self._flaw(joint, foot, hanging)
        return self._known[key]

    def _flaw(self, joint: Joint, foot: Floats, hanging: Floats) -> str:
        both = np.stack([foot, hanging])
        for k, surface in enumerate(self._surfaces):
            if k != joint.fault and surface.sides(both).distance.min() < _JUNCTION:
                return "junction"
        near = []
        for block, end in ((joint.foot, foot), (joint.hanging, hanging)):
            C, N = self._rim(block)
            close = np.linalg.norm(C - end, axis=1) < _LIMIT
            near.append((C[close], N[close]))
        if min(len(C) for C, _ in near) < 8:
            return ""
        P = np.concatenate([C for C, _ in near])
        middle = P.mean(axis=0)
        n = np.linalg.svd(P - middle, full_matrices=False)[2][2]
        off = max(float(np.abs((C - middle) @ n).mean()) for C, _ in near)
        along = min(float(np.abs(N @ n).mean()) for _, N in near)
        return "model limit" if off < _PLANE and along > 0.7 else ""

    def _rim(self, block: int) -> tuple[Floats, Floats]:
        """Return centres and normals of a block's hull at neither top, bottom nor a fault."""
        if block not in self._rims:
            own = self._blocks[block]
            mesh = own.fit.split.mesh
            C, N = mesh.V[mesh.F].mean(axis=1), face_normals(mesh.V, mesh.F)
            layers = own.carry(C, gradients=True)
            up = layers.gradient[:, 2]
            up = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
            keep = ~(np.abs((up * N).sum(axis=1)) > _HORIZON)
            for surface in self._surfaces:
                keep &= surface.sides(C).distance > 1.3
            self._rims[block] = C[keep], N[keep]
        return self._rims[block]
