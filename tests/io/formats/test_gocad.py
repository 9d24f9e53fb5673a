"""GOCAD files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geounfold.io import read_points, write_surface
from geounfold.io.surfaces import read_surface_with_meta
from tests.places import shared

# By SOURCE.md: vertices and triangles of surfaces written by GOCAD.
TSURFS = {
    "ETRA-NFTS-DTMT-Deep_detachment-CFM5_1000m.ts": (1551, 2956),
    "OCBA-PVFZ-MULT-Palos_Verdes_fault-CFM6_1000m.ts": (3510, 6303),
}


@pytest.mark.parametrize("name", TSURFS)
def test_surfaces_by_gocad(name: str, tmp_path: Path) -> None:
    path = shared("data", "scec_cfm", name)
    mesh, meta = read_surface_with_meta(path)
    assert (len(mesh.V), len(mesh.F)) == TSURFS[name]
    assert meta == {"unit": "m"}
    rows = [line.split() for line in path.read_text().splitlines()]
    corners = {int(r[1]): [float(v) for v in r[2:5]] for r in rows if r[:1] == ["VRTX"]}
    last = [r for r in rows if r[:1] == ["TRGL"]][-1][1:4]
    assert mesh.V[mesh.F[-1]].tolist() == [corners[int(k)] for k in last]
    write_surface(tmp_path / "again.ts", mesh, meta)
    again, same = read_surface_with_meta(tmp_path / "again.ts")
    np.testing.assert_array_equal(again.V, mesh.V)
    np.testing.assert_array_equal(again.F, mesh.F)
    assert same == meta


def test_gocad_properties_depths_and_atoms(tmp_path: Path) -> None:
    (tmp_path / "v.vs").write_text(
        "GOCAD VSet 1\nHEADER {\nname: PVRTX 1 2, O'Brien's\n}\nGOCAD_ORIGINAL_COORDINATE_SYSTEM\n"
        'NAME "UTM 11"\n'
        'PROJECTION Unknown\nDATUM "NAD 27"\nAXIS_UNIT "ft" "ft" "ft"\nZPOSITIVE Depth\n'
        'END_ORIGINAL_COORDINATE_SYSTEM\nPROPERTIES Cu "dip vector"\nESIZES 1 2\n'
        "NO_DATA_VALUES -1 -1\nSUBVSET\nPVRTX 5 10 20 30 1.5 0.1 0.2\nVRTX 6 11 21 31\n"
        "PATOM 9 5 -1 3 4\nEND\n"
    )
    table = read_points(tmp_path / "v.vs")
    assert table.points.tolist() == [[10, 20, -30], [11, 21, -31], [10, 20, -30]]
    np.testing.assert_array_equal(table.numbers("Cu"), [1.5, np.nan, np.nan])
    np.testing.assert_array_equal(table.numbers("dip vector_1"), [0.2, np.nan, 4.0])
    assert table.meta == {"unit": "ft", "crs": "UTM 11 NAD 27"}
