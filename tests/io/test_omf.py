"""OMF in its three layouts: what the formats' own libraries write is read, block for block.

The files in ``data/omf`` are those libraries' own (see its README); where the one at hand can, it
writes them anew.
"""

from __future__ import annotations

import gzip
import io
import json
import runpy
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import InputError, MissingDependencyError
from geounfold.geometry.measures import enclosed_volume
from geounfold.geometry.mesh import TriMesh
from geounfold.io import read_points, read_surface, write_surface
from geounfold.io.formats.omf import version2
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables.files import write_table
from tests.places import TESTS

DATA = TESTS / "data" / "omf"
MAKE = runpy.run_path(str(DATA / "make.py"))
XYZ = MAKE["XYZ"]
SIDES, PLACES = ["dx", "dy", "dz"], ["i", "j", "k"]


def omf_of(version: int) -> Any:
    """Return the library, where it is the one of a version; else skip."""
    omf = pytest.importorskip("omf", reason="omf (extra formats) is not installed")
    if MAKE["is_first"](omf) != (version == 1):
        wanted = "1.0.1" if version == 1 else "2.0.0a0"
        pytest.skip(f"needs omf {wanted}; only one version can be installed at a time")
    return omf


@pytest.fixture(scope="module", params=["at hand", "in data"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where files are: of both libraries in the data, of the one at hand written now."""
    if request.param == "in data":
        return DATA
    pytest.importorskip("omf", reason="omf (extra formats) is not installed")
    made: Path = tmp_path_factory.mktemp("omf")
    MAKE["write"](made)
    return made


def file(folder: Path, name: str) -> Path:
    path = folder / f"{name}.omf"
    if not path.exists():
        pytest.skip("the library at hand is of the other version and cannot write this")
    return path


def sums_of(frame: pd.DataFrame) -> float:
    return float(frame[SIDES].prod(axis=1).sum())


# --------------------------------------------------------------------------------- version 1


def test_version_1_points(folder: Path) -> None:
    path = file(folder, "version1")
    table = read_points(path)
    # The project's origin and the element's own are added, in this order of the file's sums.
    np.testing.assert_array_equal(
        table.points, XYZ + np.array([0.0, 0.0, 7.0]) + np.array([100.0, 0.0, 0.0])
    )
    np.testing.assert_array_equal(table.numbers("au"), [1.0, np.nan, 3.0])
    assert table.frame["n"].tolist() == [1, -2, 2**40]
    assert table.frame["rock"].tolist() == ["a", "é", ""]
    # The first legend holds colours, the second words; -1 is none of them.
    assert table.frame["class"].tolist() == ["high", "low", ""]
    assert table.frame[["dip_0", "dip_2"]].to_numpy().tolist() == [[0, 2], [3, 5], [6, 8]]
    assert table.frame["paint_2"].tolist() == [3, 3, 3]
    assert table.frame["day"].str[:10].tolist() == ["2020-01-01", "2020-01-02", "2020-01-03"]
    assert table.meta == {"unit": "ft"}
    mesh, meta = read_surface_with_meta(path)
    np.testing.assert_array_equal(mesh.V, XYZ + np.array([100.0, 0.0, 0.0]))
    assert (mesh.F.tolist(), meta) == ([[0, 1, 2]], {"unit": "ft"})


# Of blocks of (10, 20) by (5, 5, 5) by (1, 2, 1, 1), u along y and v against x, the corner at
# (100, 200, 0): the block at (1, 2, 1) reaches over u 10 to 30, v 10 to 15, w 1 to 3.
TENSOR_AT = (1, 2, 1)
TENSOR_CENTRE, TENSOR_SIDES = [100 - 12.5, 200 + 20.0, 2.0], [20.0, 5.0, 2.0]
TENSOR_VOLUME = 30 * 15 * 5


def test_version_1_volumes_bring_sides_and_places(folder: Path) -> None:
    frame = read_points(file(folder, "version1_volume")).frame
    # w runs fastest: the value is the number in (u, v, w) order of 2 x 3 x 4 cells.
    row = frame[frame["au"] == np.ravel_multi_index(TENSOR_AT, (2, 3, 4))]
    east = 100.0  # the project's origin
    assert row[["x", "y", "z"]].to_numpy()[0].tolist() == [TENSOR_CENTRE[0] + east, 220.0, 2.0]
    assert row[SIDES].to_numpy()[0].tolist() == TENSOR_SIDES
    assert row[PLACES].to_numpy()[0].tolist() == list(TENSOR_AT)
    assert sums_of(frame) == TENSOR_VOLUME


# ----------------------------------------------------------------------- the pre-release's own


def test_prerelease_points_in_a_composite(folder: Path) -> None:
    path = file(folder, "prerelease")
    table = read_points(path)
    np.testing.assert_array_equal(table.points, XYZ)
    np.testing.assert_array_equal(table.numbers("au"), [1.0, np.nan, 3.0])
    assert table.frame["n"].tolist() == [1, -2, 2**40]
    assert table.frame["assayed"].tolist() == [1, 0, 1]
    assert table.frame["rock"].tolist() == ["a", "é", ""]
    assert table.frame["class"].tolist() == ["high", "low", ""]
    assert table.frame["dip_1"].tolist() == [1, 4, 7]
    assert table.meta == {"unit": "ft", "crs": "EPSG:26711"}
    mesh, meta = read_surface_with_meta(path)
    np.testing.assert_array_equal(mesh.V, XYZ)
    assert (mesh.F.tolist(), meta) == ([[0, 1, 2]], table.meta)


def test_prerelease_tensor_grid(folder: Path) -> None:
    frame = read_points(file(folder, "prerelease_tensor")).frame
    # u runs fastest.
    row = frame[frame["au"] == np.ravel_multi_index(TENSOR_AT, (2, 3, 4), order="F")]
    assert row[["x", "y", "z"]].to_numpy()[0].tolist() == TENSOR_CENTRE
    assert row[SIDES].to_numpy()[0].tolist() == TENSOR_SIDES
    assert row[PLACES].to_numpy()[0].tolist() == list(TENSOR_AT)
    assert sums_of(frame) == TENSOR_VOLUME


def test_prerelease_regular_model_without_one_block(folder: Path) -> None:
    frame = read_points(file(folder, "prerelease_regular")).frame
    assert frame["au"].tolist() == list(range(7))
    assert frame[PLACES].to_numpy().tolist() == [
        [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1],
    ]  # fmt: skip
    # Blocks of 10 x 5 x 2 from the origin: half a block behind their place.
    centres = (frame[PLACES].to_numpy() + 0.5) * [10.0, 5.0, 2.0]
    np.testing.assert_array_equal(frame[["x", "y", "z"]], centres)
    assert (frame[SIDES].to_numpy() == [10.0, 5.0, 2.0]).all()


def test_prerelease_regular_sub_blocks(folder: Path) -> None:
    frame = read_points(file(folder, "prerelease_divided")).frame
    # A whole block of 10 x 10 x 4, none, and one in 2 x 2 x 1 parts of 5 x 5 x 4 from x = 20.
    assert frame[["x", "y", "z"]].to_numpy().tolist() == [
        [5, 5, 2], [22.5, 2.5, 2], [27.5, 2.5, 2], [22.5, 7.5, 2], [27.5, 7.5, 2],
    ]  # fmt: skip
    assert frame[SIDES].to_numpy().tolist() == [[10, 10, 4]] + [[5, 5, 4]] * 4
    assert frame["i"].tolist() == [0, 2, 2, 2, 2]
    assert frame["au"].tolist() == [0, 1, 2, 3, 4]
    assert frame["zone"].tolist() == [7, 8, 8, 8, 8]  # of parents, by those that are there


def test_prerelease_octree(folder: Path) -> None:
    frame = read_points(file(folder, "prerelease_octree")).frame
    # Two blocks of 16 x 32 x 64; the first in 7 eighths and, for that at (1, 1, 0), 8 of its own.
    sides = frame[SIDES].to_numpy()
    names, counts = np.unique(sides, axis=0, return_counts=True)
    assert names.tolist() == [[4, 8, 16], [8, 16, 32], [16, 32, 64]]
    assert counts.tolist() == [8, 7, 1]
    assert sums_of(frame) == 2 * 16 * 32 * 64
    low = frame[["x", "y", "z"]].to_numpy() - sides / 2
    small = sides[:, 0] == 4
    assert low[small].min(axis=0).tolist() == [8, 16, 0]
    assert (low[small] + sides[small]).max(axis=0).tolist() == [16, 32, 32]
    # The library's own order, by Z-order curve: u, then v, then w of each eighth.
    assert frame["au"].tolist() == list(range(16))
    assert low[:4].tolist() == [[0, 0, 0], [8, 0, 0], [0, 16, 0], [8, 16, 0]]
    assert frame["k"].tolist() == [0] * 15 + [1]


def test_prerelease_free_sub_blocks(folder: Path) -> None:
    frame = read_points(file(folder, "prerelease_free")).frame
    # A whole block of 10 x 10 x 4, none, and one cut at a quarter of its length from x = 20.
    assert frame["x"].tolist() == [5.0, 21.25, 26.25]
    assert frame["dx"].tolist() == [10.0, 2.5, 7.5]
    assert sums_of(frame) == 2 * 10 * 10 * 4


# ---------------------------------------------------------------------------------- version 2


def test_version_2_blocks_are_where_its_own_library_says() -> None:
    table = read_points(DATA / "bunny_blocks.omf")
    body = table.frame[table.frame["Bunny"] == "Body"]
    # Of bunny_centroids_out.csv beside that file: its number of rows; rows 1, 1001 and 1774.
    assert len(body) == 1774
    named = body[["x", "y", "z", *SIDES]].to_numpy()[[0, 1000, 1773]]
    theirs = [
        [-624.9775817527725, -598.6603315263158, -273, 100, 100, 100],
        [574.2767515635105, 374.3705230831963, 1077, 200, 200, 200],
        [-480.11048445041, -268.48837008926716, 2627, 100, 100, 100],
    ]
    # The model is turned by 10 degrees: sums in another order differ by rounding at 3000 m.
    np.testing.assert_allclose(named, theirs, rtol=0, atol=1e-11)
    # 8 x 6 x 8 blocks of 400 m, wholly filled.
    assert sums_of(table.frame) == 8 * 6 * 8 * 400.0**3
    assert table.frame[PLACES].max().tolist() == [7, 5, 7]


def elements_of(path: Path) -> dict[str, Any]:
    return {element.name: element for element in version2.elements(path)}


def test_version_2_one_of_everything() -> None:
    path = DATA / "one_of_everything.omf"
    points = read_points(path)
    # A pyramid over (-1, -1) to (1, 1) with its tip at 1.
    assert points.points.tolist() == [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1]]
    assert points.frame["Categories"].tolist() == ["Base"] * 4 + ["Top"]
    # Only the tip has a vector of three, and none of two.
    np.testing.assert_array_equal(points.numbers("3D Vectors_2"), [np.nan] * 4 + [1.0])
    np.testing.assert_array_equal(points.numbers("2D Vectors_1"), [0.0, 1.0, 1.0, 0.0, np.nan])
    with pytest.raises(InputError, match=r"several elements.*Pyramid surface.*Cube faces"):
        read_surface(path)
    found = elements_of(path)
    cube = found["Cube faces"].load()  # in a composite
    assert enclosed_volume(cube.V, cube.F) == pytest.approx(1.0)  # of side 1, outward
    for name, blocks in {
        "Regular block model": 8,
        "Tensor block model": 8,
        "Sub-blocked block model, regular": 11,
        "Sub-blocked block model, free-form": 10,
    }.items():
        model = found[name].load()
        sides = np.column_stack([model.data[side] for side in SIDES])
        assert len(model.xyz) == blocks  # by the index's item_count, or 2 x 2 x 2
        assert (model.xyz - sides / 2 >= -1 - 1e-9).all()
        assert (model.xyz + sides / 2 <= 1 + 1e-3).all()  # tensors of 0.6666 and 1.333
    # All models fill the cube from -1 to 1, but that the parts of one block need not fill it.
    regular = found["Regular block model"].load()
    assert regular.xyz[[0, 1, 7]].tolist() == [[-0.5] * 3, [0.5, -0.5, -0.5], [0.5] * 3]
    assert regular.data["Filter"].tolist() == [0] * 7 + [1]
    tensor = found["Tensor block model"].load()
    assert tensor.data["dx"].tolist() == [0.6666, 1.333] * 4
    octree = found["Sub-blocked block model, regular"].load()
    assert octree.data["dx"][7:].tolist() == [0.5, 0.25, 0.25, 0.25]  # of a block in four parts


def parquet(**columns: Any) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet as pq

    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink)
    return sink.getvalue()


def write_version_2(
    path: Path, index: dict[str, Any], arrays: dict[str, bytes], version: str = "2.0"
) -> Path:
    """Write a file as docs/format.md of omf-rust has it."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.comment = f"Open Mining Format {version}".encode()
        for name, content in arrays.items():
            archive.writestr(name, content)
        archive.writestr("index.json.gz", gzip.compress(json.dumps(index).encode()))
    return path


def array_of(name: str, rows: int) -> dict[str, Any]:
    return {"filename": f"{name}.parquet", "item_count": rows}


def attribute(name: str, kind: str, location: str, rows: int, **more: Any) -> dict[str, Any]:
    data = {"type": kind, "values": array_of(name, rows), **more}
    return {"name": name, "location": location, "data": data}


def nulls(path: Path, **changes: Any) -> Path:
    """Write points, of which each kind of value is missing once."""
    import pyarrow as pa

    rows = 3
    arrays = {
        "xyz.parquet": parquet(x=XYZ[:, 0], y=XYZ[:, 1], z=XYZ[:, 2]),
        "au.parquet": parquet(number=pa.array([0.5, None, 1.5])),
        "n.parquet": parquet(number=pa.array([1, None, 3])),
        "count.parquet": parquet(number=pa.array([1, 2**40, 3])),
        "day.parquet": parquet(number=pa.array([9251, None, 10000], type=pa.date32())),
        "class.parquet": parquet(index=pa.array([1, None, 0], type=pa.uint32())),
        "names.parquet": parquet(name=["low", "high"]),
        "ok.parquet": parquet(bool=pa.array([True, None, False])),
        "rock.parquet": parquet(text=pa.array(["é", None, "b"])),
    }
    element = {
        "name": "holes",
        "geometry": {"type": "PointSet", "origin": [1, 0, 0], "vertices": array_of("xyz", rows)},
        "attributes": [
            attribute("au", "Number", "Vertices", rows),
            attribute("n", "Number", "Vertices", rows),
            attribute("count", "Number", "Vertices", rows),
            attribute("day", "Number", "Vertices", rows),
            attribute("class", "Category", "Vertices", rows, names=array_of("names", 2)),
            attribute("ok", "Boolean", "Vertices", rows),
            attribute("rock", "Text", "Vertices", rows),
        ],
    }
    index = {
        "units": "feet",
        "coordinate_reference_system": "EPSG:26711",
        "origin": [0, 2, 0],
        "elements": [element],
    }
    return write_version_2(path, index, arrays, **changes)


def test_version_2_missing_values_units_and_origins(tmp_path: Path) -> None:
    table = read_points(nulls(tmp_path / "p.omf"))
    np.testing.assert_array_equal(table.points, XYZ + np.array([1.0, 2.0, 0.0]))
    np.testing.assert_array_equal(table.numbers("au"), [0.5, np.nan, 1.5])
    np.testing.assert_array_equal(table.numbers("n"), [1, np.nan, 3])
    assert table.frame["count"].tolist() == [1, 2**40, 3]
    # Days after 1970-01-01.
    assert table.frame["day"].tolist() == ["1995-05-01", "", "1997-05-19"]
    assert table.frame["class"].tolist() == ["high", "", "low"]
    np.testing.assert_array_equal(table.numbers("ok"), [1, np.nan, 0])
    assert table.frame["rock"].tolist() == ["é", "", "b"]
    assert table.meta == {"unit": "ft", "crs": "EPSG:26711"}


def block_model(path: Path, subblocks: dict[str, Any] | None = None, **more: bytes) -> Path:
    """Write 2 x 1 x 1 blocks of 10 x 4 x 2, u along y."""
    orient = {"origin": [100, 200, 0], "u": [0, 1, 0], "v": [-1, 0, 0], "w": [0, 0, 1]}
    geometry: dict[str, Any] = {"type": "BlockModel", "orient": orient}
    geometry["grid"] = {"type": "Regular", "size": [10, 4, 2], "count": [2, 1, 1]}
    attributes = [attribute("zone", "Number", "Primitives", 2)]
    arrays = {"zone.parquet": parquet(number=[7, 8]), **more}
    if subblocks is not None:
        geometry["subblocks"] = subblocks
        attributes.append(attribute("au", "Number", "Subblocks", 3))
        arrays["au.parquet"] = parquet(number=[1.0, 2.0, 3.0])
    element = {"geometry": geometry, "attributes": attributes}
    return write_version_2(path, {"elements": [element]}, arrays)


def sub_table(corner: list[Any], parents: list[int]) -> bytes:
    zeros = np.zeros(len(parents), dtype=np.uint32)
    names = [f"corner_{end}_{a}" for end in ("min", "max") for a in "uvw"]
    return parquet(
        parent_u=np.array(parents, dtype=np.uint32),
        parent_v=zeros,
        parent_w=zeros,
        **dict(zip(names, np.array(corner).T, strict=True)),
    )


def test_version_2_turned_model_and_its_parts(tmp_path: Path) -> None:
    whole = read_points(block_model(tmp_path / "b.omf")).frame
    assert whole[["x", "y", "z"]].to_numpy().tolist() == [[98, 205, 1], [98, 215, 1]]
    assert whole[SIDES].to_numpy().tolist() == [[10, 4, 2]] * 2
    # Of a division in 5 x 2 x 1: two fifths of the second block, the rest of it, the first whole.
    corners = np.array([[0, 0, 0, 2, 2, 1], [2, 0, 0, 5, 2, 1], [0, 0, 0, 5, 2, 1]])
    for division in ([5, 2, 1], None):
        table = sub_table((corners / ([5, 2, 1] * 2) if division is None else corners).tolist(),
                          [1, 1, 0])  # fmt: skip
        parts: dict[str, Any] = {"type": "Freeform" if division is None else "Regular"}
        parts |= {"subblocks": array_of("parts", 3), "count": division}
        path = block_model(tmp_path / "s.omf", parts, **{"parts.parquet": table})
        frame = read_points(path).frame
        np.testing.assert_allclose(frame["y"], [212.0, 217.0, 205.0], rtol=1e-15)
        np.testing.assert_allclose(frame["dx"], [4.0, 6.0, 10.0], rtol=1e-15)
        assert frame["zone"].tolist() == [8, 8, 7]  # of the parents
        assert frame["au"].tolist() == [1.0, 2.0, 3.0]
        assert frame["i"].tolist() == [1, 1, 0]


# -------------------------------------------------------------------------------- the library


def test_what_is_written_is_valid_to_the_pre_release(tmp_path: Path) -> None:
    omf = omf_of(2)
    frame = pd.DataFrame(XYZ, columns=["x", "y", "z"]).assign(
        au=[0.1, np.nan, -999.0], count=[1, -2, 2**31], rock=["ore", "", "größer 1"]
    )
    meta = {"unit": "ft", "crs": "EPSG:26711"}
    write_table(tmp_path / "p.omf", frame, columns=("x", "y", "z"), meta=meta)
    theirs = omf.load(str(tmp_path / "p.omf"))
    assert theirs.validate()
    (points,) = theirs.elements
    np.testing.assert_array_equal(points.vertices.array, XYZ)
    np.testing.assert_array_equal(points.attributes[0].array.array, frame["au"])
    assert list(points.attributes[2].array.array) == frame["rock"].tolist()
    assert theirs.metadata["coordinate_reference_system"] == "EPSG:26711"
    # And what it writes of what it read is read again.
    omf.save(theirs, str(tmp_path / "again.omf"))
    again = read_points(tmp_path / "again.omf")
    pd.testing.assert_frame_equal(again.frame, read_points(tmp_path / "p.omf").frame)
    assert again.meta == meta
    write_surface(tmp_path / "s.omf", TriMesh(XYZ, np.array([[0, 1, 2]])), meta)
    surface, same = read_surface_with_meta(tmp_path / "s.omf")
    np.testing.assert_array_equal(surface.V, XYZ)
    assert (surface.F.tolist(), same) == ([[0, 1, 2]], meta)


def test_reading_needs_no_library_and_writing_names_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "omf", None)  # makes `import omf` fail
    for name in ("version1", "prerelease", "bunny_blocks"):
        assert len(read_points(DATA / f"{name}.omf")) > 0
    with pytest.raises(MissingDependencyError, match=r"omf.*geounfold\[formats\]"):
        write_surface(tmp_path / "s.omf", TriMesh(XYZ, np.array([[0, 1, 2]])))


# ------------------------------------------------------------------------------- damaged files


def cut(path: Path, out: Path, share: float) -> Path:
    content = path.read_bytes()
    out.write_bytes(content[: int(len(content) * share)])
    return out


def test_an_array_before_the_files_beginning_is_one_line(tmp_path: Path) -> None:
    content = (DATA / "version1.omf").read_bytes()
    # Behind the header of 60 bytes stands the first array, that of the gold.
    assert content.count(b'"start": 60,') == 1
    (tmp_path / "v.omf").write_bytes(content.replace(b'"start": 60,', b'"start": -9,'))
    with pytest.raises(InputError, match=r"v\.omf: is an OMF file, but damaged: .*nvalid argument"):
        read_points(tmp_path / "v.omf")


@pytest.mark.parametrize("name", ["version1", "prerelease", "bunny_blocks"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.98])
def test_cut_files_are_one_line(name: str, share: float, tmp_path: Path) -> None:
    path = cut(DATA / f"{name}.omf", tmp_path / "c.omf", share)
    with pytest.raises(InputError, match=r"c\.omf: is") as caught:
        read_points(path)
    assert "\n" not in str(caught.value)


def rewritten(source: str, out: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """Write one of the pre-release's files with its project changed."""
    with (
        zipfile.ZipFile(DATA / f"{source}.omf") as old,
        zipfile.ZipFile(out, "w") as new,
    ):
        for name in old.namelist():
            content = old.read(name)
            if name == "project.json":
                project = json.loads(content)
                change(project)
                content = json.dumps(project).encode()
            new.writestr(name, content)
    return out


def _set(key: str, value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda project: project["elements"][0].__setitem__(key, value)


@pytest.mark.parametrize(
    ("source", "change", "words"),
    [
        ("prerelease", lambda p: p.update(version="3.0"), "version that is not read: '3.0'"),
        ("prerelease", lambda p: p.pop("elements"), "a part is missing.*elements"),
        ("prerelease_tensor", _set("axis_u", [1.0, 1.0, 0.0]), "not at right angles"),
        ("prerelease_tensor", _set("axis_u", [0.0, 0.0, 0.0]), "axes are no directions"),
        ("prerelease_tensor", _set("tensor_u", [1.0, -2.0]), "sides that are no lengths"),
        ("prerelease_tensor", _set("tensor_u", [1.0]), "'au' has 24 values for 12 places"),
        ("prerelease_regular", _set("block_count", [2, 2, 3]), "8 counts of sub-blocks for 12"),
        ("prerelease_regular", _set("block_count", [9, 10**12, 9]), "of 9 x 1000000000000 x 9"),
        ("prerelease_regular", _set("block_count", [2, 2, 0]), "of 2 x 2 x 0 blocks"),
        ("prerelease_divided", _set("sub_block_count", [3, 2, 1]), "other than the stated number"),
        ("prerelease_free", lambda p: p["elements"][0]["sub_block_sizes"].update(
            array=p["elements"][0]["sub_block_corners"]["array"]), "reaches out of its block"),
    ],
)  # fmt: skip
def test_wrong_models_are_one_line(
    source: str, change: Callable[[dict[str, Any]], None], words: str, tmp_path: Path
) -> None:
    path = rewritten(source, tmp_path / "w.omf", change)
    with pytest.raises(InputError, match=words) as caught:
        read_points(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wrong_files_of_version_2_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"version that is not read: '3\.1'"):
        read_points(nulls(tmp_path / "three.omf", version="3.1"))
    parts = {"type": "Freeform", "subblocks": array_of("parts", 3)}
    whole = [[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]] * 3
    for corners, parents, words in (
        (whole, [0, 1, 2], "lies outside the grid"),
        ([[0.0, 0.0, 0.0, 1.5, 1.0, 1.0], *whole[1:]], [0, 1, 0], "reaches out of its block"),
        (whole[:2], [0, 1], r"has 2 rows, not 3"),
    ):
        table = sub_table(corners, parents)
        path = block_model(tmp_path / "b.omf", parts, **{"parts.parquet": table})
        with pytest.raises(InputError, match=words):
            read_points(path)
    path = block_model(tmp_path / "b.omf", parts, **{"parts.parquet": b"PAR1 and no more"})
    with pytest.raises(InputError, match=r"b\.omf: is an OMF file, but damaged"):
        read_points(path)
    with zipfile.ZipFile(tmp_path / "z.omf", "w") as archive:
        archive.writestr("a.txt", "text")
    with pytest.raises(InputError, match=r"a zip archive, but no OMF file of version 2"):
        read_points(tmp_path / "z.omf")
    with pytest.raises(InputError, match="neither a point set nor a block model"):
        read_points(write_version_2(tmp_path / "e.omf", {"elements": []}, {}))
