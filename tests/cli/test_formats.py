"""Files of every format on the command line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.io import read_points, read_surface, write_surface
from geounfold.io.tables.files import write_table
from tests.io.formats.samples import needs


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, gu.Unfolding]:
    folder = tmp_path_factory.mktemp("formats")
    blocks = gu.simulate("sim_case_1", blocks=2000)
    write_table(folder / "X.csv", blocks.frame(4))
    write_table(
        folder / "X.vtu", blocks.frame(4), columns=("centroid_x", "centroid_y", "centroid_z")
    )
    unfolding = gu.unfold(read_points(folder / "X.csv").points)
    unfolding.save(folder / "m.npz")
    return folder, unfolding


@pytest.mark.parametrize("kind", [".vtu", ".gslib", ".vs", ".omf", ".geoh5"])
def test_map_writes_any_format(
    kind: str, saved: tuple[Path, gu.Unfolding], capsys: pytest.CaptureFixture[str]
) -> None:
    needs(kind)
    folder, unfolding = saved
    out = folder / f"Y{kind}"
    assert main(["map", str(folder / "m.npz"), str(folder / "X.vtu"), "-o", str(out)]) == 0
    table = read_points(out)
    np.testing.assert_array_equal(table.points, read_points(folder / "X.csv").points)
    flat = np.column_stack([table.numbers(f"unfolded_{axis}") for axis in "xyz"])
    # Another process locates points from scratch: the same to rounding at 600 m.
    np.testing.assert_allclose(flat, unfolding.points, rtol=0, atol=1e-9)
    # And back, the unfolded columns taken first.
    back = folder / f"back{kind}.csv"
    assert main(["map", str(folder / "m.npz"), str(out), "--inverse", "-o", str(back)]) == 0
    again = pd.read_csv(back)[["folded_x", "folded_y", "folded_z"]]
    np.testing.assert_allclose(again, table.points, rtol=0, atol=1e-8)


def test_block_volumes_come_from_the_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import pyvista

    slab = pyvista.ImageData(dimensions=(13, 13, 5), spacing=(10.0, 10.0, 5.0))
    slab.cell_data["grade"] = np.arange(12 * 12 * 4.0)
    slab.save(tmp_path / "slab.vti")
    out = tmp_path / "flat.csv"
    assert main(["unfold", str(tmp_path / "slab.vti"), "-o", str(out)]) == 0
    flat = pd.read_csv(out)
    assert (flat["block_volume"] == 10 * 10 * 5).all()
    unfolded = flat["block_volume"] * flat["volume_ratio"]
    np.testing.assert_allclose(flat["unfolded_volume"], unfolded, rtol=1e-12)


@pytest.mark.parametrize("kind", [".ply", ".ts", ".vtp", ".dxf"])
def test_map_carries_wireframes(
    kind: str, saved: tuple[Path, gu.Unfolding], capsys: pytest.CaptureFixture[str]
) -> None:
    needs(kind)
    folder, unfolding = saved
    top = unfolding.top.folded
    given, out = folder / f"top{kind}", folder / f"flat{kind}"
    write_surface(given, top)
    assert main(["map", str(folder / "m.npz"), str(given), "-o", str(out)]) == 0
    flat = read_surface(out)
    carried = unfolding.to_flat(read_surface(given).V)
    np.testing.assert_allclose(flat.V, carried, rtol=0, atol=1e-9)
    assert len(flat.F) == len(top.F)


def test_unfold_refuses_a_format_before_it_computes(
    saved: tuple[Path, gu.Unfolding],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from geounfold.unfolding import run

    def never(*_: object, **__: object) -> Callable[..., object]:
        raise AssertionError("the body was unfolded")

    monkeypatch.setattr(run, "unfold", never)
    folder = saved[0]
    frame = pd.read_csv(folder / "X.csv").assign(id=lambda f: [f"B{k}" for k in range(len(f))])
    frame.to_csv(folder / "named.csv", index=False)
    argv = ["unfold", str(folder / "named.csv"), "-o", str(folder / "named.gslib")]
    assert main(argv) == 2
    assert "column 'id' has" in capsys.readouterr().err
    assert not (folder / "named.gslib").exists()
