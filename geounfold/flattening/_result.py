"""Result of every flattener."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from geounfold.flattening._border import Border, border_of
from geounfold.geometry.mesh import Floats, Ints, TriMesh


class Stop(StrEnum):
    """Why a flattener stopped."""

    CONVERGED = "converged"
    MAX_ITER = "max_iter"
    DIRECT = "direct"
    THESIS_RULE = "thesis_rule"
    STALLED = "stalled"


@dataclass(frozen=True, eq=False)
class Flattening:
    """A surface laid flat.

    Attributes
    ----------
    mesh : TriMesh
        The folded surface, (n, 3) vertices.
    uv : (n, 2) float
        Flat positions in the same vertex order and unit; centred at zero; counter-clockwise
        like the folded faces (never mirrored).
    method : str
        Name in the table of flatteners.
    stop : Stop
        Why it stopped.
    iterations : int
        Steps taken; 0 for a direct solve.
    energy, area_error, edge_error : (k,) float
        One value per recorded step: the method's energy, the relative area difference E_s (Wang
        2002) and the root mean square edge strain.  If the answer is that of a fall-back, these and
        ``stop`` are the fall-back's too.
    flips : int
        Triangles whose flat area is not positive, by an exact predicate.
    note : str
        Fall-back or safeguard that was needed; else empty.
    loops : tuple of (b,) int
        Border loops in face direction, the longest first.
    """

    mesh: TriMesh
    uv: Floats
    method: str
    stop: Stop
    iterations: int
    flips: int
    energy: Floats = field(default_factory=lambda: np.empty(0))
    area_error: Floats = field(default_factory=lambda: np.empty(0))
    edge_error: Floats = field(default_factory=lambda: np.empty(0))
    note: str = ""
    loops: tuple[Ints, ...] = ()

    @cached_property
    def border(self) -> Border:
        """Faults of the flat border; computed once."""
        return border_of(self.uv, self.loops)

    @property
    def overlaps(self) -> int:
        """Return the number of pairs of border edges whose flat images meet, by exact tests.

        If there are none, border loops of the wrong direction (a hole turned inside out) are
        counted instead.
        """
        return self.border.overlaps

    @property
    def one_to_one(self) -> bool:
        """Return whether the flat map is proved to be one-to-one: no flips and no overlaps.

        An orientation-preserving map, linear on triangles, of a disk (holes allowed) is
        one-to-one if its border is (Lipman, arXiv 1310.0955; proof in ``_border``).
        """
        return self.flips == 0 and self.overlaps == 0
