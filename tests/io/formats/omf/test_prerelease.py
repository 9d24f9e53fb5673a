"""OMF 2.0.0a0, the pre-release."""

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
