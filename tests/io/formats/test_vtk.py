"""VTK files, against VTK itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geounfold.geometry.mesh import TriMesh
from geounfold.io import holds_surface, read_points, read_surface, write_surface
from tests.io.formats.samples import by_corners, places, sides, tetrahedron


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
    assert by_corners(surface) == by_corners(ours)


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


@pytest.mark.parametrize("kind", ["grid.vtk", "image.vtk", "rectilinear.vtr", "structured.vts"])
def test_legacy_and_structured_files_hold_the_blocks_of_an_image(tmp_path: Path, kind: str) -> None:
    import pyvista

    image = pyvista.ImageData(dimensions=(4, 3, 2), spacing=(10.0, 5.0, 2.0), origin=(100, 200, 50))
    image.cell_data["grade"] = np.arange(6.0)
    made = {
        "grid.vtk": image.cast_to_unstructured_grid(),
        "image.vtk": image,
        "rectilinear.vtr": pyvista.RectilinearGrid(
            np.arange(4) * 10.0 + 100, np.arange(3) * 5.0 + 200, np.array([50.0, 52.0])
        ),
        "structured.vts": image.cast_to_structured_grid(),
    }[kind]
    made.cell_data["grade"] = np.arange(6.0)
    made.save(tmp_path / kind)
    blocks = read_points(tmp_path / kind)
    assert blocks.points[[0, 4]].tolist() == [[105.0, 202.5, 51.0], [115.0, 207.5, 51.0]]
    assert blocks.numbers("grade").tolist() == list(range(6))
    assert (sides(blocks) == [10.0, 5.0, 2.0]).all()
    if kind != "grid.vtk":
        assert places(blocks) == [[i, j, 0] for j in range(2) for i in range(3)]


def test_uneven_blocks_of_a_rectilinear_grid(tmp_path: Path) -> None:
    import pyvista

    grid = pyvista.RectilinearGrid(np.array([0.0, 10, 15]), np.array([0.0, 4]), np.array([0.0, 2]))
    grid.save(tmp_path / "b.vtr")
    blocks = read_points(tmp_path / "b.vtr")
    assert blocks.points.tolist() == [[5, 2, 1], [12.5, 2, 1]]
    assert sides(blocks).tolist() == [[10, 4, 2], [5, 4, 2]]


@pytest.mark.parametrize("binary", [True, False])
def test_legacy_surfaces(tmp_path: Path, binary: bool) -> None:
    import pyvista

    mesh = pyvista.Sphere(radius=10.0, theta_resolution=8, phi_resolution=8)
    mesh.save(tmp_path / "s.vtk", binary=binary)
    mesh.cast_to_unstructured_grid().save(tmp_path / "u.vtk", binary=binary)
    ours = TriMesh(np.asarray(mesh.points, dtype=np.float64), mesh.regular_faces.astype(np.int64))
    assert holds_surface(tmp_path / "s.vtk")
    for name in ("s.vtk", "u.vtk"):
        surface = read_surface(tmp_path / name)
        assert np.array_equal(surface.F, ours.F)
        # Text has six digits or more of coordinates up to 10.
        np.testing.assert_allclose(surface.V, ours.V, rtol=0, atol=0 if binary else 1e-5)
    pyvista.ImageData(dimensions=(3, 3, 3)).save(tmp_path / "b.vtk")
    assert not holds_surface(tmp_path / "b.vtk")
