"""How much of a body's rim each limit takes, so that one that misses the rim is seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold.body.fault_surface import FaultWalls
from geounfold.faults.limits import NEAR, FoundLimit
from geounfold.geometry.measures import face_normals, triangle_areas
from geounfold.geometry.mesh import Bools, Floats
from geounfold.io.messages import counted
from geounfold.methods import BodyFit

_MOST_OF_IT = 0.5
"""Share of the rim near a limit that the limit takes at least, else it is warned of.

Measured on a plane layer cut off upright, the limit moved off the cut: 1 up to 0.5 blocks, 0.79
at 0.75 blocks, 0 from 1 block on.
"""


@dataclass(frozen=True)
class LimitRim:
    """What one limit takes of the rim.

    Attributes
    ----------
    name : str
        Of the limit.
    blocks : int
        Blocks whose centres are within 1.4 blocks of it.
    share : float
        Share of the rim's area, of all bodies, that is at it and so withheld from the fit.
    of_near : float
        Share of the rim within 2.5 blocks that looks at it and is at it; 1 if none is near.
    rim : float
        Median distance of that near rim from it, in the data's unit; NaN if none is near.
    nearest : float
        Distance of the nearest block's centre, in the data's unit.
    used : bool
        False for the side of a box or polygon that no block is near.
    """

    name: str
    blocks: int
    share: float
    of_near: float
    rim: float
    nearest: float
    used: bool

    @property
    def missed(self) -> bool:
        """Whether blocks are near, but most of the rim there is not at the limit."""
        return self.used and (self.share == 0 or self.of_near < _MOST_OF_IT)

    def row(self) -> dict[str, Any]:
        """Return the row of the summary."""
        return {
            "limit": self.name,
            "used": self.used,
            "blocks": self.blocks,
            "rim_share": self.share,
            "rim_distance": None if np.isnan(self.rim) else self.rim,
            "nearest_block": self.nearest,
        }

    def warning(self) -> str:
        """Return the sentence of a limit that misses the rim."""
        off = (
            f"no rim looks at it (the nearest block is {self.nearest:.4g} away)"
            if np.isnan(self.rim)
            else f"the rim that looks at it is {self.rim:.4g} away"
        )
        return (
            f"limit {self.name} takes {self.share:.1%} of the rim and changes little or nothing: "
            f"{off}; a limit passes within half a block of the faces of the blocks that it cut off"
        )


def limit_rims(
    found: Sequence[FoundLimit],
    walls: Sequence[FaultWalls | None],
    fits: Sequence[BodyFit],
    scale: float,
) -> tuple[LimitRim, ...]:
    """Return what each limit takes of the rim.

    Parameters
    ----------
    found : sequence of FoundLimit
        The limits given.
    walls : sequence of FaultWalls or None
        Of every body.
    fits : sequence of BodyFit
        Of every body, working units.
    scale : float
        Length of a working unit in the data's.
    """
    rims = [_Rim.of(fit) for fit in fits]
    total = sum(float(rim.area.sum()) for rim in rims)
    return tuple(
        _taken(limit, list(zip(walls, rims, strict=True)), total, scale) for limit in found
    )


@dataclass(frozen=True, eq=False)
class _Rim:
    """Faces of a hull's rim: centres, normals and areas in cells of ``unit`` blocks a side."""

    centres: Floats
    normals: Floats
    area: Floats
    unit: float

    @classmethod
    def of(cls, fit: BodyFit) -> _Rim:
        unit = float(str(fit.notes.get("merged", 1)))
        mesh = fit.split.scaled(1 / unit).mesh
        F = mesh.F[fit.split.rim]
        area = triangle_areas(mesh.V, F) * unit**2
        return cls(mesh.V[F].mean(axis=1), face_normals(mesh.V, F), area, unit)


def _taken(
    limit: FoundLimit,
    bodies: Sequence[tuple[FaultWalls | None, _Rim]],
    total: float,
    scale: float,
) -> LimitRim:
    near, at, far = [], [], []
    for wall, rim in _ended(limit.name, bodies):
        looks: Bools = wall.at_faces(rim.centres, rim.normals, NEAR)
        near.append(rim.area[looks])
        at.append(rim.area[wall.at_faces(rim.centres, rim.normals)])
        far.append(wall.surfaces[0].sides(rim.centres[looks]).distance * rim.unit)
    beside, taken = sum(float(a.sum()) for a in near), sum(float(a.sum()) for a in at)
    return LimitRim(
        name=limit.name,
        blocks=limit.blocks,
        share=taken / total if total else 0.0,
        of_near=taken / beside if beside else 1.0,
        rim=float(np.median(np.concatenate(far)) * scale) if beside else np.nan,
        nearest=limit.nearest * scale,
        used=limit.used,
    )


def _ended(
    name: str, bodies: Sequence[tuple[FaultWalls | None, _Rim]]
) -> Iterator[tuple[FaultWalls, _Rim]]:
    """Yield, for every body that a limit ends, the limit in the rim's unit, and the rim."""
    for walls, rim in bodies:
        if walls is not None and (alone := walls.named(name)) is not None:
            yield alone.scaled(1 / rim.unit), rim


def limits_told(rows: Sequence[dict[str, Any]]) -> str:
    """Return the closing line's words, from the rows of the summary.

    Examples
    --------
    >>> limits_told([{"limit": "east", "used": True, "blocks": 260, "rim_share": 0.169}])
    'east takes 17% of the rim (260 blocks)'
    """
    told = [
        f"{row['limit']} takes {row['rim_share']:.0%} of the rim "
        f"({counted(row['blocks'], 'block')})"
        for row in rows
        if row["used"]
    ]
    off = sum(not row["used"] for row in rows)
    return ", ".join(told + ([f"{counted(off, 'side')} near no block"] if off else []))
