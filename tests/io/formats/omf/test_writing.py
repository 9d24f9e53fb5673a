"""OMF files, against the format's own library."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.io import read_points, read_surface
from geounfold.io.tables.files import write_table
from tests.io.formats.samples import XYZ, needs_omf_1, points_frame


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
