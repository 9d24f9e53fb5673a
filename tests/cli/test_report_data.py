"""Data that the command line passes to the report: every column, and carried drill-holes."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geounfold.cli.answers.report_data import report_columns, report_holes
from geounfold.cli.inputs.drillholes import check_hole_options, read_holes
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import read_points

SHIFT = np.array([100.0, 0.0, -5.0])


def _arguments(folder: Path, **changed: Any) -> Namespace:
    """Return what the parser makes of --holes with one vertical hole, 20 deep."""
    for name, text in {
        "collar.csv": "HOLE,X,Y,Z\nA,1,2,30\n",
        "survey.csv": "HOLE,AT,AZ,DIP\nA,0,0,-90\n",
        "assay.csv": "HOLE,FROM,TO,CU\nA,0,10,0.5\nA,10,20,1.5\n",
    }.items():
        (folder / name).write_text(text)
    known: dict[str, Any] = dict.fromkeys(
        ("samples", "samples_out", "traces_out", "report", "composite", "holes_columns")
    )
    known |= dict.fromkeys(("dip_positive_down", "missing", "below_detection", "cap"))
    known |= {"strict": False, "drop_invalid": False}
    known["holes"] = [str(folder / f"{name}.csv") for name in ("collar", "survey", "assay")]
    return Namespace(**known | changed)


def _moved(points: np.ndarray) -> dict[str, Any]:
    """Return a result's columns as a map would that only shifts."""
    places = points + SHIFT
    names = ("unfolded_x", "unfolded_y", "unfolded_z")
    result: dict[str, Any] = {name: places[:, k] for k, name in enumerate(names)}
    n = len(points)
    return {**result, "location": np.full(n, "inside"), "mesh_distance": np.zeros(n)}


def test_a_report_alone_asks_for_holes(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="--holes needs"):
        check_hole_options(_arguments(tmp_path))
    arguments = _arguments(tmp_path, report="r.html")
    check_hole_options(arguments)
    holes = read_holes(arguments, Console(quiet=True))
    assert holes is not None
    given = report_holes(holes, holes.carried(_moved), None, None)
    assert given is not None
    assert given.samples is not None
    assert given.traces is not None
    # Samples at the middles of 0 to 10 and 10 to 20 down from the collar at z = 30.
    np.testing.assert_allclose(given.samples.folded, [[1, 2, 25], [1, 2, 15]], atol=1e-9)
    np.testing.assert_allclose(given.samples.unfolded, given.samples.folded + SHIFT)
    assert list(given.samples.columns["CU"]) == [0.5, 1.5]
    assert set(given.traces.hole) == {"A"}
    holes.write({}, {})  # nothing was asked for but the report


def test_columns_of_the_result_stand_before_the_input_s_and_replace_them(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("x,y,z,cu,cu,shear\n0,0,0,1,2,old\n1,1,1,3,4,old\n")
    table = read_points(path)
    given = report_columns(table, {"unfolded_x": [0.0, 1.0], "shear": [0.1, 0.2]})
    assert list(given) == ["unfolded_x", "shear", "cu", "cu_2"]
    assert given["shear"] == [0.1, 0.2]
    assert list(given["cu_2"]) == ["2", "4"]
