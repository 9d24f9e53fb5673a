"""The pin line: a mean over the profile that no outline moves."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.methods.sheet.mid_surface.pin_line import CrossSection

STRAIGHT = np.eye(2)


def points(width):
    """Points of a sheet 60 long, so wide at x = 0..60 as ``width`` says, twice in a unit square."""
    rng = np.random.default_rng(3)
    U = rng.uniform([0, -20], [60, 20], (4800, 2))
    return U[np.abs(U[:, 1]) <= width(U[:, 0]) / 2]


def slips(U):
    """Slip along x that grows along x from 0 to 1: its mean over the profile is a half."""
    return np.column_stack([U[:, 0] / 60, np.zeros(len(U))])


def widening(x):
    return 8 + x / 2


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_every_station_counts_once(angle):
    U = points(widening)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    span = np.array([[0.0, -20.0], [60.0, 20.0]])
    found = CrossSection(turn, span).mean(slips(U) @ turn, U @ turn, np.ones(len(U)), 1.5)
    # The mean over the area is 0.5 + 60 / (12 * 46) = 0.61.  A strip's mean lies within its
    # 1.5 / 60 of the profile, evenly on both sides: 40 strips leave a tenth of that.
    assert slips(U).mean(axis=0)[0] == pytest.approx(0.61, abs=0.01)
    assert found == pytest.approx(np.array([0.5, 0.0]) @ turn, abs=0.0025)


def test_stations_without_points_are_bridged():
    U = points(widening)
    U = U[(U[:, 0] < 35) | (U[:, 0] > 50)]
    span = np.array([[0.0, -20.0], [60.0, 20.0]])
    found = CrossSection(STRAIGHT, span).mean(slips(U), U, np.ones(len(U)), 1.5)
    # Without the gap's stations the mean would be (30 - 15 * 42.5 / 60) / 45 = 0.43.
    assert found[0] == pytest.approx(0.5, abs=0.004)


def test_one_station_is_its_own_mean():
    U = np.array([[3.0, 1.0], [3.0, 1.0]])
    values = np.array([[1.0, 2.0], [3.0, 2.0]])
    span = np.array([[2.5, 0.5], [3.5, 1.5]])
    found = CrossSection(STRAIGHT, span).mean(values, U, np.array([1.0, 3.0]), 1.5)
    assert found == pytest.approx([2.5, 2.0])  # (1 + 3 * 3) / 4, and 2


@pytest.mark.parametrize("name", ["neck", "wedge"])
def test_an_outline_does_not_shear_the_body(name):
    body = gu.simulate(name, blocks=8000)
    u = gu.unfold(body.folded)
    side = float(np.prod(body.steps) ** (1 / 3))
    # The truth's pin is the mean heading of the profile.  Measured: shears of 0.02 (neck) and
    # 0.002 (wedge), RMS 0.12 and 0.10 blocks; with the mean over the blocks instead 0.07 and
    # 0.22, RMS 0.19 and 0.57.
    truth = body.truth - body.truth.mean(axis=0)
    centred = u.points - u.points.mean(axis=0)
    left, _, right = np.linalg.svd(centred.T @ truth)
    off = centred @ left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right - truth
    shear = truth[:, 2] @ off[:, :2] / (truth[:, 2] @ truth[:, 2])
    assert np.abs(shear).max() < 0.04
    assert gu.aligned_rms(u.points, body.truth) / side < 0.15
