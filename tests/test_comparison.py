"""The table of flatteners."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.comparison import COLUMNS, compare
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS, ArapOptions
from geounfold.mesh import TriMesh
from geounfold.options import UnfoldOptions
from geounfold.synthetic import simulate

S = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
SQUARE = TriMesh(S, [[0, 1, 2], [0, 2, 3]])
TENT = TriMesh(np.c_[S[:, :2], [0, 0.5, 0, 0.5]], SQUARE.F)
CLOSED = TriMesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
)


def test_one_row_per_surface_and_flattener():
    table = compare({"square": SQUARE, "tent": TENT})
    assert list(table.columns) == list(COLUMNS)
    # All but those that call what is no free software, which run only where they are named.
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
    shapely = table[~table.flattener.isin(["harmonic", "isomap"])]
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
