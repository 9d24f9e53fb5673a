"""Formats: what is written comes back, and what the formats' own libraries write is read."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import InputError, MissingDependencyError, OutputError
from geounfold.geometry.mesh import TriMesh
from geounfold.io import holds_surface, read_points, read_surface, read_table, write_surface
from geounfold.io.formats import FORMATS, find_format, point_endings, surface_endings
from geounfold.io.formats.registry import require
from geounfold.io.paths import TABLE_ENDINGS
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables.files import check_writable, write_table
from geounfold.io.tables.points import PointTable
from tests.places import SHARED_DATA

SCEC = SHARED_DATA / "scec_cfm"
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


# ------------------------------------------------------------------------------------ registry


def test_each_ending_is_one_format() -> None:
    for what in ("reads_points", "writes_points", "reads_surface", "writes_surface"):
        endings = sum((getattr(f, what) for f in FORMATS), ())
        assert len(set(endings)) == len(endings)
        assert not set(endings) & set(TABLE_ENDINGS)


def test_every_module_offers_what_it_is_registered_for() -> None:
    for f in FORMATS:
        module = f.load()
        for kind in ("points", "surface"):
            for verb in ("read", "write"):
                if getattr(f, f"{verb}s_{kind}"):
                    frame = "frame" if kind == "points" else kind
                    assert hasattr(module, f"{verb}_{kind}") or hasattr(module, f"{verb}_{frame}")


def test_a_missing_library_is_named_with_its_cure(tmp_path: Path) -> None:
    with pytest.raises(MissingDependencyError, match=r"no_such_library.*geounfold\[formats\]"):
        require("no_such_library.part", "Odd")
    for kind, name in NEEDS.items():
        if importlib.util.find_spec(name) is None:
            path = tmp_path / f"t{kind}"
            path.write_bytes(b"anything")
            if kind != ".omf":  # which is read without: see test_omf
                with pytest.raises(MissingDependencyError, match=name):
                    (read_surface if kind == ".dxf" else read_points)(path)
            if kind != ".dxf":
                with pytest.raises(MissingDependencyError, match=name):
                    check_writable(path, points_frame())


# ---------------------------------------------------------------------------------- round trips


@pytest.mark.parametrize("kind", [".csv", ".csv.gz", ".parquet", *point_endings(writing=True)])
def test_points_come_back_bit_for_bit(tmp_path: Path, kind: str) -> None:
    needs(kind)
    frame = points_frame()
    before = frame.copy()
    path = tmp_path / f"p{kind}"
    write_table(path, frame, columns=("x", "y", "z"))
    pd.testing.assert_frame_equal(frame, before)  # the writer leaves its input alone
    table = read_points(path)
    np.testing.assert_array_equal(table.points, XYZ)
    assert list(table.frame.columns) == list(frame.columns)
    np.testing.assert_array_equal(table.numbers("au"), frame["au"])  # -999 is a value, NaN missing
    np.testing.assert_array_equal(table.numbers("count"), frame["count"])
    found = find_format(kind, "writes_points")
    if found is not None and found.numbers_only:
        # Codes in the order of the alphabet: blank, größer 1, ore.
        assert table.numbers("rock").tolist() == [2.0, 0.0, 1.0]
        assert "rock: 0=(blank) 1=größer_1 2=ore" in path.read_text(encoding="utf-8")
    else:
        assert table.frame["rock"].tolist() == ["ore", "", "größer 1"]


def _by_corners(mesh: TriMesh) -> list[list[float]]:
    """Return triangles as corners, each turned to begin with its least, in order."""
    corners = [
        min((face[k:] + face[:k] for k in range(3)), key=lambda f: f[0])
        for face in mesh.V[mesh.F].tolist()
    ]
    return sorted(corners)


@pytest.mark.parametrize("kind", [".csv", ".parquet", *surface_endings(writing=True)])
def test_surfaces_come_back(tmp_path: Path, kind: str) -> None:
    needs(kind)
    mesh = tetrahedron()
    path = tmp_path / f"s{kind}"
    write_surface(path, mesh)
    again = read_surface(path)
    assert holds_surface(path) == (kind not in TABLE_ENDINGS)
    if kind == ".stl":  # single precision: half of the spacing of floats at 2.3 million, 0.25 / 2
        np.testing.assert_allclose(_by_corners(again), _by_corners(mesh), rtol=0, atol=0.125)
        assert len(again.V) == 4
    elif kind == ".dxf":  # no vertex numbers: the same triangles with the same orientation
        assert _by_corners(again) == _by_corners(mesh)
        assert len(again.V) == 4
    else:
        np.testing.assert_array_equal(again.V, mesh.V)
        np.testing.assert_array_equal(again.F, mesh.F)


@pytest.mark.parametrize("kind", [".vtu", ".vtp", ".vs", ".geoh5", ".omf"])
def test_unit_and_coordinate_reference_are_carried(tmp_path: Path, kind: str) -> None:
    needs(kind)
    if kind == ".omf":
        needs_omf_1()
    meta = {"unit": "ft", "crs": "EPSG:26711"}
    path = tmp_path / f"p{kind}"
    write_table(path, points_frame(), columns=("x", "y", "z"), meta=meta)
    # OMF 1 has no place for a coordinate reference.
    assert read_points(path).meta == ({"unit": "ft"} if kind == ".omf" else meta)


@pytest.mark.parametrize("kind", [".vtp", ".ts", ".geoh5", ".omf", ".dxf"])
def test_a_surfaces_unit_is_carried(tmp_path: Path, kind: str) -> None:
    needs(kind)
    write_surface(tmp_path / f"s{kind}", tetrahedron(), {"unit": "ft"})
    assert read_surface_with_meta(tmp_path / f"s{kind}")[1] == {"unit": "ft"}


def test_text_from_a_csv_gets_its_type(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("id,x,y,z,au\n007,1,2,3,0.5\nB,4,5,6,\n")
    table = read_points(tmp_path / "p.csv")
    table.write(tmp_path / "p.vtu", {"unfolded_x": np.array([9.0, 8.0])})
    again = read_points(tmp_path / "p.vtu")
    assert again.frame["id"].tolist() == ["007", "B"]
    np.testing.assert_array_equal(again.numbers("au"), [0.5, np.nan])
    np.testing.assert_array_equal(again.numbers("unfolded_x"), [9.0, 8.0])


def test_a_value_called_as_a_coordinate_is_renamed(tmp_path: Path) -> None:
    frame = pd.DataFrame({"X": [7.0], "XC": [1.0], "YC": [2.0], "ZC": [3.0]})
    write_table(tmp_path / "p.vtu", frame, columns=("XC", "YC", "ZC"))
    table = read_points(tmp_path / "p.vtu")
    assert table.points.tolist() == [[1.0, 2.0, 3.0]]
    assert table.numbers("X_value").tolist() == [7.0]


@pytest.mark.parametrize("kind", [".gslib", ".vs"])
def test_names_do_not_become_codes(tmp_path: Path, kind: str) -> None:
    frame = pd.DataFrame({"x": 0.0, "y": 0.0, "z": 0.0, "id": [f"B{k}" for k in range(101)]})
    with pytest.raises(OutputError, match="column 'id' has 101 different texts"):
        check_writable(tmp_path / f"p{kind}", frame)
    with pytest.raises(OutputError, match="column 'id' has 101 different texts"):
        write_table(tmp_path / f"p{kind}", frame)


# -------------------------------------------------------------------------- by other programs


def test_gslib_as_in_the_book(tmp_path: Path) -> None:
    # The layout of Deutsch and Journel's cluster.dat, with the spacing that Fortran writes.
    (tmp_path / "cluster.dat").write_text(
        "Clustered 140 primary and secondary data\n4\nXlocation\nYlocation\nprimary\nsecondary\n"
        "   39.5    18.5        .06      .22\n    5.5     1.5        .06     -999.0\n"
    )
    with pytest.raises(InputError, match=r"no coordinate columns.*Xlocation"):
        read_points(tmp_path / "cluster.dat")
    table = read_table(tmp_path / "cluster.dat")
    # Nothing in such a file says that -999 is missing.
    assert table.frame["secondary"].tolist() == [0.22, -999.0]
    named = read_points(tmp_path / "cluster.dat", ("Xlocation", "Ylocation", "primary"))
    assert named.points.tolist() == [[39.5, 18.5, 0.06], [5.5, 1.5, 0.06]]


def test_vtk_block_models_are_their_cells_centres(tmp_path: Path) -> None:
    import pyvista

    image = pyvista.ImageData(dimensions=(4, 3, 2), spacing=(10.0, 5.0, 2.0), origin=(100, 200, 50))
    image.cell_data["grade"] = np.arange(6.0)
    image.cell_data["vector"] = np.arange(18.0).reshape(6, 3)
    image.save(tmp_path / "b.vti")
    # 3 x 2 x 1 cells, x fastest; the first centre is half a cell from the origin.
    table = read_points(tmp_path / "b.vti")
    assert table.points[0].tolist() == [105.0, 202.5, 51.0]
    assert table.points[4].tolist() == [115.0, 207.5, 51.0]
    assert table.numbers("grade").tolist() == list(range(6))
    assert table.numbers("vector_1").tolist() == [1, 4, 7, 10, 13, 16]
    # The same blocks as an unstructured grid, one of them taken out.
    grid = image.cast_to_unstructured_grid().extract_cells([0, 1, 2, 3, 5])
    grid.save(tmp_path / "b.vtu")
    blocks = read_points(tmp_path / "b.vtu")
    np.testing.assert_allclose(blocks.points, table.points[[0, 1, 2, 3, 5]], rtol=1e-15)
    assert blocks.numbers("grade").tolist() == [0, 1, 2, 3, 5]


def sides(table: PointTable) -> np.ndarray:
    return table.frame[["dx", "dy", "dz"]].to_numpy()


def places(table: PointTable) -> list[list[int]]:
    rows: list[list[int]] = table.frame[["i", "j", "k"]].to_numpy().tolist()
    return rows


def test_vtk_blocks_bring_their_sides(tmp_path: Path) -> None:
    import pyvista

    image = pyvista.ImageData(dimensions=(4, 3, 2), spacing=(10.0, 5.0, 2.0), origin=(100, 200, 50))
    image.cell_data["grade"] = np.arange(6.0)
    image.direction_matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # its x along y, its y against x
    image.save(tmp_path / "b.vti")
    turned = read_points(tmp_path / "b.vti")
    assert turned.points[1].tolist() == [97.5, 215.0, 51.0]
    assert places(turned) == [[i, j, 0] for j in range(2) for i in range(3)]
    assert (sides(turned) == [10.0, 5.0, 2.0]).all()
    # The same as voxels, and as hexahedra, which have another order of corners.
    grid = image.cast_to_unstructured_grid()
    grid.save(tmp_path / "b.vtu")
    voxels = read_points(tmp_path / "b.vtu")
    np.testing.assert_allclose(sides(voxels), sides(turned), rtol=1e-14)
    assert "i" not in voxels.frame  # nothing says in which row a loose cell stands
    corners = grid.cell_connectivity.reshape(-1, 8)[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    cells = np.column_stack([np.full(6, 8), corners]).ravel()
    kinds = np.full(6, pyvista.CellType.HEXAHEDRON)
    boxes = pyvista.UnstructuredGrid(cells, kinds, np.asarray(grid.points))
    boxes.save(tmp_path / "h.vtu")
    np.testing.assert_allclose(sides(read_points(tmp_path / "h.vtu")), sides(turned), rtol=1e-14)
    # In single precision too: rounding at 200 is 2^-17 at most, of sides of 2 and more.
    single = boxes.copy()
    single.points = np.asarray(grid.points, dtype=np.float32)
    single.save(tmp_path / "s.vtu")
    np.testing.assert_allclose(sides(read_points(tmp_path / "s.vtu")), sides(turned), rtol=1e-5)
    # Sheared by a tenth of a degree, or with one corner moved, they are no boxes.
    for move in (lambda p: p[:, 0] + 0.0017 * p[:, 2], lambda p: p[:, 0] + (p[:, 0] == p[0, 0])):
        boxes.points = np.asarray(grid.points)
        boxes.points[:, 0] = move(np.asarray(grid.points))
        boxes.save(tmp_path / "h.vtu")
        assert "dx" not in read_points(tmp_path / "h.vtu").frame


def test_sides_in_the_file_stay_as_they_are(tmp_path: Path) -> None:
    import pyvista

    image = pyvista.ImageData(dimensions=(3, 2, 2), spacing=(10.0, 5.0, 2.0))
    for own, added in (
        (("XINC", "YINC", "ZINC"), {"i", "j", "k"}),  # another name for the same
        (("dx",), {"i", "j", "k"}),  # not all three, but one is taken
        (("I",), {"dx", "dy", "dz"}),
        (("grade",), {"dx", "dy", "dz", "i", "j", "k"}),
    ):
        named = image.copy()
        for name in own:
            named.cell_data[name] = np.array([7.0, 7.0])
        named.save(tmp_path / "b.vti")
        frame = read_points(tmp_path / "b.vti").frame
        assert set(frame.columns) == {"x", "y", "z", *own} | added
        assert (frame[own[0]] == 7.0).all()


@pytest.mark.parametrize("kind", [".vtp", ".ply", ".stl"])
def test_surfaces_by_vtk(tmp_path: Path, kind: str) -> None:
    import pyvista

    mesh = pyvista.Sphere(radius=10.0, theta_resolution=8, phi_resolution=8)
    mesh.save(tmp_path / f"s{kind}")
    surface = read_surface(tmp_path / f"s{kind}")
    faces = mesh.regular_faces
    # VTK's sphere is in single precision itself, so nothing is lost in any of these.
    ours = TriMesh(np.asarray(mesh.points, dtype=np.float64), faces.astype(np.int64))
    assert _by_corners(surface) == _by_corners(ours)


@pytest.mark.parametrize("kind", [".ply", ".obj", ".stl", ".vtp"])
def test_vtk_reads_our_surfaces(tmp_path: Path, kind: str) -> None:
    import pyvista

    mesh = tetrahedron()
    write_surface(tmp_path / f"s{kind}", mesh)
    theirs = pyvista.read(tmp_path / f"s{kind}")
    corners = np.asarray(theirs.points)[theirs.regular_faces]
    # VTK reads PLY, OBJ and STL in single precision.
    atol = 0 if kind == ".vtp" else 0.125
    np.testing.assert_allclose(corners, mesh.V[mesh.F], rtol=0, atol=atol)


# By SOURCE.md: vertices and triangles of surfaces written by GOCAD.
TSURFS = {
    "ETRA-NFTS-DTMT-Deep_detachment-CFM5_1000m.ts": (1551, 2956),
    "OCBA-PVFZ-MULT-Palos_Verdes_fault-CFM6_1000m.ts": (3510, 6303),
}


@pytest.mark.parametrize("name", TSURFS)
def test_surfaces_by_gocad(name: str, tmp_path: Path) -> None:
    if not SCEC.is_dir():
        pytest.skip("the SCEC surfaces are not beside this checkout")
    mesh, meta = read_surface_with_meta(SCEC / name)
    assert (len(mesh.V), len(mesh.F)) == TSURFS[name]
    assert meta == {"unit": "m"}
    rows = [line.split() for line in (SCEC / name).read_text().splitlines()]
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


def test_omf_by_its_library(tmp_path: Path) -> None:
    needs_omf_1()
    import omf

    project = omf.Project(name="p", units="feet", origin=[100.0, 0.0, 0.0])
    scalar = omf.ScalarData(name="au", location="vertices", array=np.array([1.0, np.nan, 3.0]))
    words = omf.StringData(name="rock", location="vertices", array=["a", "b", ""])
    legend = omf.Legend(values=omf.StringArray(array=["low", "high"]))
    mapped = omf.MappedData(
        name="class", location="vertices", array=np.array([1, 0, -1]), legends=[legend]
    )
    project.elements = [
        omf.PointSetElement(
            name="holes",
            geometry=omf.PointSetGeometry(vertices=XYZ, origin=[0.0, 0.0, 7.0]),
            data=[scalar, words, mapped],
        ),
        omf.SurfaceElement(
            name="top",
            geometry=omf.SurfaceGeometry(vertices=XYZ, triangles=np.array([[0, 1, 2]])),
        ),
    ]
    path = tmp_path / "p.omf"
    omf.OMFWriter(project, str(path))
    table = read_points(path)
    np.testing.assert_array_equal(table.points, XYZ + np.array([100.0, 0.0, 7.0]))
    np.testing.assert_array_equal(table.numbers("au"), [1.0, np.nan, 3.0])
    assert table.frame["rock"].tolist() == ["a", "b", ""]
    assert table.frame["class"].tolist() == ["high", "low", ""]
    assert table.meta == {"unit": "ft"}
    np.testing.assert_array_equal(read_surface(path).V, XYZ + np.array([100.0, 0.0, 0.0]))

    # And what we write is valid to it.
    write_table(tmp_path / "q.omf", points_frame(), columns=("x", "y", "z"))
    theirs = omf.OMFReader(str(tmp_path / "q.omf")).get_project()
    assert theirs.validate()
    np.testing.assert_array_equal(theirs.elements[0].geometry.vertices.array, XYZ)
    (tmp_path / "two.omf").write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError, match="version 2"):
        read_points(tmp_path / "two.omf")


def test_omf_volumes_are_their_cells_centres(tmp_path: Path) -> None:
    needs_omf_1()
    import omf

    grade = np.arange(24.0).reshape(2, 3, 4)  # u, v, w, as the library's own examples order them
    geometry = omf.VolumeGridGeometry(
        tensor_u=np.full(2, 10.0), tensor_v=np.full(3, 5.0),
        tensor_w=np.array([1.0, 2.0, 1.0, 1.0]),
        axis_u=[0.0, 1.0, 0.0], axis_v=[-1.0, 0.0, 0.0], axis_w=[0.0, 0.0, 1.0],
        origin=[100.0, 200.0, 0.0],
    )  # fmt: skip
    data = omf.ScalarData(name="au", location="cells", array=grade.ravel())
    project = omf.Project(name="p", units="m")
    project.elements = [omf.VolumeElement(name="blocks", geometry=geometry, data=[data])]
    omf.OMFWriter(project, str(tmp_path / "v.omf"))
    table = read_points(tmp_path / "v.omf")
    at = int(np.flatnonzero(table.numbers("au") == grade[1, 2, 1])[0])
    # u = 15 goes along y, v = 12.5 against x, w = 2 (half of the second cell, after the first) up.
    assert table.points[at].tolist() == [87.5, 215.0, 2.0]


def test_geoh5_by_its_library(tmp_path: Path) -> None:
    needs(".geoh5")
    from geoh5py.objects import Points, Surface
    from geoh5py.workspace import Workspace

    path = tmp_path / "p.geoh5"
    with Workspace.create(path, distance_unit="feet") as workspace:
        made = Points.create(workspace, name="holes", vertices=XYZ)
        made.coordinate_reference_system = {"Code": "EPSG:26711", "Name": "NAD27 / UTM 11N"}
        made.add_data({"au": {"values": np.array([1 / 3, np.nan, 3.0])}})
        made.add_data({"rock": {"type": "text", "values": np.array(["a", "", "é"])}})
        Surface.create(workspace, name="top", vertices=XYZ, cells=np.array([[0, 1, 2]]))
    table = read_points(path)
    np.testing.assert_array_equal(table.points, XYZ)
    np.testing.assert_array_equal(table.numbers("au"), [1 / 3, np.nan, 3.0])
    assert table.frame["rock"].tolist() == ["a", "", "é"]
    assert table.meta == {"unit": "ft", "crs": "EPSG:26711"}
    np.testing.assert_array_equal(read_surface(path).F, [[0, 1, 2]])


def test_geoh5_block_models_bring_sides_and_places(tmp_path: Path) -> None:
    needs(".geoh5")
    from geoh5py.objects import BlockModel
    from geoh5py.workspace import Workspace

    path = tmp_path / "b.geoh5"
    with Workspace.create(path) as workspace:
        # Along z counted downwards from 50, as Geoscience ANALYST's own models are.
        made = BlockModel.create(
            workspace, name="blocks", origin=[100.0, 200.0, 50.0], rotation=90.0,
            u_cell_delimiters=np.array([0.0, 10.0, 30.0]),
            v_cell_delimiters=np.array([0.0, 5.0, 10.0, 15.0]),
            z_cell_delimiters=np.array([0.0, -1.0, -3.0]),
        )  # fmt: skip
        made.add_data({"au": {"association": "CELL", "values": np.arange(12.0)}})
        centroids = made.centroids.copy()
    table = read_points(path)
    np.testing.assert_array_equal(table.points, centroids)
    # The library turns counter-clockwise: u along y, v against x.
    at = places(table).index([1, 2, 1])
    np.testing.assert_allclose(table.points[at], [87.5, 220.0, 48.0], rtol=1e-14)
    assert sides(table)[at].tolist() == [20.0, 5.0, 2.0]
    assert sides(table).prod(axis=1).sum() == 30 * 15 * 3
    assert sorted(places(table)) == [
        [i, j, k] for i in range(2) for j in range(3) for k in range(2)
    ]
    # Each centroid by its own place: half-way through its cell along each axis.
    u, v, z = (np.array(d) for d in ([5.0, 20.0], [2.5, 7.5, 12.5], [-0.5, -2.0]))
    i, j, k = np.array(places(table)).T
    own = np.column_stack([100 - v[j], 200 + u[i], 50 + z[k]])
    np.testing.assert_allclose(table.points, own, rtol=1e-14)


def test_dxf_by_its_library(tmp_path: Path) -> None:
    needs(".dxf")
    import ezdxf
    from ezdxf.render import MeshBuilder

    drawing = ezdxf.new("R2000")
    drawing.units = 6
    space = drawing.modelspace()
    corners = [(0.0, 0.0, 0.1), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 1 / 3)]
    space.add_3dface(corners)
    builder = MeshBuilder()
    builder.vertices = [(5.0, 0.0, 0.0), (6.0, 0.0, 0.0), (5.0, 1.0, 0.0)]
    builder.faces = [(0, 1, 2)]
    builder.render_polyface(space)
    builder.render_mesh(space)
    space.add_line((0, 0), (1, 1))
    drawing.saveas(tmp_path / "w.dxf")
    mesh, meta = read_surface_with_meta(tmp_path / "w.dxf")
    # A quadrangle cut in two, and one triangle twice, at corners 4 to 6.
    assert mesh.F.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 5, 6]]
    assert mesh.V[:4].tolist() == [list(c) for c in corners]
    assert meta == {"unit": "m"}
    bare = ezdxf.new("R2000")
    bare.modelspace().add_line((0, 0), (1, 1))
    bare.saveas(tmp_path / "bare.dxf")
    with pytest.raises(InputError, match=r"no faces.*LINE"):
        read_surface(tmp_path / "bare.dxf")


# ------------------------------------------------------------------------------- damaged files


BAD = {
    "p.gslib": [
        b"title\nmany\n",
        b"title\n3\nx\ny\nz\n1 2\n",
        b"t\n3\nx\ny\nz\n1 2 a\n",
        b"\xff\xfe",
    ],
    "p.vtu": [b"hello", b"<VTKFile type='UnstructuredGrid'>", b"\0\1\2"],
    "p.vtp": [b"hello"],
    "p.vti": [b"hello"],
    "p.vs": [b"hello", b"GOCAD VSet 1\nVRTX 1 2\n", b"GOCAD VSet 1\nEND\n"],
    "p.omf": [b"hello", b"\x84\x83\x82\x81OMF-v0.9.0" + bytes(44)],
    "p.geoh5": [b"hello", b"\x89HDF\r\n\x1a\n" + bytes(40)],
}


@pytest.mark.parametrize("name", BAD)
def test_damaged_points_are_one_line(name: str, tmp_path: Path) -> None:
    needs(Path(name).suffix)
    for content in BAD[name]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name) as caught:
            read_points(tmp_path / name)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("s.ts", b"GOCAD TSurf 1\nVRTX 1 0 0 0\nTRGL 1 2 3\n"),
        ("s.ts", b"GOCAD TSurf 1\nVRTX 1 0 0 0\nEND\n"),
        ("s.vtp", b"hello"),
        ("s.dxf", b"hello"),
        ("s.omf", b"hello"),
        ("s.geoh5", b"hello"),
        ("s.ply", b"hello"),
        ("s.csv", b"x,y,z,v1,v2,v3\n0,0,0,1,2,3\n,,,1,2,3\n1,0,0,,,\n"),
        ("s.csv", b"x,y,z,v1,v2,v3\n0,0,0,1,2,3\n1,0,0,,,\n1,1,,,,\n"),
    ],
)
def test_damaged_surfaces_are_one_line(name: str, content: bytes, tmp_path: Path) -> None:
    needs(Path(name).suffix)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=name) as caught:
        read_surface(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_unknown_endings(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="unknown kind of surface"):
        write_surface(tmp_path / "s.xyz", tetrahedron())
    (tmp_path / "p.xyz").write_text("1 2 3")
    with pytest.raises(InputError, match=r"unknown kind of table '.xyz'.*\.gslib"):
        read_points(tmp_path / "p.xyz")


def test_several_objects_of_different_systems(tmp_path: Path) -> None:
    one = "GOCAD VSet 1\nAXIS_UNIT {u} {u} {u}\nVRTX 1 0 0 0\nEND\n"
    (tmp_path / "p.vs").write_text(one.format(u="m") + one.format(u="ft"))
    with pytest.raises(InputError, match="different units"):
        read_points(tmp_path / "p.vs")
    (tmp_path / "p.vs").write_text(one.format(u="m") * 2)
    assert len(read_points(tmp_path / "p.vs")) == 2


@pytest.mark.parametrize("kind", [".vtu", ".vtp", ".gslib", ".vs", ".omf", ".ply", ".dxf"])
def test_a_full_disk_is_an_error(kind: str, tmp_path: Path) -> None:
    needs(kind)
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("there is no /dev/full on this system")
    path = tmp_path / f"f{kind}"
    path.symlink_to(full)
    write: Callable[[], None] = partial(write_table, path, points_frame(), columns=("x", "y", "z"))
    if kind in (".ply", ".dxf"):
        write = partial(write_surface, path, tetrahedron())
    with pytest.raises(OSError, match="No space left"):
        write()


def test_columns_that_are_called_alike_are_both_kept(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x,y,z,au,au\n1,2,3,4,5\n")
    for kind in (".vtu", ".gslib", ".vs"):
        read_points(tmp_path / "p.csv").write(tmp_path / f"p{kind}", {})
        again = read_points(tmp_path / f"p{kind}")
        assert (again.numbers("au")[0], again.numbers("au_2")[0]) == (4.0, 5.0)


# ---------------------------------------------------------------------------- the command line


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, gu.Unfolding]:
    folder = tmp_path_factory.mktemp("formats")
    blocks = gu.simulate("sim_case_1", blocks=2000)
    write_table(folder / "X.csv", blocks.frame(4))
    write_table(
        folder / "X.vtu", blocks.frame(4), columns=("centroid_x", "centroid_y", "centroid_z")
    )
    unfolding = gu.unfold(read_points(folder / "X.csv").points)
    unfolding.save(folder / "m.npz")
    return folder, unfolding


@pytest.mark.parametrize("kind", [".vtu", ".gslib", ".vs", ".omf", ".geoh5"])
def test_map_writes_any_format(
    kind: str, saved: tuple[Path, gu.Unfolding], capsys: pytest.CaptureFixture[str]
) -> None:
    needs(kind)
    folder, unfolding = saved
    out = folder / f"Y{kind}"
    assert main(["map", str(folder / "m.npz"), str(folder / "X.vtu"), "-o", str(out)]) == 0
    table = read_points(out)
    np.testing.assert_array_equal(table.points, read_points(folder / "X.csv").points)
    flat = np.column_stack([table.numbers(f"unfolded_{axis}") for axis in "xyz"])
    # Another process locates points from scratch: the same to rounding at 600 m.
    np.testing.assert_allclose(flat, unfolding.points, rtol=0, atol=1e-9)
    # And back, the unfolded columns taken first.
    back = folder / f"back{kind}.csv"
    assert main(["map", str(folder / "m.npz"), str(out), "--inverse", "-o", str(back)]) == 0
    again = pd.read_csv(back)[["folded_x", "folded_y", "folded_z"]]
    np.testing.assert_allclose(again, table.points, rtol=0, atol=1e-8)


def test_block_volumes_come_from_the_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import pyvista

    slab = pyvista.ImageData(dimensions=(13, 13, 5), spacing=(10.0, 10.0, 5.0))
    slab.cell_data["grade"] = np.arange(12 * 12 * 4.0)
    slab.save(tmp_path / "slab.vti")
    out = tmp_path / "flat.csv"
    assert main(["unfold", str(tmp_path / "slab.vti"), "-o", str(out)]) == 0
    flat = pd.read_csv(out)
    assert (flat["block_volume"] == 10 * 10 * 5).all()
    unfolded = flat["block_volume"] * flat["volume_ratio"]
    np.testing.assert_allclose(flat["unfolded_volume"], unfolded, rtol=1e-12)


@pytest.mark.parametrize("kind", [".ply", ".ts", ".vtp", ".dxf"])
def test_map_carries_wireframes(
    kind: str, saved: tuple[Path, gu.Unfolding], capsys: pytest.CaptureFixture[str]
) -> None:
    needs(kind)
    folder, unfolding = saved
    top = unfolding.top.folded
    given, out = folder / f"top{kind}", folder / f"flat{kind}"
    write_surface(given, top)
    assert main(["map", str(folder / "m.npz"), str(given), "-o", str(out)]) == 0
    flat = read_surface(out)
    carried = unfolding.to_flat(read_surface(given).V)
    np.testing.assert_allclose(flat.V, carried, rtol=0, atol=1e-9)
    assert len(flat.F) == len(top.F)


def test_unfold_refuses_a_format_before_it_computes(
    saved: tuple[Path, gu.Unfolding],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from geounfold.unfolding import run

    def never(*_: object, **__: object) -> Callable[..., object]:
        raise AssertionError("the body was unfolded")

    monkeypatch.setattr(run, "unfold", never)
    folder = saved[0]
    frame = pd.read_csv(folder / "X.csv").assign(id=lambda f: [f"B{k}" for k in range(len(f))])
    frame.to_csv(folder / "named.csv", index=False)
    argv = ["unfold", str(folder / "named.csv"), "-o", str(folder / "named.gslib")]
    assert main(argv) == 2
    assert "column 'id' has" in capsys.readouterr().err
    assert not (folder / "named.gslib").exists()
