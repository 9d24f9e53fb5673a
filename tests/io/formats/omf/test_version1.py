"""OMF version 1."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geounfold.io import read_points
from geounfold.io.surfaces import read_surface_with_meta
from tests.io.formats.omf.files import (
    PLACES,
    SIDES,
    TENSOR_AT,
    TENSOR_CENTRE,
    TENSOR_SIDES,
    TENSOR_VOLUME,
    XYZ,
    file,
    sums_of,
)


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


def test_version_1_volumes_bring_sides_and_places(folder: Path) -> None:
    frame = read_points(file(folder, "version1_volume")).frame
    # w runs fastest: the value is the number in (u, v, w) order of 2 x 3 x 4 cells.
    row = frame[frame["au"] == np.ravel_multi_index(TENSOR_AT, (2, 3, 4))]
    east = 100.0  # the project's origin
    assert row[["x", "y", "z"]].to_numpy()[0].tolist() == [TENSOR_CENTRE[0] + east, 220.0, 2.0]
    assert row[SIDES].to_numpy()[0].tolist() == TENSOR_SIDES
    assert row[PLACES].to_numpy()[0].tolist() == list(TENSOR_AT)
    assert sums_of(frame) == TENSOR_VOLUME
