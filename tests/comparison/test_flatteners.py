"""The table of flatteners."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.cli.answers.table import table_text
from geounfold.comparison.flatteners import COLUMNS, compare
from geounfold.comparison.methods import METHOD_COLUMNS
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS, ArapOptions
from geounfold.geometry.mesh import TriMesh
from geounfold.synthetic import simulate
from geounfold.unfolding.options import UnfoldOptions

S = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
SQUARE = TriMesh(S, [[0, 1, 2], [0, 2, 3]])
TENT = TriMesh(np.c_[S[:, :2], [0, 0.5, 0, 0.5]], SQUARE.F)
CLOSED = TriMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
)


def test_one_row_per_surface_and_flattener():
    table = compare({"square": SQUARE, "tent": TENT})
    assert list(table.columns) == list(COLUMNS)
    # All except those that call software that is not free, which run only if they are named.
    free = {name for name, flattener in FLATTENERS.items() if flattener.free}
    assert free == set(FLATTENERS) - {"scaf"}
    assert len(table) == 2 * len(free)
    assert set(table.flattener) == free
    assert (table.error == "").all()
    assert (table.flips == 0).all()
    assert (table.seconds > 0).all()
    assert (table.overlaps == 0).all()
    # Two triangles unfold exactly: measured 7e-16 at most.  The harmonic map makes them round, and
    # isomap joins the tent's far corners through the air: 4.17.
    shapeless = [n for n, flattener in FLATTENERS.items() if flattener.keeps == "nothing"]
    shapely = table[~table.flattener.isin([*shapeless, "isomap"])]
    assert (shapely.symmetric_dirichlet < 4 + 1e-9).all()
    assert (shapely.area_error < 1e-9).all()


def test_a_failing_method_is_a_row_that_says_why():
    table = compare({"closed": CLOSED, "square": SQUARE}, ["spring", "lscm"])
    failed = table[table.surface == "closed"]
    assert failed.error.str.contains("closed").all()
    assert failed.flips.isna().all()
    assert failed.area_error.isna().all()
    assert (table[table.surface == "square"].error == "").all()


def test_single_surfaces_pairs_and_single_names():
    for mesh in (SQUARE, (SQUARE.V, SQUARE.F)):
        table = compare(mesh, "spring")
        assert table[["surface", "flattener"]].to_numpy().tolist() == [["surface", "spring"]]


def test_options_reach_their_flattener():
    table = compare(TENT, ["arap"], {"arap": ArapOptions(max_iter=1)})
    assert table.iterations[0] == 1
    assert table.stop[0] == "max_iter"


@pytest.mark.parametrize("names", ["origami", ["spring", "origami"], []])
def test_unknown_flatteners_are_refused(names):
    with pytest.raises(OptionError, match="unknown flatteners"):
        compare(SQUARE, names)


def test_options_of_an_unknown_flattener_are_refused():
    with pytest.raises(OptionError, match="origami"):
        compare(SQUARE, "spring", {"origami": None})


def test_a_body_is_compared_on_its_own_surfaces():
    body = simulate("sim_case_1", blocks=3000)
    stages = []
    table = compare(body.folded, ["spring", "lscm"], progress=stages.append)
    assert table.surface.tolist() == ["top", "top", "bottom", "bottom", "mid", "mid"]
    assert (table.error == "").all()
    # An open cylindrical fold is developable: 0.00001 to 0.00034 measured; looking down on the
    # top instead of flattening it gives 0.066.
    assert (table.edge_strain < 0.002).all()
    assert {"hull", "top surface by spring"} <= set(stages)
    same = compare(body.frame(), ["spring", "lscm"])
    # The table's rows are the array's: figures agree to the last bit.
    figures = ["area_error", "edge_strain", "symmetric_dirichlet"]
    assert same[figures].equals(table[figures])


def test_surfaces_take_no_options_of_unfolding():
    with pytest.raises(OptionError, match="need a body's points"):
        compare(SQUARE, unfolding=UnfoldOptions())


@pytest.fixture(scope="module")
def fold():
    return simulate("sim_case_1", blocks=2500)


def test_methods_are_compared_on_whole_bodies(fold):
    table = compare(fold, ["spring", "arap"], methods=["sheet", "shear"])
    assert list(table.columns) == list(METHOD_COLUMNS)
    # Shear lays nothing flat, so the flattener does not matter and it has one row.
    rows = table[["body", "method", "flattener"]].to_numpy().tolist()
    assert rows == [
        ["sim_case_1", "sheet", "spring"],
        ["sim_case_1", "sheet", "arap"],
        ["sim_case_1", "shear", ""],
    ]
    assert (table.error == "").all()
    assert table.injective.tolist() == [True, True, False]
    assert (table.blocks == len(fold.folded)).all()
    assert (table[["torn", "unplaced", "extrapolated", "flips", "overlaps"]] == 0).all(axis=None)
    assert (table.iterations[:2] > 0).all()
    assert (table.seconds > 0).all()
    # An open cylindrical fold is developable: 4 but for rounding; seen from above its limbs are
    # shorter by the cosine of up to 30 degrees.
    assert (table.symmetric_dirichlet[:2] < 4.001).all()
    assert table.symmetric_dirichlet[2] > 4.01
    # The figures are those of single runs.
    u = gu.unfold(fold.folded, method="shear", allow_uncertified=True)
    assert table.rms[2] == gu.aligned_rms(u.points, fold.truth) / u.frame.scale
    assert table.epsilon_truth[2] == gu.epsilon(fold.truth, u.points).mean()
    assert table.epsilon_folded[2] == u.quality.nmd.mean
    assert table.rms_nothing[2] == gu.aligned_rms(fold.folded, fold.truth) / u.frame.scale
    off = np.abs(u.stratigraphic - fold.stratigraphic).mean()
    assert table.stratigraphic_error[2] == pytest.approx(off)


def test_a_body_turned_over_is_measured_from_the_side_it_looks_to(fold):
    how = UnfoldOptions(up=(0.0, 0.0, -1.0))
    for options in (UnfoldOptions(), how):
        table = compare(fold, methods="sheet", unfolding=options)
        assert (table.flips[0], table.overlaps[0]) == (0, 0)
        assert table.symmetric_dirichlet[0] < 4.001


def test_a_method_that_fails_is_a_row_that_says_why():
    body = simulate("recumbent", blocks=3000)
    table = compare({"overturned": body.folded}, methods=["thesis", "shear"])
    assert "cannot hold an overhang" in table.error[0]
    assert table.epsilon_folded.isna().tolist() == [True, False]
    assert "blocks stand where a vertical line meets" in table.note[1]
    assert table.flips[1] > 0  # seen from above, overturned limbs lie on their faces
    assert table.rms.isna().all()  # no truth


def test_truths_belong_to_bodies(fold):
    X, W = fold.folded, fold.truth
    table = compare(X, methods="shear", truth=W)
    assert table.body.tolist() == ["body"]
    assert table.rms.notna().all()
    assert table.stratigraphic_error.isna().all()
    with pytest.raises(OptionError, match=f"body has {len(X)} blocks, but its truth has 5 rows"):
        compare(X, methods="shear", truth=W[:5])
    with pytest.raises(OptionError, match="a truth for b, but no such body"):
        compare({"a": X}, methods="shear", truth={"b": W})
    with pytest.raises(OptionError, match="several bodies need a mapping"):
        compare({"a": X, "b": X}, methods="shear", truth=W)
    with pytest.raises(OptionError, match="choose methods"):
        compare(X, truth=W)


@pytest.mark.parametrize("names", ["magic", ["sheet", "magic"], []])
def test_unknown_methods_are_refused(fold, names):
    with pytest.raises(OptionError, match=r"unknown methods: .*choose from sheet, thesis"):
        compare(fold, methods=names)


def test_methods_need_bodies(fold):
    with pytest.raises(OptionError, match="give their points, not a surface"):
        compare(SQUARE, methods="shear")
    with pytest.raises(OptionError, match="leave them out with methods"):
        compare(fold, options={"arap": ArapOptions()}, methods="shear")
    with pytest.raises(OptionError, match="unknown flatteners: iron"):
        compare(fold, "iron", methods="sheet")


def test_the_command_compares_methods(fold, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    fold.frame(4).to_csv("x.csv", index=False)
    argv = ["compare", "x.csv", "--methods", "shear, stratigraphic", "-o", "t.csv"]
    assert main([*argv, "--truth", "x.csv"]) == 0
    table = pd.read_csv("t.csv")
    assert list(table.columns) == list(METHOD_COLUMNS)
    assert table.method.tolist() == ["shear", "stratigraphic"]
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].split()[:4] == ["body", "method", "eps(X,Y)", "eps(W,Y)"]
    assert printed[1].split()[:2] == ["body", "shear"]
    assert f"{table.rms[0]:.4g}" in printed[1]
    assert main(["compare", "x.csv", "--truth", "x.csv", "-o", "u.csv"]) == 2
    assert "--truth needs --methods" in capsys.readouterr().err
    fold.frame(4)[:9].to_csv("short.csv", index=False)
    assert main([*argv, "--overwrite", "--truth", "short.csv"]) == 2
    assert "short.csv: has 9 rows" in capsys.readouterr().err
    assert main(["compare", "x.csv", "--methods", "magic", "-o", "u.csv"]) == 2
    assert "unknown methods: magic" in capsys.readouterr().err
    assert not (tmp_path / "u.csv").exists()


def test_a_printed_table_shows_what_there_is():
    rows = [
        {"surface": "top", "flattener": "arap", "flips": 0, "error": ""},
        {"surface": "mid", "flattener": "lscm", "flips": None, "error": "closed"},
    ]
    text = table_text(pd.DataFrame(rows).astype({"flips": "Int64"}))
    assert text.splitlines() == [
        "surface  flattener  flips",
        "top      arap           0",
        "mid      lscm           -  closed",
    ]
