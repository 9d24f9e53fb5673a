"""Hull extraction: a closed, outward, manifold surface around the blocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from geounfold.backends import igl as _igl
from geounfold.body.scattered import scattered
from geounfold.errors import BackendError, HullError, check_one_of
from geounfold.geometry.measures import face_normals, triangle_areas
from geounfold.geometry.mesh import Floats
from geounfold.surfaces.hull._options import HullOptions
from geounfold.surfaces.hull._result import Hull
from geounfold.surfaces.hull.alpha import alpha_hull
from geounfold.surfaces.hull.ball_pivoting import ball_pivoting_hull
from geounfold.surfaces.hull.density import density_hull, scattered_hull
from geounfold.surfaces.hull.poisson import poisson_hull

__all__ = ["HULLS", "Hull", "HullOptions", "extract_hull", "unsuitability"]

Maker = Callable[[Floats, Floats, HullOptions], Hull]

HULLS: dict[str, Maker] = {
    "density": density_hull,
    "alpha": alpha_hull,
    "ball_pivoting": ball_pivoting_hull,
    "poisson": poisson_hull,
}

UNEQUAL = 1.2  # ratio of block sides above which they count as unequal
VOLUMES = (0.6, 1.5)  # valid range of the enclosed volume over the blocks' volume
SAMPLE = 10_000  # largest number of points checked
STRAYS = 0.01  # largest share of the points more than one block outside


def extract_hull(
    points: Floats,
    steps: Floats | None,
    method: str = "auto",
    options: HullOptions | None = None,
    weights: Floats | None = None,
) -> Hull:
    """Return a closed, outward, manifold surface of one component around the points.

    Parameters
    ----------
    points : (n, 3) float
        Block centroids in working units (one block has volume 1).
    steps : (3,) float or None
        Block sides along the axes, working units, product 1; None for scattered points.
    method : str
        A name in HULLS, or ``auto``: the first with a suitable hull (see
        `unsuitability`), with the reason in ``Hull.reason``.
    options : HullOptions, optional
        Lengths and thresholds.
    weights : (n,) float, optional
        Volume of each point if it is a cell that blocks fill in part; 1 by default.  All methods
        except the density use the points of cells that are at least half full.

    Raises
    ------
    OptionError
        Unknown method.
    HullError
        The method made no closed manifold hull; the message names another method.
    """
    check_one_of("hull", method, ("auto", *HULLS))
    points = np.asarray(points, dtype=np.float64)
    options = options or HullOptions()
    sides = np.ones(3) if steps is None or steps.max() <= UNEQUAL * steps.min() else steps
    makers = HULLS
    if weights is not None:
        makers = _weighted(weights)
    elif steps is None and scattered(points):
        makers = HULLS | {"density": scattered_hull}
    if method == "auto":
        return _first_suitable(makers, points, sides, options)
    return makers[method](points, sides, options)


def _weighted(weights: Floats) -> dict[str, Maker]:
    """Return the methods for points with a volume each."""

    def halved(make: Maker) -> Maker:
        return lambda points, sides, options: make(points[weights >= 0.5], sides, options)

    out = {name: halved(make) for name, make in HULLS.items()}
    return out | {"density": partial(density_hull, weights=weights)}


def _first_suitable(
    makers: dict[str, Maker], points: Floats, sides: Floats, options: HullOptions
) -> Hull:
    refused: list[str] = []
    strays = 0.0
    for name, make in makers.items():
        try:
            hull = make(points, sides, options)
        except (HullError, BackendError) as error:
            refused.append(f"{name}: {error}")
            continue
        fault = unsuitability(hull, points)
        if not fault:
            ratio = hull.volume / hull.blocks_volume
            chosen = (
                f"{name}: closed, manifold, {ratio:.2f} of the blocks' volume, holds the points"
            )
            return replace(hull, reason="; ".join([*refused, chosen]), strays=strays)
        refused.append(f"{name}: {fault}")
        if name == "density":
            share = _strays(hull, points)
            strays = share if share > STRAYS else 0.0
    raise HullError("no hull is suitable (" + "; ".join(refused) + ")")


def unsuitability(hull: Hull, points: Floats) -> str:
    """Return the reason why a hull does not fit the points it was made from; empty if it fits.

    Its volume must be 0.6 to 1.5 times the blocks', corrected for a hull through the outermost
    centroids, which runs half a block inside.  At most 1 % of the points may lie more than a block
    outside.
    """
    outside = _strays(hull, points)
    if outside > STRAYS:
        return f"{outside:.1%} of the points lie more than a block outside"
    skin = triangle_areas(hull.mesh.V, hull.mesh.F).sum() * hull.inset
    ratio = (hull.volume + float(skin)) / hull.blocks_volume
    if not VOLUMES[0] <= ratio <= VOLUMES[1]:
        return f"it encloses {ratio:.2f} times the blocks' volume"
    return ""


def _strays(hull: Hull, points: Floats) -> float:
    """Return the share of points that lie more than a block outside."""
    sample = points[:: 1 + len(points) // SAMPLE]
    return float(np.mean(_outside_by(hull, sample) > 1.0))


def _outside_by(hull: Hull, points: Floats) -> Floats:
    """Return the distance of each point outside the hull, (n,); negative inside."""
    index = _igl.SurfaceIndex(hull.mesh.V, hull.mesh.F)
    distance, face, foot = index.closest(points)
    normal = face_normals(hull.mesh.V, hull.mesh.F)[face]
    side = np.sign(np.einsum("ij,ij->i", points - foot, normal))
    out: Floats = distance * side
    return out
