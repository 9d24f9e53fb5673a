"""Layers of prisms: offsets within the focal distance, and past it."""

import numpy as np
import pytest

from geounfold.geometry.measures import tet_volumes
from geounfold.methods.sheet.meshing.footprint import footprint
from geounfold.methods.sheet.meshing.prism_layers import Layers, neighbour_mean, shrink


def bent_layers(radius, reach):
    """Prisms over a cylinder of a radius, bent so that normals meet above."""
    rng = np.random.default_rng(2)
    U = footprint(rng.uniform(-6, 6, (900, 2)), 0.0, 1.0, 0)
    angle = U.U[:, 0] / radius
    P = np.column_stack([radius * np.sin(angle), U.U[:, 1], radius * (1 - np.cos(angle))])
    normal = np.column_stack([-np.sin(angle), np.zeros(len(P)), np.cos(angle)])
    slope = np.column_stack([-angle, np.zeros(len(P))])
    n = len(P)
    curvature = np.stack([np.full(n, 1 / radius), np.full(n, -1 / radius)])
    offset = np.full(n, reach)
    return Layers(P, normal, U.U, slope, -slope, U.F, curvature, offset, offset)


def bad_nodes(layers, T):
    """Nodes of tetrahedra that are not upright in both spaces."""
    volumes = np.stack([tet_volumes(V, T) for V in (layers.folded, layers.unfolded)])
    return np.unique(T[(volumes <= 0).any(axis=0)] % len(layers.P))


def test_offsets_within_the_focal_distance_are_upright_and_shrink_past_it():
    sound = bent_layers(radius=8.0, reach=5.0)
    assert len(bad_nodes(sound, sound.tets())) == 0
    crossed = bent_layers(radius=8.0, reach=9.0)
    bad = bad_nodes(crossed, crossed.tets())
    assert len(bad) > 0
    smaller = shrink(crossed, bad, neighbour_mean(crossed.F, len(crossed.P)))
    assert smaller.up[bad] == pytest.approx(0.9 * crossed.up[bad])
    # The diverging side keeps its reach.
    assert np.array_equal(smaller.down, crossed.down)
