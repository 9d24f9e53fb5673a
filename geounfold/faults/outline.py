"""Outlines: where the rim of a fault block meets a fault, which marks the slip along it.

The rim of the hull near the end of a cut-off is carried into the block's own flat plane. There its
place along the cut-off is fitted against the distance from it and read off at the cut-off itself.
The end of the cut-off alone would be off by the blocks' staircase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geounfold.body.fault_surface import FaultSurface
from geounfold.faults.block_map import BlockMap
from geounfold.faults.cutoffs import MIDDLE, Cutoff
from geounfold.faults.joints import Joint
from geounfold.geometry.measures import face_normals
from geounfold.geometry.mesh import Floats

_JUNCTION = 2.5  # blocks from another fault within which an end is a junction of faults
_AROUND = 6.5  # blocks around an end whose rim is used
_AT_FAULT = 1.3  # blocks from a fault within which a face of the hull may be its wall
_FEWEST = 12  # faces of the hull that a rim must have there
_STEEPEST = 2.5  # blocks along the cut-off per block off it, above which a rim runs along it
_ROUGHEST = 0.8  # blocks: root mean square that a straight rim may leave
_PLANE = 0.5  # blocks off one plane up to which both rims may be a limit of the model
_HORIZON = 0.75  # cosine with the layers' normal from which a face of the hull is top or bottom
AGREE = 2.5
"""Blocks by which the slips along a fault that its two ends mark may differ."""


@dataclass(frozen=True, eq=False)
class Mark:
    """One end of a fault between two blocks, where the outline of both meets it.

    Attributes
    ----------
    flaw : str
        Why it marks no slip: ``junction``, ``no rim``; empty if it marks it.
    plane : bool
        Whether both rims lie in one plane, as at a limit of the model.
    foot, hanging : (3,) float
        Places of the outline in the own flat space of each block.
    """

    flaw: str
    plane: bool
    foot: Floats
    hanging: Floats


_NOWHERE = np.full(3, np.nan)


class Outlines:
    """The rim of every fault block.

    Parameters
    ----------
    blocks : sequence of BlockMap
        The fault blocks.
    surfaces : sequence of FaultSurface
        All faults, working units.
    """

    def __init__(self, blocks: Sequence[BlockMap], surfaces: Sequence[FaultSurface]) -> None:
        self._blocks, self._surfaces = blocks, surfaces
        self._rims: dict[int, tuple[Floats, Floats, Floats]] = {}

    def marks(self, joint: Joint, strike: Floats) -> list[Mark]:
        """Return what the two ends of a joint mark.

        Parameters
        ----------
        joint : Joint
            The joint.
        strike : (3,) float
            The fault's mean strike, folded.
        """
        return [self._mark(joint, sign * strike) for sign in (-1.0, 1.0)]

    def _mark(self, joint: Joint, outward: Floats) -> Mark:
        """Return what the end of a joint towards a folded direction (3,) marks."""
        ends, places, rims = [], [], []
        for number, cut in ((joint.foot, joint.low), (joint.hanging, joint.high)):
            rows = cut.rows(MIDDLE)
            if len(rows) < 6:
                return Mark("no rim", False, _NOWHERE, _NOWHERE)
            last = rows[(cut.folded[rows] @ outward).argmax()]
            C, N, flat = self._rim(number)
            near = np.linalg.norm(C - cut.folded[last], axis=1) < _AROUND
            ends.append(cut.folded[last])
            rims.append((C[near], N[near]))
            places.append(self._crossing(number, cut, int(last), flat[near]))
        both = np.stack(ends)
        for k, surface in enumerate(self._surfaces):
            if k != joint.fault and surface.sides(both).distance.min() < _JUNCTION:
                return Mark("junction", False, _NOWHERE, _NOWHERE)
        foot, hanging = places
        if foot is None or hanging is None:
            return Mark("no rim", False, _NOWHERE, _NOWHERE)
        return Mark("", _coplanar(rims), foot, hanging)

    def _crossing(self, number: int, cut: Cutoff, last: int, rim: Floats) -> Floats | None:
        """Return where a rim (n, 3), flat, meets a cut-off near its sample ``last``; or None."""
        end, rows = cut.flat[last], cut.rows(MIDDLE)
        if len(rim) < _FEWEST:
            return None
        apart = cut.flat[rows, :2] - end[:2]
        apart = apart[np.linalg.norm(apart, axis=1) < _AROUND]
        t = np.linalg.svd(apart - apart.mean(axis=0), full_matrices=False)[2][0]
        t = t * (-1.0 if apart.mean(axis=0) @ t > 0 else 1.0)  # towards the end
        n = np.array([-t[1], t[0]])
        line = end[:2] + apart.mean(axis=0)
        layers = self._blocks[number].carry(self._blocks[number].points[::17])
        middle = layers.flat[layers.there, :2].mean(axis=0)
        n = n * (1.0 if (middle - line) @ n > 0 else -1.0)
        along, off = (rim[:, :2] - line) @ t, (rim[:, :2] - line) @ n
        z = rim[:, 2] - end[2]
        weight = np.clip(1 - np.abs(off / _AROUND) ** 3, 0, None) ** 3 * (off > -1.0)
        rows_ = np.stack([np.ones(len(rim)), off, z], axis=1)
        fit, left = np.zeros(3), np.zeros(len(rim))
        for _ in range(4):
            w = weight / (1 + (left / 0.5) ** 2)
            N = (rows_ * w[:, None]).T @ rows_ + np.diag([1e-9, 1e-3, 1e-3])
            fit = np.linalg.solve(N, rows_.T @ (w * along))
            left = along - rows_ @ fit
        if (weight > 0.1).sum() < _FEWEST or abs(fit[1]) > _STEEPEST:
            return None
        if np.sqrt((weight * left**2).sum() / weight.sum()) > _ROUGHEST:
            return None
        return np.array([*(line + fit[0] * t), end[2]])

    def _rim(self, block: int) -> tuple[Floats, Floats, Floats]:
        """Return centres, normals and flat places of a hull at neither top, bottom nor a fault."""
        if block not in self._rims:
            own = self._blocks[block]
            mesh = own.fit.split.mesh
            C, N = mesh.V[mesh.F].mean(axis=1), face_normals(mesh.V, mesh.F)
            keep = np.ones(len(C), dtype=bool)
            for surface in self._surfaces:
                keep &= surface.sides(C).distance > _AT_FAULT
            C, N = C[keep], N[keep]
            layers = own.carry(C, gradients=True)
            up = layers.gradient[:, 2]
            up = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
            rim = np.abs((up * N).sum(axis=1)) <= _HORIZON
            self._rims[block] = C[rim], N[rim], layers.flat[rim]
        return self._rims[block]


def _coplanar(rims: Sequence[tuple[Floats, Floats]]) -> bool:
    """Return whether two rims, centres and normals (n, 3), lie in one plane."""
    P = np.concatenate([C for C, _ in rims])
    middle = P.mean(axis=0)
    n = np.linalg.svd(P - middle, full_matrices=False)[2][2]
    off = max(float(np.abs((C - middle) @ n).mean()) for C, _ in rims)
    along = min(float(np.abs(N @ n).mean()) for _, N in rims)
    return off < _PLANE and along > 0.7
