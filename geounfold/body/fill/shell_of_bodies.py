"""The surface of a solid, divided among the bodies that its blocks make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from geounfold.body.fill.shell import Shell
from geounfold.body.prepare import BodyPoints, PreparedPoints


def with_shells(
    bodies: Sequence[BodyPoints], prepared: PreparedPoints, shell: Shell | None
) -> list[BodyPoints]:
    """Return the bodies with the surface around each, working units.

    Sheet parts get none, because the surface goes around all of them.
    """
    if shell is None or prepared.division is not None:
        return list(bodies)
    out = []
    for body, rows in zip(bodies, prepared.groups, strict=True):
        found = shell.around(prepared.points[rows])
        if found is not None:
            found = found.with_vertices(prepared.frame.to_work(found.V))
        out.append(replace(body, shell=found))
    return out


def horizons_of_blocks(
    bodies: Sequence[BodyPoints], prepared: PreparedPoints, shell: Shell | None
) -> str:
    """Return why bodies do not get the solid's surface; empty if they do, or lose nothing by it.

    Nothing is lost if the surface is that of its blocks.
    """
    if shell is None or shell.blocks is not None or all(b.shell is not None for b in bodies):
        return ""
    reason = "has an edge of four triangles, or its blocks lie in several parts"
    if prepared.division is not None:
        reason = f"goes around {prepared.division.count} sheet parts"
    return f"the horizons are those of the blocks, not of the solid's surface, which {reason}"
