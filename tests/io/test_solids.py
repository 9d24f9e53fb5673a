"""Solids from files of every kind, from meshes and from pyvista."""

import numpy as np
import pytest
import pyvista

import geounfold as gu
from geounfold.errors import InputError, MissingDependencyError, OptionError
from geounfold.io import write_surface
from geounfold.io.solids import is_wireframe
from tests.body.fill.solids import ball

V, F = ball(16)
V = 10 * V


@pytest.mark.parametrize(
    "kind", [".dxf", ".obj", ".stl", ".ply", ".off", ".ts", ".vtp", ".omf", ".geoh5", ".csv"]
)
def test_every_format_of_surfaces_is_filled_alike(tmp_path, kind):
    path = tmp_path / f"solid{kind}"
    try:
        write_surface(path, gu.TriMesh(V, F))
    except MissingDependencyError as error:
        pytest.skip(str(error))
    made = gu.fill(path, 1)
    # Single precision (.stl) moves corners by 5e-7, which decides no centre of these blocks.
    assert np.array_equal(made.points, gu.fill((V, F), 1).points)
    assert is_wireframe(path) == (kind != ".csv")


def test_a_pyvista_surface_or_volume_is_a_solid():
    surface = pyvista.PolyData.from_regular_faces(V, F)
    expected = gu.fill((V, F), 2).points
    assert np.array_equal(gu.fill(surface, 2).points, expected)
    grid = pyvista.ImageData(dimensions=(7, 5, 4), spacing=(5, 5, 5), origin=(1, 2, 3))
    made = gu.fill(grid)  # its skin shows its cells
    centres = grid.cell_centers().points
    assert np.array_equal(made.points, centres[np.lexsort(centres.T[::-1])])


def test_points_of_a_ts_file_are_no_wireframe(tmp_path):
    path = tmp_path / "p.ts"
    path.write_text("GOCAD TSurf 1\nHEADER {\nname:p\n}\nVRTX 1 0 0 0\nVRTX 2 1 0 0\nEND\n")
    assert not is_wireframe(path)


def test_fill_needs_one_solid_or_two_surfaces():
    for words in ({}, {"top": (V, F)}, {"solid": (V, F), "top": (V, F), "bottom": (V, F)}):
        with pytest.raises(OptionError, match="a closed surface, or top and bottom"):
            gu.fill(**words)
    with pytest.raises(InputError, match="not closed"):
        gu.fill((V, F[: len(F) // 2]))
