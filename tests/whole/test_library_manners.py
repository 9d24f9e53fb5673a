"""The library's manners: public names, errors, reprs, PyVista, scikit-learn, logging."""

import logging

import numpy as np
import pandas as pd
import pytest
import pyvista

import geounfold as gu
from geounfold.geometry.measures import lengths
from tests.shapes import plane


@pytest.fixture(scope="module")
def folded():
    return gu.simulate("sim_case_1", blocks=2000)


@pytest.fixture(scope="module")
def unfolded(folded):
    return gu.unfold(folded.folded)


def test_dir_lists_public_names_only():
    assert dir(gu) == sorted(gu.__all__)
    assert all(hasattr(gu, name) for name in gu.__all__)


def test_input_errors_are_value_errors():
    for wrong in (np.zeros((3, 2)), np.full((60, 3), np.nan)):
        with pytest.raises(ValueError) as caught:  # noqa: PT011 - the class is the point
            gu.unfold(wrong)
        assert isinstance(caught.value, gu.InputError)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda X: gu.unfold(X, flatener="spring"), "did you mean 'flattener'"),
        (lambda X: gu.unfold(X, method="shet"), "did you mean 'sheet'"),
        (lambda X: gu.unfold(X, hull_options={"levl": 0.5}), "did you mean 'level'"),
        (lambda _: gu.Unfolder(dautm="top"), "did you mean 'datum'"),
    ],
)
def test_an_unknown_option_names_the_nearest(folded, make, said):
    with pytest.raises(gu.OptionError, match=said):
        make(folded.folded)


def test_reprs_are_one_line(folded, unfolded):
    for thing, begin in (
        (folded, "<Body sim_case_1 of 1944 blocks"),
        (unfolded, "<Unfolding of 1944 points"),
        (unfolded.map, "<UnfoldingMap of "),
        (unfolded.hull, "<Hull by density of "),
        (unfolded.control, "<ControlMesh of "),
        (unfolded.control.folded, "<TetMesh of "),
        (unfolded.top.folded, "<TriMesh of "),
    ):
        text = repr(thing)
        assert text.startswith(begin)
        assert "\n" not in text
        assert len(text) < 140


def test_blocks_come_out_as_cells(folded):
    table = folded.frame().assign(dx=4.0, dy=5.0, dz=2.0)
    unfolded = gu.unfold(table)
    for space, at in (("folded", folded.folded), ("unfolded", unfolded.points)):
        grid = unfolded.to_pyvista(space, cells=True)
        assert grid.n_cells == len(folded.folded)
        # A bent block's centre is not the mean of its corners: measured 0.02 of these sides.
        assert np.abs(grid.cell_centers().points - at).max() < 0.5
        assert np.array_equal(grid.cell_data["stratigraphic"], unfolded.stratigraphic)
    volumes = unfolded.to_pyvista(cells=True).compute_cell_sizes()["Volume"]
    assert volumes == pytest.approx(40.0)


def test_pyvista_surfaces_go_in():
    nodes, F = plane(6, 5)
    flat = pyvista.PolyData.from_regular_faces(np.column_stack([nodes, 0 * nodes[:, 0]]), F)
    # A plane stays as it is: 6 by 5, whatever way it is turned.
    E = np.array([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]).reshape(-1, 2)
    assert np.allclose(lengths(gu.flatten(flat).uv, E), lengths(nodes, E), rtol=1e-6)


def test_an_unfolder_that_was_not_fitted_says_so():
    exceptions = pytest.importorskip("sklearn.exceptions")
    with pytest.raises(exceptions.NotFittedError, match="call fit first") as caught:
        gu.Unfolder().transform(np.zeros((3, 3)))
    assert isinstance(caught.value, gu.NotFittedError)
    with pytest.raises(AttributeError):
        gu.Unfolder().inverse_transform(np.zeros((3, 3)))


_NEED_A_BODY = "fits tables of other shapes, or of fewer points than a body has"


def test_scikit_learns_checks_hold_where_they_apply():
    """Every check fails in fit alone, because its table is no body of blocks, or passes."""
    checks = pytest.importorskip("sklearn.utils.estimator_checks")
    found = checks.check_estimator(gu.Unfolder(), on_fail=None, on_skip=None)
    failed = {
        row["check_name"]: str(row["exception"]) for row in found if row["status"] == "failed"
    }
    theirs = {  # what a body of blocks, or options made of classes, cannot give
        "check_parameters_default_constructible",  # hull_options and others are dataclasses
        "check_estimators_nan_inf",  # its tables have other shapes; see the next test
        "check_estimators_empty_data_messages",
        "check_fit2d_1sample",
        "check_positive_only_tag_during_fit",
    }
    for name, message in failed.items():
        no_body = "needs at least 50" in message or "minimum of 3 is required" in message
        assert no_body or name in theirs, f"{name}: {message}"
    passed = {row["check_name"] for row in found if row["status"] == "passed"}
    assert {
        "check_no_attributes_set_in_init",
        "check_do_not_raise_errors_in_init_or_set_params",
        "check_estimator_sparse_array",
        "check_get_params_invariance",
        "check_set_params",
        "check_estimator_cloneable",
        "check_estimators_unfitted",
    } <= passed


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_coordinates_that_are_not_finite_are_refused(folded, wrong):
    points = folded.folded.copy()
    points[3, 1] = wrong
    with pytest.raises(ValueError, match="not finite, the first is row 4"):
        gu.Unfolder().fit(points)


def test_progress_has_a_fraction_that_grows(folded):
    seen = []
    gu.unfold(folded.folded, progress=lambda stage, done: seen.append((stage, done)))
    shares = [done for _, done in seen]
    assert shares == sorted(shares)
    assert 0 <= shares[0] < 0.2
    assert shares[-1] == 1.0
    inside = [done for stage, done in seen if stage == "sheet"]
    assert len(inside) >= 4  # told inside the longest stage too, not at its begin alone
    names = []
    gu.unfold(folded.folded, progress=names.append)  # a function of the name alone
    assert names[0] == "frame"
    assert all(isinstance(name, str) for name in names)


def test_stages_and_warnings_are_logged(folded, caplog):
    apart = np.concatenate([folded.folded, folded.folded[:1]])
    with caplog.at_level(logging.DEBUG, logger="geounfold"):
        gu.unfold(pd.DataFrame(apart, columns=["x", "y", "z"]))
    records = {(record.levelname, record.getMessage()) for record in caplog.records}
    assert ("INFO", "stage sheet") in records
    assert ("WARNING", "1 points repeat the coordinates of another; all were kept") in records
    assert any(level == "DEBUG" and "sheet took" in text for level, text in records)
