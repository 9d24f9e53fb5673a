"""Every export of the table in the docs, by a file made to its published layout.

The truth of each is the same eight blocks of 10 x 20 x 5 m (or points), written by hand in the
layout of the row.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.io import read_points, read_surface
from geounfold.io.block_sizes import Sides, size_columns
from geounfold.io.packages.datamine import frame_in
from geounfold.io.packages.exports import EXPORTS, table
from geounfold.io.strings import read_strings
from tests.io.formats.samples import needs
from tests.shapes import grid_cells

XYZ = (grid_cells(2, 2, 2) + 0.5) * [10.0, 20.0, 5.0] + [412000.0, 6815600.0, 1500.0]
AU = np.arange(8) / 4
DOCS = Path(__file__).parents[3] / "docs" / "how-to" / "exports.md"


def rows(pattern: str, xyz: Floats = XYZ, separator: str = "\n") -> str:
    """Return a line for every block: {x}, {y}, {z} and {au} filled in."""
    made = [
        pattern.format(x=f"{x:.3f}", y=f"{y:.3f}", z=f"{z:.3f}", au=f"{au:g}")
        for (x, y, z), au in zip(xyz.tolist(), AU.tolist(), strict=True)
    ]
    return separator.join(made) + "\n"


Case = tuple[str, str, bool]
"""File's name, content, and whether it holds the blocks' sides."""

TABLES: dict[tuple[str, str], list[Case]] = {
    ("Vulcan", "Model to CSV"): [
        (
            "v.csv",
            "centroid_x,centroid_y,centroid_z,dim_x,dim_y,dim_z,volume,au,rock\n"
            "variable descriptions:,,,,,,,gold,code\nvariable types:,,,,,,,double,name\n"
            "variable defaults:,,,,,,,-99.0,none\n" + rows("{x},{y},{z},10,20,5,1000,{au},fresh"),
            True,
        )
    ],
    ("Vulcan", "Export ASCII with header"): [
        (
            "v.asc",
            "  xcentre  ycentre  zcentre  xlength  ylength  zlength  au\n"
            + rows("  {x}  {y}  {z}  10.0  20.0  5.0  {au}"),
            True,
        )
    ],
    ("Micromine", "Block model, CSV"): [
        (
            "m.csv",
            "EAST,_EAST,NORTH,_NORTH,RL,_RL,AU\nREAL,REAL,REAL,REAL,REAL,REAL,REAL\n"
            "412000,10,6815600,20,1500,5,Centre\n" + rows("{x},10,{y},20,{z},5,{au}"),
            True,
        ),
        ("m2.csv", "EAST,NORTH,RL,_EAST,_NORTH,_RL,AU\n" + rows("{x},{y},{z},10,20,5,{au}"), True),
    ],
    ("Datamine", "Block model, CSV"): [
        (
            "d.csv",
            "IJK,XC,YC,ZC,XINC,YINC,ZINC,XMORIG,YMORIG,ZMORIG,NX,NY,NZ,AU\n"
            + rows("0,{x},{y},{z},10,20,5,412000,6815600,1500,2,2,2,{au}"),
            True,
        )
    ],
    ("Datamine", "Points of strings or wireframes, CSV"): [
        ("s.csv", "XPT,YPT,ZPT,PTN,PVALUE\n" + rows("{x},{y},{z},1,{au}"), False),
        ("w.csv", "PID,XP,YP,ZP\n" + rows("1,{x},{y},{z}"), False),
    ],
    ("Leapfrog", "Block model, CSV with embedded header"): [
        (
            "l.csv",
            "# Block model: main\n# base_point: (412000.0, 6815600.0, 1510.0)\n"
            "# parent_block_size: 10, 20, 5\n#\nX,Y,Z,dX,dY,dZ,GM: lithology,Au est\n"
            + rows("{x},{y},{z},10,20,5,FRESH,{au}"),
            True,
        )
    ],
    ("Leapfrog", "Block model, CSV with text header, or as points"): [
        ("l.csv", "X,Y,Z,Au est\n" + rows("{x},{y},{z},{au}"), False)
    ],
    ("Surpac", "Block model, CSV"): [
        ("s.csv", "Y,X,Z,_Y,_X,_Z,au\n" + rows("{y},{x},{z},20,10,5,{au}"), True),
        ("s.csv", "ycentre,xcentre,zcentre,au\n" + rows("{y},{x},{z},{au}"), False),
    ],
    ("Deswik", "Block model, CSV"): [
        ("d.csv", "x_centre,y_centre,z_centre,x_length,y_length,z_length\n"
         + rows("{x},{y},{z},10,20,5"), True),
        ("d.csv", "MIDX,MIDY,MIDZ,AU\n" + rows("{x},{y},{z},{au}"), False),
    ],
    ("MinePlan, GEMS", "Block model, text"): [
        ("e.txt", "EASTING NORTHING ELEV AU\n" + rows("{x} {y} {z} {au}"), False),
        ("e.csv", "ROW;COL;LEVEL;East;North;Elevation\n" + rows("1;1;1;{x};{y};{z}"), False),
    ],
    ("GSLIB, SGeMS", "Point set"): [
        ("p.dat", "points\n4\nX\nY\nZ\nau\n" + rows("{x} {y} {z} {au}"), False),
        ("p.txt", "points\n4\nX\nY\nZ\nau\n" + rows("{x} {y} {z} {au}"), False),
    ],
    ("GIFtools", "XYZ"): [
        ("g.xyz", "! made by hand\n% twice\nX Y Z Field\n" + rows("{x}  {y}\t{z} {au}"), False)
    ],
    ("MassFlow", "Mine block file"): [
        ("m.txt", '"Delimiter: r;"\nEasting\tNorthing\tElevation\tUCS\n0\n'
         + rows("{x}\t{y}\t{z}\t{au}"), False),
        ("m.csv", "Easting,Northing,Elevation,UCS\n" + rows("{x},{y},{z},{au}"), False),
    ],
    ("Isatis", "ASCII with header"): [
        ("i.asc", "# structure=free\n# X Y Z au\n" + rows("{x} {y} {z} {au}"), False),
        ("j.asc", "# structure=free\n#\nX Y Z au\n" + rows("{x} {y} {z} {au}"), False),
    ],
}  # fmt: skip


@pytest.mark.parametrize("key", TABLES, ids=" ".join)
def test_tables_are_read_as_they_come(tmp_path: Path, key: tuple[str, str]) -> None:
    for name, content, sized in TABLES[key]:
        (tmp_path / name).write_text(content)
        found = read_points(tmp_path / name)
        np.testing.assert_allclose(found.points, XYZ, rtol=0, atol=1e-9)
        sides = size_columns(found.names)
        assert (sides is not None) == sized
        if sides is not None:
            assert (Sides(sides).of(found.frame) == [10.0, 20.0, 5.0]).all()


def rotated(tmp_path: Path) -> None:
    names = "XC,YC,ZC,X0,Y0,Z0,ANGLE1,ANGLE2,ANGLE3,ROTAXIS1,ROTAXIS2,ROTAXIS3\n"
    own = (grid_cells(2, 2, 2) + 0.5) * [10.0, 20.0, 5.0]
    text = names + rows("{x},{y},{z},412000,6815600,1500,90,0,0,3,0,0", own)
    (tmp_path / "d.csv").write_text(text)
    found = frame_in(tmp_path / "d.csv")
    assert found is not None
    # A quarter turn clockwise: the model's y points east, its x south.
    x, y, z = own.T
    world = np.column_stack([412000 + y, 6815600 - x, 1500 + z])
    np.testing.assert_allclose(found.frame.to_world(own), world, atol=1e-6)
    (tmp_path / "d.csv").write_text(text.replace(",3,0,0", ",1,0,0"))
    with pytest.raises(InputError, match="--origin X,Y,Z and --rotation"):
        frame_in(tmp_path / "d.csv")
    beside = names.replace("\n", ",XWORLD,YWORLD,ZWORLD\n")
    pattern = "1,2,3,412000,6815600,1500,90,0,0,3,0,0,{x},{y},{z}"
    (tmp_path / "w.csv").write_text(beside + rows(pattern))
    assert frame_in(tmp_path / "w.csv") is None
    np.testing.assert_allclose(read_points(tmp_path / "w.csv").points, XYZ, atol=1e-9)


def surpac_strings(tmp_path: Path) -> None:
    body = rows("1, {y}, {x}, {z}, ore,")
    end = "0, 0.000, 0.000, 0.000,\n0, 0.000, 0.000, 0.000, END\n"
    zero = "0, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000\n"
    (tmp_path / "s.str").write_text(f"s,01-Jan-24,,\n{zero}{body}{end}")
    np.testing.assert_allclose(read_strings(tmp_path / "s.str").xyz, XYZ, atol=1e-9)


def drawing(tmp_path: Path) -> None:
    needs(".dxf")
    import ezdxf

    for faces in (True, False):
        made = ezdxf.new("R2010")
        made.modelspace().add_polyline3d(XYZ.tolist())
        if faces:
            made.modelspace().add_3dface(XYZ[:3].tolist())
        made.saveas(tmp_path / "d.dxf")
        read = read_surface(tmp_path / "d.dxf").V if faces else read_strings(tmp_path / "d.dxf").xyz
        assert np.array_equal(read, XYZ[:3] if faces else XYZ)


def legacy(tmp_path: Path) -> None:
    import pyvista

    edges = [np.array([0.0, 10, 20]), np.array([0.0, 20, 40]), np.array([0.0, 5, 10])]
    grid = pyvista.RectilinearGrid(*edges)
    for made, name in (
        (grid, "g.vtr"), (grid.cast_to_structured_grid(), "g.vts"),
        (grid.cast_to_unstructured_grid(), "g.vtk"),
    ):  # fmt: skip
        made.save(tmp_path / name)
        found = read_points(tmp_path / name)
        moved = found.points + np.array([412000.0, 6815600.0, 1500.0])
        order = np.lexsort(moved.T[::-1])
        np.testing.assert_allclose(moved[order], XYZ[np.lexsort(XYZ.T[::-1])], atol=1e-9)
        assert (found.frame[["dx", "dy", "dz"]] == [10.0, 20.0, 5.0]).all(axis=None)


OTHERS: dict[tuple[str, str], Callable[[Path], None]] = {
    ("Datamine", "Rotated block model, CSV"): rotated,
    ("Surpac", "String file (.str)"): surpac_strings,
    ("AutoCAD and all packages", "DXF"): drawing,
    ("VTK, ParaView", "Legacy .vtk, .vtr, .vts"): legacy,
}


@pytest.mark.parametrize("key", OTHERS, ids=" ".join)
def test_other_files_are_read_as_they_come(tmp_path: Path, key: tuple[str, str]) -> None:
    OTHERS[key](tmp_path)


def test_vulcan_without_names_is_refused(tmp_path: Path) -> None:
    (tmp_path / "v.asc").write_text(rows("{x} {y} {z} 10 20 5 {au}"))
    with pytest.raises(InputError, match="first row must name the columns"):
        read_points(tmp_path / "v.asc")


def test_every_row_of_the_table_has_its_file() -> None:
    assert {(e.package, e.export) for e in EXPORTS} == {*TABLES, *OTHERS}
    assert table() in DOCS.read_text(encoding="utf-8")
