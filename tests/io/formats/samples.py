"""Points and surfaces to write, and the libraries that a format needs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.geometry.mesh import TriMesh
from geounfold.io.tables.points import PointTable

NEEDS = {".omf": "omf", ".geoh5": "geoh5py", ".dxf": "ezdxf"}

# National-grid coordinates in feet, as single precision cannot hold them.
XYZ = np.array(
    [[2296021.09, 414095.85, 1 / 3], [2296031.1, 414095.8, -5e-324 + 1590.1], [2296021.0, 4e5, 0.0]]
)


def needs(kind: str) -> None:
    if kind in NEEDS:
        reason = f"{NEEDS[kind]} (extra formats) is not installed"
        pytest.importorskip(NEEDS[kind], reason=reason, exc_type=ImportError)


def needs_omf_1() -> None:
    needs(".omf")
    import omf

    if not hasattr(omf, "OMFWriter"):
        pytest.skip("the omf at hand writes the layout of 2.0.0a0 (see test_omf)")


def points_frame() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "x": XYZ[:, 0],
            "y": XYZ[:, 1],
            "z": XYZ[:, 2],
            "au": [0.1, np.nan, -999.0],
            "count": [1, -2, 2**31 - 10],
            "rock": ["ore", "", "größer 1"],
        }
    )


def tetrahedron() -> TriMesh:
    """Four vertices in no order of their coordinates, four triangles: closed and outward."""
    V = np.vstack([XYZ, [2296024.7, 414001.3, 900.123456789]])
    return TriMesh(V, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))


def by_corners(mesh: TriMesh) -> list[list[float]]:
    """Return triangles as corners, each turned to begin with its least, in order."""
    corners = [
        min((face[k:] + face[:k] for k in range(3)), key=lambda f: f[0])
        for face in mesh.V[mesh.F].tolist()
    ]
    return sorted(corners)


def sides(table: PointTable) -> np.ndarray:
    return table.frame[["dx", "dy", "dz"]].to_numpy()


def places(table: PointTable) -> list[list[int]]:
    rows: list[list[int]] = table.frame[["i", "j", "k"]].to_numpy().tolist()
    return rows
