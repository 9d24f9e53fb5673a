"""Where layers do not slip: the pin line, free in flexural slip, put at the mean of the profile.

The mean is taken over the section across the fold axis, in which every station counts once however
wide, thick or pierced the sheet is there.  So neither a hole nor an embayment nor a rim that
tapers moves the pin line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.mesh import Floats
from geounfold.methods.sheet.mid_surface.normal_equations import spd_solver
from geounfold.methods.sheet.mid_surface.surface import MidSurface, normals, second_form

_SMOOTH = 10.0
"""Weight of second differences between strips, beside that of a usual strip's own mean.

Half-wave lengths of 10 strips keep 0.91 of their size, those of 20 0.994.
"""


def fold_axes(sheet: MidSurface, U: Floats) -> Floats:
    """Return unit directions across the fold axis and along it, as rows (2, 2).

    The first is that of the largest squared curvature, summed over U (n, 2): the first axis of
    the second form squared, to which crests and troughs count alike.
    """
    jet = sheet.jet(U)
    L, M, N = second_form(jet, normals(jet))
    angle = 0.5 * float(np.arctan2(((L + N) * 2 * M).sum(), ((L + N) * (L - N)).sum()))
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The section of a sheet across its fold axis, and that along it.

    Attributes
    ----------
    axes : (2, 2) float
        Their directions in the plane of the parameters: unit rows at right angles.
    span : (2, 2) float
        Lowest and highest station (rows) along each axis.
    """

    axes: Floats
    span: Floats

    def mean(self, values: Floats, U: Floats, weight: Floats, cell: float) -> Floats:
        """Return the mean of vectors over the sheet, (2,), in which every station counts once.

        The component along each axis is averaged within strips across that axis, and then over
        the strips by how much of the span each covers.

        Parameters
        ----------
        values : (n, 2) float
            Vectors in the plane of U.
        U : (n, 2) float
            Their places.
        weight : (n,) float
            Of each within its strip; not negative.
        cell : float
            Width of the strips, whose middles are whole widths from the first place.
        """
        along, places = values @ self.axes.T, U @ self.axes.T
        low, high = self.span
        out = np.empty(2)
        for k in range(2):
            first = places[:, k].min()
            strip = np.rint((places[:, k] - first) / cell).astype(np.int64)
            total = np.bincount(strip, weight).astype(np.float64)
            sums = np.bincount(strip, weight * along[:, k]).astype(np.float64)
            middle = first + cell * np.arange(len(total))
            covered = np.minimum(middle + cell / 2, high[k]) - np.maximum(middle - cell / 2, low[k])
            out[k] = np.average(_smoothed(sums, total), weights=np.maximum(covered, 1e-9 * cell))
        mean: Floats = out @ self.axes
        return mean


def _smoothed(sums: Floats, total: Floats) -> Floats:
    """Return the strips' means (s,), continued over strips that have little weight or none.

    By least second differences (Whittaker smoothing), each mean weighed by its strip's share of
    the usual weight, at most one.
    """
    n, usual = len(total), float(np.median(total[total > 0]))
    means = sums / np.where(total > 0, total, 1.0)
    if n < 3 or np.count_nonzero(total) < 2:
        return means
    weight = np.minimum(total / usual, 1.0)
    D = sp.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(n - 2, n))
    K = sp.csc_array(sp.diags_array(weight) + _SMOOTH * (D.T @ D))
    return spd_solver(K)(weight * means)
