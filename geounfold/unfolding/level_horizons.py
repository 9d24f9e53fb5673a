"""How level the top and the bottom come out in the flat space, and how large the body is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Floats
from geounfold.mapping.carried import Carried
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods import BodyFit, PointwiseMap


def level_errors(
    fits: Sequence[BodyFit], mapping: UnfoldingMap | PointwiseMap, frame: Frame
) -> dict[str, float | None]:
    """Return the mean distance of the hull's top and bottom from their levels, in thicknesses.

    The vertices of faces away from the rim are carried by the map; the stratigraphic coordinate of
    the top is 1, of the bottom 0. None if no such vertex has an image.
    """
    found: dict[str, float | None] = {}
    for name, side, level in (("top", 1, 1.0), ("bottom", -1, 0.0)):
        misses = []
        for fit in fits:
            faces = fit.split.mesh.F[(fit.split.side == side) & ~fit.split.rim]
            V = fit.split.mesh.V[np.unique(faces)]
            misses.append(np.abs(mapping.carry(frame.to_world(V)).stratigraphic - level))
        miss = np.concatenate(misses)
        miss = miss[np.isfinite(miss)]
        found[name] = float(miss.mean()) if len(miss) else None
    return found


def flat_size(fits: Sequence[BodyFit], carried: Carried, frame: Frame) -> dict[str, float | None]:
    """Return length, width and thickness of the unfolded body, in the data's unit.

    Length and width are the extents of the blocks' centroids along their principal axes in plan,
    and a block's side; the thickness is the median over the hull's top and bottom.
    """
    plan = carried.points[carried.placed][:, :2]
    centred = plan - plan.mean(axis=0) if len(plan) else plan
    return flat_extents(fits, plan, centred.T @ centred, frame)


def flat_extents(
    fits: Sequence[BodyFit], plan: Floats, square: Floats, frame: Frame
) -> dict[str, float | None]:
    """Return the sizes of `flat_size` from flat places.

    Parameters
    ----------
    fits, frame
        As `flat_size` takes them.
    plan : (n, 2) float
        Places in plan of the blocks, or of those at the surface.
    square : (2, 2) float
        Sum of the squared distances of all blocks from their mean.
    """
    scale = frame.scale
    thick = [fit.signs.thickness for fit in fits if fit.signs is not None]
    known = [float(t) for t in thick if np.isfinite(t)]
    if len(plan) < 2:
        return {"length": None, "width": None, "thickness": None}
    centred = plan - plan.mean(axis=0)
    axes = np.linalg.eigh(square)[1]
    width, length = (np.ptp(centred @ axes, axis=0) + scale).tolist()
    thickness = float(np.median(known)) * scale if known else None
    return {"length": max(length, width), "width": min(length, width), "thickness": thickness}
