"""The command view."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import geounfold
from geounfold.body.working_frame import Frame
from geounfold.cli import main
from geounfold.geometry.mesh import TetMesh
from geounfold.mapping.control_mesh import ControlMesh
from tests.cli.fakes import RESULTS, replace_module


def test_view_asks_for_numbers(
    tmp_path: Path, points: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "p.csv", "-o", "p.png", "--colour", "id"]) == 2
    assert "data row 2" in capsys.readouterr().err
    assert main(["view", "p.csv", "-o", "p.png", "--colour", "location"]) == 2
    assert "not numeric" in (said := capsys.readouterr().err)
    assert "--colour takes a column of numbers: " in said


def test_view_draws_both_spaces(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    replace_module(
        monkeypatch,
        "report.plots.bodies",
        draw_body=lambda _p, _values, label: drawn.append((label,)),
        draw_bodies=lambda _p, _q, _values, label, titles: drawn.append((label, *titles)),
        draw_control=lambda control: drawn.append(control.folded.V.tolist()),
    )
    replace_module(monkeypatch, "report.plots.figures", png=lambda _figure: b"picture")
    (tmp_path / "m.npz").write_bytes(b"map")
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    tet = TetMesh(corners, [[0, 1, 2, 3]])
    frame = Frame(np.array([100.0, 0, 0]), np.diag([-1.0, 1, -1]), 10.0, None)
    saved = SimpleNamespace(control=ControlMesh(tet, tet, corners[:, 2]), frame=frame)
    monkeypatch.setattr(geounfold.mapping.mesh_map, "load", lambda _: saved)
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == 0
    (tmp_path / "true.csv").write_text("x,y,z,true_x,true_y,true_z\n1,2,3,1,2,0\n4,5,6,4,5,0\n")
    unfolded = ",".join(RESULTS[:3])
    for number, words in enumerate(
        (
            ["p.csv"],
            ["out.csv"],
            ["out.csv", "--colour", "ZC"],
            ["out.csv", "--columns", unfolded],
            ["true.csv"],
        )
    ):
        assert main(["view", *words, "-o", f"{number}.png"]) == 0
    assert main(["view", "m.npz", "-o", "c.png"]) == 0
    in_world = [[100, 0, 0], [90, 0, 0], [100, 10, 0], [100, 0, -10]]
    assert drawn == [
        ("ZC",),
        ("stratigraphic", "folded", "unfolded"),
        ("ZC", "folded", "unfolded"),
        ("stratigraphic",),
        ("z", "folded", "truth"),
        in_world,
    ]
    assert (tmp_path / "c.png").read_bytes() == b"picture"
