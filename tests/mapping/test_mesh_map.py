"""Carrying points both ways, and the map file."""

import numpy as np
import pytest

from geounfold.body.working_frame import Frame
from geounfold.errors import InputError
from geounfold.geometry.mesh import TetMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.mesh_map import UnfoldingMap, load
from tests.shapes import rotation, slab

FRAME = Frame(np.array([431_000.0, 7_400_000.0, 900.0]), rotation(8), 12.5, None)


def make_map():
    """A sheared 8 x 8 x 2 prism mesh in working units."""
    flat, T = slab(8, 8, 2)
    flat -= [0.0, 0.0, 1.0]
    folded = flat + np.column_stack([0.1 * flat[:, 2], np.zeros(len(flat)), np.sin(flat[:, 0] / 3)])
    return UnfoldingMap(
        FRAME, ControlMesh(TetMesh(folded, T), TetMesh(flat, T), (flat[:, 2] + 1) / 2)
    )


def inner_points(count=500):
    rng = np.random.default_rng(8)
    flat = rng.random((count, 3)) * [8.0, 8.0, 2.0] - [0.0, 0.0, 1.0]
    return flat * FRAME.scale


def test_there_and_back():
    mapping = make_map()
    flat = inner_points()
    folded = mapping.to_folded(flat)
    carried = mapping.carry(folded)
    assert carried.inside.all()
    # World coordinates are of 1e7, so that rounding is 2e-9; the body is 100 m long.
    assert np.abs(carried.points - flat).max() < 2e-8
    assert np.abs(mapping.to_folded(carried.points) - folded).max() < 2e-8
    assert np.abs(carried.stratigraphic - (flat[:, 2] / FRAME.scale + 1) / 2).max() < 1e-9


def test_points_outside_are_continued_and_marked():
    mapping = make_map()
    flat = np.array([[4.0, 4.0, 1.2], [4.0, 4.0, 0.5], [-0.5, 4.0, 0.0]]) * FRAME.scale
    carried = mapping.carry(flat, inverse=True)
    assert carried.location.tolist() == ["extrapolated", "inside", "extrapolated"]
    # 0.2 above the mesh: the affine map of the element below goes on.
    assert carried.stratigraphic[0] == pytest.approx(1.1, abs=1e-12)


def test_no_points_give_no_points():
    assert make_map().to_flat(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("points", "words"),
    [(np.zeros((3, 2)), "shape"), (np.array([[0.0, 0, 0], [0, np.nan, 0]]), "row 2")],
)
def test_bad_points_are_refused(points, words):
    with pytest.raises(InputError, match=words):
        make_map().to_flat(points)


def test_saved_map_is_the_same_bit_for_bit(tmp_path):
    mapping, path = make_map(), tmp_path / "m.npz"
    mapping.save(path)
    again = load(path)
    folded = mapping.to_folded(inner_points())
    assert np.array_equal(again.to_flat(folded), mapping.to_flat(folded))
    other = tmp_path / "n.npz"
    again.save(other)
    assert other.read_bytes() == path.read_bytes()


def test_damaged_foreign_and_newer_files_are_refused(tmp_path):
    path = tmp_path / "m.npz"
    make_map().save(path)
    whole = path.read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.npz").write_text("no map")
    (tmp_path / "empty.npz").write_bytes(b"")
    np.savez(tmp_path / "foreign.npz", a=np.zeros(3))
    np.savez(tmp_path / "pickle.npz", a=np.array([{"a": 1}], dtype=object))
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(tmp_path / "changed.npz", **{**arrays, "scale": np.array(13.0)})
    np.savez(tmp_path / "newer.npz", **{**arrays, "version": np.array(99)})
    for name, words in {
        "absent": "no such",
        "cut": "damaged",
        "text": "not a geounfold map",
        "empty": "not a geounfold map",
        "foreign": "not a geounfold map",
        "pickle": "not a geounfold map",
        "changed": "checksum",
        "newer": "newer",
    }.items():
        with pytest.raises(InputError, match=words):
            load(tmp_path / f"{name}.npz")
    (tmp_path / "blocks.csv").write_text("x,y,z\n1,2,3\n")
    with pytest.raises(InputError, match=r"which ends in .npz: were two files swapped"):
        load(tmp_path / "blocks.csv")
