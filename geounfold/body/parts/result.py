"""What the search for sheet parts returns: a part per block, and the junctions."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.geometry.mesh import Floats, Ints

KINDS = ("branch", "split", "repeat", "step", "neck", "pipe")
"""Kinds of junctions.

``branch``: a sheet ends against the side of another. ``split``: two plies leave one doubled zone
on the same side of it (a parting). ``repeat``: they leave it on opposite sides (a thrust).
``step``: two sheets end against each other, one higher than the other (a fault without drag).
``neck``: two sheets, one above the other, are joined by a few blocks. ``pipe``: a rod through or
beside a sheet.
"""


@dataclass(frozen=True)
class Junction:
    """A place where sheet parts meet.

    Attributes
    ----------
    parts : (int, int)
        Numbers of the two parts; of a pipe, twice the one that carries its blocks.
    kind : str
        One of KINDS.
    place : (float, float, float)
        A block at the junction; working units, or the data's coordinates (see SheetParts).
    thickness : tuple of float
        Thickness of each part beside the junction, and of both together if the kind is ``split``
        or ``repeat``; the same unit as ``place``.
    """

    parts: tuple[int, int]
    kind: str
    place: tuple[float, float, float]
    thickness: tuple[float, ...]

    @property
    def sentence(self) -> str:
        """The junction in one sentence; thicknesses in the unit of ``place``."""
        where = ", ".join(f"{c:.6g}" for c in self.place)
        first, second = (f"{t:.3g}" for t in self.thickness[:2])
        if self.kind == "pipe":
            return f"a pipe {second} wide meets the sheet at {where} (pipe: no sheet)"
        if self.kind in ("split", "repeat"):
            how = f"{self.thickness[2]:.3g} = {first} + {second}"
        else:
            how = f"{first} and {second} thick"
        return f"2 sheets meet at {where} ({self.kind}: {how})"


@dataclass(frozen=True, eq=False)
class SheetParts:
    """The sheet parts of one body.

    Attributes
    ----------
    labels : (n,) int
        Part of each cell, 0 the largest sheet; -1 for a cell of no sheet.
    thickness : (k,) float
        Median thickness of each part, working units.
    junctions : tuple of Junction
        Places where parts meet.
    """

    labels: Ints
    thickness: Floats
    junctions: tuple[Junction, ...]

    @property
    def count(self) -> int:
        """Number of sheets."""
        return len(self.thickness)
