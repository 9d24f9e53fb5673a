"""Variogram models of other libraries: the same semivariances, and back unchanged."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import InputError, OptionError
from geounfold.estimation import Structure

ONE = gu.Variogram(0.2, (Structure("spherical", 1.5, (40, 20, 8)),), (35, 20, -15))
SUM = gu.Variogram(
    0.1,
    (Structure("exponential", 1.0, (60, 30, 10)), Structure("gaussian", 0.5, (30, 15, 5))),
    (-120, 5, 40),
)
MATERN = gu.Variogram(0.3, (Structure("matern", 1.0, (40, 30, 10), 2.5),), (10, 0, 5))
PLAIN = gu.Variogram(0.0, (Structure("exponential", 2.0, (50, 50, 50)),))
SEPARATIONS = np.random.default_rng(0).normal(0, 15, (40, 3))


def same(one, other):
    assert other.nugget == pytest.approx(one.nugget)
    assert np.allclose(one.gamma(SEPARATIONS), other.gamma(SEPARATIONS), rtol=1e-9)
    assert [s.kind for s in other.structures] == [s.kind for s in one.structures]


@pytest.mark.parametrize("model", [ONE, SUM, PLAIN, MATERN])
def test_gstlearn_has_the_same_semivariances(model):
    gl = pytest.importorskip("gstlearn")
    theirs = model.to_gstlearn()
    same(model, gu.Variogram.from_gstlearn(theirs))
    table = gl.Db.create()
    for axis in range(3):
        column = np.concatenate([[0.0], SEPARATIONS[:, axis]])
        table.addColumns(column, f"x{axis}", gl.ELoc.X, axis)
    covariance = np.asarray(theirs.evalCovMatSym(table).toTL())[0, 1:]
    # gstlearn's practical range is 2.995732 for ln 20, its gaussian's 1.730818 for sqrt(ln 20).
    assert model.sill - covariance == pytest.approx(model.gamma(SEPARATIONS), rel=1e-6)


@pytest.mark.parametrize("model", [ONE, SUM, PLAIN, MATERN])
def test_gstools_has_the_same_semivariances(model):
    pytest.importorskip("gstools")
    theirs = model.to_gstools()
    same(model, gu.Variogram.from_gstools(theirs))
    assert theirs.vario_spatial(SEPARATIONS.T) == pytest.approx(model.gamma(SEPARATIONS), rel=1e-9)


def test_gstools_sums_only_ranges_in_proportion():
    pytest.importorskip("gstools")
    parts = (Structure("spherical", 1, (40, 20, 8)), Structure("spherical", 1, (40, 40, 8)))
    with pytest.raises(OptionError, match=r"in proportion, but these are \(40"):
        gu.Variogram(0, parts).to_gstools()


def test_kinds_without_a_counterpart_are_named():
    gs = pytest.importorskip("gstools")
    with pytest.raises(InputError, match="Cubic has no counterpart"):
        gu.Variogram.from_gstools(gs.Cubic(dim=3))
    with pytest.raises(InputError, match="dim=3"):
        gu.Variogram.from_gstools(gs.Spherical(dim=2))
    gl = pytest.importorskip("gstlearn")
    gl.defineDefaultSpace(gl.ESpaceType.RN, 3)
    with pytest.raises(InputError, match="CUBIC has no counterpart"):
        gu.Variogram.from_gstlearn(gl.Model.createFromParam(gl.ECov.CUBIC, 10.0))
