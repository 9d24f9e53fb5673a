"""The figures that `geounfold quality` and `geounfold crosscheck` print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold import quality
from geounfold.geometry.mesh import Floats

if TYPE_CHECKING:
    from geounfold.comparison.crosscheck import CrossCheck


def quality_figures(
    folded: Floats, unfolded: Floats, truth: Floats | None, neighbours: int | None
) -> dict[str, Any]:
    """Return how an unfolding keeps distances, and how far from a truth it lies.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The same points row by row, in the same unit.
    truth : (n, 3) float, optional
        Where they truly lay.
    neighbours : int, optional
        Per point; 26 without.

    Returns
    -------
    dict
        NMD of each cloud with its own neighbours, epsilon with the folded body's neighbours kept
        and with each cloud's own; without a truth the ratios of far distances, with one what
        `quality.TruthQuality` holds.

    Raises
    ------
    InputError
        Too few points, or points that coincide with all their neighbours.
    """
    k = quality.NEIGHBOURS if neighbours is None else neighbours
    facts: dict[str, Any] = {"points": len(folded), "neighbours": k}
    clouds = {"nmd_folded": folded, "nmd_unfolded": unfolded}
    if truth is not None:
        clouds["nmd_truth"] = truth
    for name, cloud in clouds.items():
        facts[name] = _statistics(quality.nmd(cloud, quality.neighbours(cloud, k)))
    own = {"epsilon_own_neighbours": _statistics(quality.epsilon(folded, unfolded, k, "own"))}
    if truth is not None:
        return facts | quality.compare_with_truth(folded, unfolded, truth, k).summary() | own
    ratios = quality.distance_ratios(folded, unfolded, quality.random_pairs(len(folded)))
    epsilon = {"epsilon_folded": _statistics(quality.epsilon(folded, unfolded, k))}
    return facts | epsilon | own | {"distances": _statistics(np.abs(ratios - 1))}


def _statistics(values: Floats) -> dict[str, float]:
    return asdict(quality.Statistics.of(values))


def crosscheck_lines(check: CrossCheck) -> Iterator[str]:
    """Yield a cross-check as two tables: meshes, and the places that they give."""
    yield f"volume inside the control mesh's border  {check.volume:.6g}\n"
    yield f"volume of the hull                       {check.hull_volume:.6g}\n\n"
    yield (
        f"{'mesh':<9}{'tetrahedra':>11}{'volume':>10}{'border':>9}{'dihedral':>14}{'radii':>7}"
        f"{'seconds':>9}\n"
    )
    for mesh in check.meshes:
        if mesh.error:
            yield f"{mesh.mesh:<9} {mesh.error}\n"
            continue
        angles = f"{mesh.dihedral_min:.1f}-{mesh.dihedral_max:.1f}"
        apart = max(mesh.hausdorff_to, mesh.hausdorff_from)
        yield (
            f"{mesh.mesh:<9}{mesh.tetrahedra:>11,}{mesh.volume_difference:>+10.3%}{apart:>9.3f}"
            f"{angles:>14}{mesh.radius_ratio_min:>7.3f}{mesh.seconds:>9.1f}\n"
        )
    yield f"\n{'mesh':<9}{'inside':<10}{'rms':>8}{'p95':>8}{'max':>8}{'same inside':>13}\n"
    for places in check.places:
        if places.error:
            yield f"{places.mesh:<9}{places.interior:<10} {places.error}\n"
            continue
        yield (
            f"{places.mesh:<9}{places.interior:<10}{places.rms:>8.3f}{places.p95:>8.3f}"
            f"{places.max:>8.3f}{places.rms_same_interior:>13.3f}\n"
        )
    yield "\nlengths in blocks; radii: smallest radius ratio; rms, p95, max: from the map\n"
