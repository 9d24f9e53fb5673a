"""OMF files of all versions: their library, damaged files."""

from __future__ import annotations

import json
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import InputError, MissingDependencyError
from geounfold.geometry.mesh import TriMesh
from geounfold.io import read_points, write_surface
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables.files import write_table
from tests.io.formats.omf.files import DATA, MAKE, XYZ


def omf_of(version: int) -> Any:
    """Return the library if it has the version; else skip."""
    omf = pytest.importorskip("omf", reason="omf (extra formats) is not installed")
    if MAKE["is_first"](omf) != (version == 1):
        wanted = "1.0.1" if version == 1 else "2.0.0a0"
        pytest.skip(f"needs omf {wanted}; only one version can be installed at a time")
    return omf


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
