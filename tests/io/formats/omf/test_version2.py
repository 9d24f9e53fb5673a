"""OMF version 2."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.geometry.measures import enclosed_volume
from geounfold.io import read_points, read_surface
from geounfold.io.formats.omf import version2
from tests.io.formats.omf.files import DATA, PLACES, SIDES, XYZ, sums_of


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
    with pytest.raises(InputError, match=r"5 elements.*'Pyramid points'.*choose one by --element"):
        read_points(path)
    points = read_points(path, element="pyramid points")
    assert points.facts()["element"] == "Pyramid points"
    # A pyramid over (-1, -1) to (1, 1) with its tip at 1.
    assert points.points.tolist() == [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1]]
    assert points.frame["Categories"].tolist() == ["Base"] * 4 + ["Top"]
    # Only the tip has a vector of three, and none of two.
    np.testing.assert_array_equal(points.numbers("3D Vectors_2"), [np.nan] * 4 + [1.0])
    np.testing.assert_array_equal(points.numbers("2D Vectors_1"), [0.0, 1.0, 1.0, 0.0, np.nan])
    with pytest.raises(InputError, match=r"3 elements.*Pyramid surface.*Cube faces"):
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
