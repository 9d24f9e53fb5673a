"""Conditional simulation: what the realisations honour, their spread, and what is refused."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri

from geounfold.backends import gstlearn
from geounfold.errors import OptionError
from geounfold.estimation import Estimation, Neighbourhood, Structure, Variogram, krige
from geounfold.estimation.realisations import with_realisations

pytest.importorskip("gstlearn", reason="the extra geostat is not installed")

RNG = np.random.default_rng(5)
POINTS = RNG.random((150, 3)) * [100.0, 100.0, 20.0]
HOLES = RNG.integers(0, 20, 150)
SCORES = RNG.permutation(ndtri((np.arange(150) + 0.5) / 150))
MODEL = Variogram(0.2, (Structure("spherical", 0.8, (60, 40, 12)),), (30.0, 0.0, 0.0))
NEAR = Neighbourhood(radii=(200.0, 200.0, 50.0), max_samples=24)
TARGETS = np.concatenate([RNG.random((10, 3)) * [100.0, 100.0, 20.0], POINTS[:3]])


def made(targets: np.ndarray, values: np.ndarray = SCORES, rows: Any = slice(None)) -> Estimation:
    found = krige(POINTS[rows], values[rows], targets, MODEL, NEAR, holes=HOLES[rows])
    flat = SimpleNamespace(points=POINTS[rows], grades=values[rows], holes=HOLES[rows])
    carried = SimpleNamespace(points=targets, location=None)
    return Estimation("CU", found, carried, flat, "ordinary", MODEL, None, NEAR)  # type: ignore[arg-type]


def drawn(result: Estimation, count: int, seed: int = 1) -> np.ndarray:
    out = with_realisations(result, count, seed=seed).realisations
    assert out is not None
    return out


def test_realisations_honour_samples_and_scatter_by_the_kriging_variance() -> None:
    # Grades that are their own normal scores have the mean and variance of simple kriging. The
    # mean of 80 draws has an error of sd / 9, and their variance one of 16 %: of ten targets 5 %.
    got = drawn(made(TARGETS), 80)
    np.testing.assert_allclose(got[10:], np.tile(SCORES[:3, None], 80), atol=1e-6)
    wanted = krige(POINTS, SCORES, TARGETS[:10], MODEL, NEAR, method="simple", mean=0.0)
    off = (got[:10].mean(axis=1) - wanted.estimate) / np.sqrt(wanted.variance / 80)
    assert np.abs(off).max() < 4
    assert got[:10].var(axis=1).mean() == pytest.approx(wanted.variance.mean(), rel=0.2)


def test_skewed_grades_keep_their_distribution() -> None:
    # Far from all samples a realisation is a draw of the samples' grades.
    targets = np.random.default_rng(0).random((400, 3)) * [9e3, 9e3, 1e3] + [1e4, 0, 0]
    wide = Neighbourhood(radii=(1e5, 1e5, 1e5), max_samples=4)
    grades = np.exp(SCORES)
    result = made(targets, grades)
    found = krige(POINTS, grades, targets, MODEL, wide, holes=HOLES)
    far = Estimation("CU", found, *[getattr(result, n) for n in ("carried", "samples")], "ordinary",
                     MODEL, None, wide)  # fmt: skip
    got = drawn(far, 10)
    assert got.min() >= grades.min()
    assert got.max() <= grades.max()
    # 4,000 draws: the median has an error of 2 %, the quarters of 3 %.
    for q in (0.25, 0.5, 0.75):
        assert np.quantile(got, q) == pytest.approx(np.quantile(grades, q), rel=0.12)


def test_rows_in_another_order_and_seeds() -> None:
    order = np.random.default_rng(1).permutation(150)
    one, turned = drawn(made(TARGETS), 2), drawn(made(TARGETS[::-1], rows=order), 2)
    np.testing.assert_array_equal(one, turned[::-1])
    assert np.array_equal(one, drawn(made(TARGETS), 2))
    assert not np.allclose(one[:10], drawn(made(TARGETS), 2, seed=2)[:10])
    result = with_realisations(made(TARGETS), 2)
    assert np.array_equal(result.columns["CU_r2"], one[:, 1])


def test_turning_bands_have_the_model_variogram() -> None:
    # 40 fields at pairs 15 apart along the longest range, hundreds of metres between pairs.
    start = np.random.default_rng(2).random((200, 3)) * [2e4, 2e4, 2e3]
    points = np.concatenate([start, start + 15.0 * MODEL.axes[0]])
    fields = gstlearn.turning_bands(points, MODEL.parts, MODEL.axes, 40, 1)
    gamma = 0.5 * ((fields[:200] - fields[200:]) ** 2).mean()
    wanted = MODEL.gamma(15.0 * MODEL.axes[:1])[0] - MODEL.nugget
    assert gamma == pytest.approx(wanted, rel=0.08)  # 8,000 pairs: 2 %; the bands another 2 %
    assert fields.var() == pytest.approx(0.8, rel=0.08)
    assert not gstlearn.turning_bands(points, [], MODEL.axes, 2, 1).any()


def test_what_realisations_refuse() -> None:
    with pytest.raises(OptionError, match="realisations must be a whole number of 1 or more"):
        with_realisations(made(TARGETS), 0)
    with pytest.raises(OptionError, match="seed must be a whole number of 1 or more"):
        with_realisations(made(TARGETS), 1, seed=0)
    no_model = Estimation(*[getattr(made(TARGETS), n) for n in ("grade", "blocks", "carried",
        "samples")], "nearest", None, None, NEAR)  # fmt: skip
    with pytest.raises(OptionError, match="realisations need a variogram"):
        with_realisations(no_model, 1)
