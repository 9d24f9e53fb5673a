"""The pin line, where layers do not slip.

Flexural slip leaves its position open; it is placed where the mean slip over the cross-section is
zero.  The cross-section runs across the fold axis.  Every station along it counts once, however
wide, thick or pierced the sheet is there, so holes, embayments and tapering rims do not move the
pin line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from geounfold.geometry.mesh import Floats
from geounfold.methods.sheet.mid_surface.normal_equations import spd_solver
from geounfold.methods.sheet.mid_surface.surface import MidSurface, normals, second_form

_SMOOTH = 10.0
"""Weight of second differences between strips, relative to that of a full strip's mean.

A wave with a half wavelength of 10 strips keeps 0.91 of its amplitude, one of 20 strips 0.994.
"""


def fold_axes(sheet: MidSurface, U: Floats) -> Floats:
    """Return unit directions across the fold axis and along it, as rows (2, 2).

    The first is the direction of the largest squared curvature, summed over U (n, 2): the first
    eigenvector of the summed square of the second form.  Crests and troughs count alike.
    """
    jet = sheet.jet(U)
    L, M, N = second_form(jet, normals(jet))
    angle = 0.5 * float(np.arctan2(((L + N) * 2 * M).sum(), ((L + N) * (L - N)).sum()))
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The sections of a sheet across its fold axis and along it.

    Attributes
    ----------
    axes : (2, 2) float
        Directions of both in the plane of the parameters, as orthonormal rows.
    span : (2, 2) float
        Lowest and highest station (rows) along each axis.
    """

    axes: Floats
    span: Floats

    def mean(self, values: Floats, U: Floats, weight: Floats, cell: float) -> Floats:
        """Return the mean of vectors over the sheet, (2,); every station counts once.

        The component along each axis is averaged within strips across that axis, then over the
        strips, weighted by the length of the span that each covers.

        Parameters
        ----------
        values : (n, 2) float
            Vectors in the plane of U.
        U : (n, 2) float
            Places of the vectors.
        weight : (n,) float
            Weight of each vector within its strip; not negative.
        cell : float
            Width of the strips.  Their middles are a whole number of widths from the first place.
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
    """Return the means of the strips (s,), continued over strips of little or no weight.

    Whittaker smoothing (least second differences).  Each mean has the weight of its strip relative
    to a full strip's, at most 1.
    """
    n, usual = len(total), float(np.median(total[total > 0]))
    means = sums / np.where(total > 0, total, 1.0)
    if n < 3 or np.count_nonzero(total) < 2:
        return means
    weight = np.minimum(total / usual, 1.0)
    D = sp.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(n - 2, n))
    K = sp.csc_array(sp.diags_array(weight) + _SMOOTH * (D.T @ D))
    return spd_solver(K)(weight * means)
