"""What every flattener takes and returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from geounfold.mesh import Floats, TriMesh


class Stop(StrEnum):
    """Why a flattener stopped."""

    CONVERGED = "converged"
    MAX_ITER = "max_iter"
    DIRECT = "direct"
    THESIS_RULE = "thesis_rule"


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
        One value per recorded step: the method's energy, the relative area difference E_s
        (Wang 2002) and the root mean square edge strain.
    flips : int
        Triangles whose flat area is not positive.
    note : str
        What the method had to do beyond its plain course (a fall-back, a safeguard); else empty.
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
