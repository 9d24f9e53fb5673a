"""Weighted least squares over the poses of all fault blocks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.faults.block_map import Pose
from geounfold.geometry.mesh import Floats

WIDTH = 5
"""Unknowns of a pose: angle, shift and shear."""


class Equations:
    """Normal equations of steps of all poses; rows are added, then solved.

    Parameters
    ----------
    count : int
        Number of fault blocks.
    """

    def __init__(self, count: int) -> None:
        self.matrix = np.zeros((WIDTH * count, WIDTH * count))
        self.right = np.zeros(WIDTH * count)

    def add(
        self, moved: tuple[int, Floats], against: tuple[int, Floats], off: Floats, weight: Floats
    ) -> None:
        """Add rows ``J_moved d_moved - J_against d_against = -off`` with weights.

        Parameters
        ----------
        moved, against : (int, (k, 5) float)
            A fault block and the derivative of its places.
        off : (k,) float
            What the rows should remove.
        weight : (k,) float
            One over the variance of each row.
        """
        ends = (
            (slice(WIDTH * b, WIDTH * b + WIDTH), s * J)
            for (b, J), s in ((moved, 1.0), (against, -1.0))
        )
        (p, P), (q, Q) = ends
        PW, QW = P.T * weight, Q.T * weight
        self.right[p] -= PW @ off
        self.right[q] -= QW @ off
        self.matrix[p, p] += PW @ P
        self.matrix[q, q] += QW @ Q
        cross = PW @ Q
        self.matrix[p, q] += cross
        self.matrix[q, p] += cross.T

    def hold(self, poses: Sequence[Pose], groups: Sequence[int], share: Floats, sd: float) -> None:
        """Fix what is free: in each group its first block's turn and shift, and the mean shear.

        Parameters
        ----------
        poses : sequence of Pose
            The present poses.
        groups : sequence of int
            First block of each block's group.
        share : (n,) float
            Size of each block.
        sd : float
            Standard deviation of shear.
        """
        big = 1e6 * max(1.0, float(np.abs(np.diag(self.matrix)).max()))
        for start in sorted(set(groups)):
            for k in range(3):
                self.matrix[WIDTH * start + k, WIDTH * start + k] += big
            members = [b for b, g in enumerate(groups) if g == start]
            weight = share[members] / share[members].sum()
            for axis in (0, 1):
                row, now = np.zeros(len(self.right)), 0.0
                for b, w in zip(members, weight, strict=True):
                    row[WIDTH * b + 3 : WIDTH * b + 5] = w * poses[b].turn[axis]
                    now += float(w * (poses[b].turn @ poses[b].shear)[axis])
                self.matrix += 1e4 / sd**2 * np.outer(row, row)
                self.right -= 1e4 / sd**2 * row * now
        self.matrix += 1e-12 * np.eye(len(self.right))

    def steps(self) -> Floats:
        """Return the step of every pose, (n, 5)."""
        out = np.linalg.lstsq(self.matrix, self.right, rcond=1e-13)[0]
        return np.asarray(out.reshape(-1, WIDTH), dtype=np.float64)

    def covariance(self) -> Floats:
        """Return the covariance of the steps, (5 n, 5 n)."""
        return np.asarray(np.linalg.pinv(self.matrix, hermitian=True), dtype=np.float64)
