"""DXF files, against ezdxf."""

from __future__ import annotations

from pathlib import Path

import pytest

from geounfold.errors import InputError
from geounfold.io import read_surface
from geounfold.io.surfaces import read_surface_with_meta
from tests.io.formats.samples import needs


def test_dxf_by_its_library(tmp_path: Path) -> None:
    needs(".dxf")
    import ezdxf
    from ezdxf.render import MeshBuilder

    drawing = ezdxf.new("R2000")
    drawing.units = 6
    space = drawing.modelspace()
    corners = [(0.0, 0.0, 0.1), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 1 / 3)]
    space.add_3dface(corners)
    builder = MeshBuilder()
    builder.vertices = [(5.0, 0.0, 0.0), (6.0, 0.0, 0.0), (5.0, 1.0, 0.0)]
    builder.faces = [(0, 1, 2)]
    builder.render_polyface(space)
    builder.render_mesh(space)
    space.add_line((0, 0), (1, 1))
    drawing.saveas(tmp_path / "w.dxf")
    mesh, meta = read_surface_with_meta(tmp_path / "w.dxf")
    # A quadrangle cut in two, and one triangle twice, at corners 4 to 6.
    assert mesh.F.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 5, 6]]
    assert mesh.V[:4].tolist() == [list(c) for c in corners]
    assert meta == {"unit": "m"}
    bare = ezdxf.new("R2000")
    bare.modelspace().add_line((0, 0), (1, 1))
    bare.saveas(tmp_path / "bare.dxf")
    with pytest.raises(InputError, match=r"no faces.*LINE"):
        read_surface(tmp_path / "bare.dxf")
