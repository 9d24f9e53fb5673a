"""Prisms between stacked copies of a triangulation, cut into tetrahedra."""

from __future__ import annotations

import numpy as np

from geounfold.mesh import Ints


def prism_tets(F: Ints, n: int, layers: int) -> Ints:
    """Return the tetrahedra between stacked layers of a triangulation.

    Layer k holds vertices ``k n .. (k + 1) n - 1``, each above the same vertex of the layer
    below it, on the side the counter-clockwise faces look to.  Every prism is cut by its
    vertices' order (a < b < c), so that neighbours share their diagonals.

    Parameters
    ----------
    F : (m, 3) int
        Faces, counter-clockwise seen from above.
    n : int
        Vertices per layer.
    layers : int
        Number of layers, at least two.

    Returns
    -------
    (3 m (layers - 1), 4) int
        Right-handed tetrahedra wherever the prisms are upright; layer by layer.

    Examples
    --------
    >>> prism_tets(np.array([[0, 1, 2]]), 3, 2).tolist()
    [[0, 1, 2, 5], [1, 0, 4, 5], [0, 3, 4, 5]]
    """
    order = np.argsort(F, axis=1)
    a, b, c = np.take_along_axis(F, order, axis=1).T
    odd = ~np.isin(order @ [9, 3, 1], [5, 15, 19])[:, None]
    tets = [
        np.stack([a, b, c, c + n], axis=1),
        np.stack([b, a, b + n, c + n], axis=1),
        np.stack([a, a + n, b + n, c + n], axis=1),
    ]
    slab = np.concatenate([np.where(odd, t[:, [1, 0, 2, 3]], t) for t in tets])
    return np.concatenate([slab + k * n for k in range(layers - 1)])
