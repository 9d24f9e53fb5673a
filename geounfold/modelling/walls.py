r"""Hanging wall and footwall as functions over the reference surface, through all contacts.

The body's middle M and half thickness T are two smooth functions of the place p along the layer.
At a contact with the hanging wall at height h, M(p) + T(p) = h; with the footwall,
M(p) - T(p) = h. With the sign s of the wall (+1 hanging wall, -1 footwall) both are thin-plate
splines of one system,

    M(p) + s T(p) = sum_j c_j k(|p - p_j|) (1 + s s_j / stiffness) + (a + b p) + s (d + e p),

k(r) = r^2 log r (Duchon 1977), which is the kriging of two independent intrinsic functions by their
sum and difference. It passes through every contact, whether or not the two contacts of an intercept
lie above each other, and T varies less than M between the holes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats

MOST_CONTACTS = 6000
"""Most contacts: the system is dense, 0.3 GB for these."""

_STIFFNESS = 4.0  # how much more the middle may bend than the half thickness
_RIDGE = 1e-11  # added to the kernel's diagonal, in squared units of the extent: near twins
_ROWS = 2048  # places evaluated at a time


@dataclass(frozen=True, eq=False)
class Walls:
    """Fitted walls.

    Attributes
    ----------
    centre, scale
        The places are centred and scaled by these.
    places : (c, 2) float
        Places of the contacts, scaled.
    sides : (c,) float
        1 hanging wall, -1 footwall.
    weights : (c + 6,) float
        Coefficients of the kernels, then of the two trends.
    """

    centre: Floats
    scale: float
    places: Floats
    sides: Floats
    weights: Floats

    def at(self, places: Floats) -> tuple[Floats, Floats]:
        """Return the middle's height and the half thickness (n,) at places (n, 2)."""
        p = (places - self.centre) / self.scale
        count = len(self.places)
        middle, half = np.empty(len(p)), np.empty(len(p))
        c, trend = self.weights[:count], self.weights[count:]
        signed = c * self.sides / _STIFFNESS
        for first in range(0, len(p), _ROWS):
            rows = slice(first, first + _ROWS)
            k = _kernel(p[rows], self.places)
            line = np.column_stack([np.ones(len(k)), p[rows]])
            middle[rows] = (k * c).sum(axis=1) + (line * trend[:3]).sum(axis=1)
            half[rows] = (k * signed).sum(axis=1) + (line * trend[3:]).sum(axis=1)
        return middle, half


def fit_walls(places: Floats, heights: Floats, hanging: Bools) -> Walls:
    """Return the walls through contacts.

    Parameters
    ----------
    places : (c, 2) float
        Places along the reference surface.
    heights : (c,) float
        Heights above it.
    hanging : (c,) bool
        Whether the contact is with the hanging wall.

    Raises
    ------
    InputError
        A wall has fewer than three contacts or all on one line, or there are too many.
    """
    for name, own in (("hanging wall", hanging), ("footwall", ~hanging)):
        p = places[own]
        flat = len(p) < 3 or np.linalg.matrix_rank(p - p.mean(axis=0), tol=1e-6 * np.ptp(p)) < 2
        if flat:
            raise InputError(
                f"the {name} has {len(p)} contacts{' on one line' if len(p) > 2 else ''}: a "
                "surface needs three or more that are not on one line"
            )
    if len(places) > MOST_CONTACTS:
        raise InputError(
            f"{len(places)} contacts are more than {MOST_CONTACTS}; choose fewer holes by --where, "
            "or join short intercepts by --max-waste"
        )
    # Sorted, so that the sums do not depend on the order of the holes.
    order = np.lexsort((hanging, heights, places[:, 1], places[:, 0]))
    places, heights, hanging = places[order], heights[order], hanging[order]
    centre = places.mean(axis=0)
    scale = float(np.ptp(places, axis=0).max())
    p, s = (places - centre) / scale, np.where(hanging, 1.0, -1.0)
    count = len(p)
    line = np.column_stack([np.ones(count), p])
    trend = np.column_stack([line, s[:, None] * line])
    system = np.zeros((count + 6, count + 6))
    system[:count, :count] = _kernel(p, p) * (1 + s[:, None] * s / _STIFFNESS)
    system[np.arange(count), np.arange(count)] += _RIDGE * count
    system[:count, count:], system[count:, :count] = trend, trend.T
    weights = np.asarray(np.linalg.solve(system, np.r_[heights, np.zeros(6)]), dtype=np.float64)
    return Walls(centre, scale, p, s, weights)


def _kernel(p: Floats, q: Floats) -> Floats:
    """Return r^2 log r between places (n, 2) and (m, 2)."""
    square = ((p[:, None, 0] - q[None, :, 0]) ** 2) + ((p[:, None, 1] - q[None, :, 1]) ** 2)
    return np.asarray(0.5 * square * np.log(np.maximum(square, 1e-300)))
