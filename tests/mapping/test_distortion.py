"""Distortion of control meshes whose deformation is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from geounfold.errors import ControlMeshError
from geounfold.geometry.mesh import TetMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.distortion import deformation_gradients, distortion, edge_change, tet_edges
from tests.shapes import CUBE, SIX

# Sums of ten products of numbers near 1: a few units in the last place.
ROUNDING = 1e-12


def affine(J, folded=CUBE):
    """Return a control mesh that the matrix J deforms, moved off the origin in both spaces."""
    mesh = TetMesh(folded + 7, SIX)
    return ControlMesh(mesh, mesh.with_vertices(folded @ np.asarray(J).T - 3), np.zeros(len(CUBE)))


def rotation(axis, angle):
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def test_gradient_is_the_matrix_that_deformed_the_mesh():
    J = np.array([[1.1, 0.2, -0.3], [0.1, 0.9, 0.4], [0.0, -0.2, 1.3]])
    assert_allclose(deformation_gradients(affine(J)), np.tile(J, (6, 1, 1)), atol=ROUNDING)
    assert_allclose(deformation_gradients(affine(J), np.array([4]))[0], J, atol=ROUNDING)


def test_principal_stretches_and_ratios_of_a_stretch():
    d = distortion(deformation_gradients(affine(np.diag([2.0, 0.5, 3.0]))))
    assert_allclose(d.volume_ratio, 3.0, rtol=ROUNDING)
    assert_allclose(d.stretch_min, 0.5, rtol=ROUNDING)
    assert_allclose(d.stretch_max, 3.0, rtol=ROUNDING)
    assert_allclose(d.thickness_ratio, 3.0, rtol=ROUNDING)
    assert_allclose(d.area_ratio, 1.0, rtol=ROUNDING)
    assert_allclose(d.shear, 0.0, atol=ROUNDING)


def test_a_rigid_motion_distorts_nothing():
    d = distortion(deformation_gradients(affine(rotation([1, 2, -1], 1.1))))
    for ratio in (d.volume_ratio, d.stretch_min, d.stretch_max, d.thickness_ratio, d.area_ratio):
        assert_allclose(ratio, 1.0, rtol=ROUNDING)
    assert_allclose(d.shear, 0.0, atol=ROUNDING)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_shear_is_the_tilt_of_the_normal_however_the_folded_layer_lies(angle):
    """Shear s along the layer: volume and thickness kept, tangent of the tilt s."""
    s = 0.6
    slip = np.array([[1, 0, s * np.cos(1.0)], [0, 1, s * np.sin(1.0)], [0, 0, 1]])
    d = distortion((slip @ rotation([1, -1, 0.3], angle))[None])
    assert_allclose(d.shear, s, rtol=ROUNDING)
    assert_allclose(d.volume_ratio, 1.0, rtol=ROUNDING)
    assert_allclose(d.thickness_ratio, 1.0, rtol=ROUNDING)
    # Simple shear (e.g. Ramsay & Huber 1983): the stretches are s/2 +- sqrt(1 + s^2/4), inverse.
    assert_allclose(d.stretch_max, s / 2 + np.sqrt(1 + s * s / 4), rtol=ROUNDING)
    assert_allclose(d.stretch_min * d.stretch_max, 1.0, rtol=ROUNDING)


def test_an_inside_out_element_keeps_its_sign():
    d = distortion(deformation_gradients(affine(np.diag([1.0, 1.0, -1.0]))))
    assert_allclose(d.volume_ratio, -1.0, rtol=ROUNDING)
    assert_allclose(d.area_ratio, -1.0, rtol=ROUNDING)


def test_edges_grow_positive_and_shrink_negative():
    control = affine(np.diag([1.5, 0.5, 1.0]))
    change = edge_change(control.folded, control.unfolded)
    assert len(change) == len(tet_edges(SIX)) == 19  # 12 sides, 6 face diagonals, 1 through
    assert_allclose([change.min(), change.max()], [-0.5, 0.5], rtol=ROUNDING)


def test_a_folded_element_without_volume_is_refused():
    flat = CUBE * [1, 1, 0]
    with pytest.raises(ControlMeshError, match="6 folded tetrahedra have no volume"):
        deformation_gradients(affine(np.eye(3), flat))
    with pytest.raises(ControlMeshError, match="4 folded edges have no length"):
        edge_change(affine(np.eye(3), flat).folded, affine(np.eye(3)).unfolded)


def test_an_unfolded_element_without_thickness_is_refused():
    with pytest.raises(ControlMeshError, match="1 tetrahedra have no thickness"):
        distortion(np.diag([1.0, 1.0, 0.0])[None])
