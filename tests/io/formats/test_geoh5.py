"""geoh5 files, against the format's own library."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.io import read_points, read_surface
from geounfold.io.formats import geoh5
from tests.io.formats.samples import XYZ, needs, places, sides


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


class _Points(SimpleNamespace):
    coordinate_reference_system = None
    children: tuple[Any, ...] = ()


class _Surface(_Points):
    pass


def test_an_object_of_several_is_chosen_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Objects that stand in for the library's, which not every Python has."""
    held = [
        _Points(name="holes", vertices=np.zeros((2, 3))),
        _Points(name="blocks", vertices=np.ones((3, 3))),
        _Surface(name="top", vertices=np.eye(3), cells=[[0, 1, 2]]),
    ]
    kinds = SimpleNamespace(Points=_Points, Surface=_Surface, BlockModel=type("_B", (), {}))

    @contextmanager
    def workspace(_: Path) -> Iterator[tuple[Any, Any]]:
        yield SimpleNamespace(objects=held, distance_unit="meter"), kinds

    monkeypatch.setattr(geoh5, "_workspace", workspace)
    path = tmp_path / "p.geoh5"
    path.write_bytes(b"x")
    with pytest.raises(InputError, match="point set 'holes', point set 'blocks'; choose one by"):
        read_points(path)
    found = read_points(path, element="blocks")
    assert found.points.tolist() == [[1, 1, 1]] * 3
    assert found.facts()["element"] == "blocks"
    with pytest.raises(InputError, match=r"no point set or block model is called 'top'"):
        read_points(path, element="top")
    assert len(read_surface(path, "top").F) == 1
