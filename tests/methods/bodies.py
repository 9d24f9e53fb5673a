"""Bodies and shortcuts for the tests of whole methods."""

from __future__ import annotations

import numpy as np

import geounfold as gu
from geounfold.geometry.mesh import TriMesh
from geounfold.methods import (
    VolumetricOptions,
)

QUICK = VolumetricOptions(max_iter=1)  # one step takes as long as all else


def unfold(X, method, **how):
    how = {"volumetric_options": QUICK, "allow_uncertified": True, **how}
    return gu.unfold(X, method=method, **how)


def inner(W, margin=2.0):
    """Whether blocks lie off the outline of their body, where no hull ends."""
    low, high = W[:, :2].min(axis=0) + margin, W[:, :2].max(axis=0) - margin
    return ((W[:, :2] > low) & (W[:, :2] < high)).all(axis=1)


def tent(slope):
    """Two triangles over the unit square whose ridge runs along y at x = 0."""
    V = np.array([[-1.0, 0, -slope], [0, 0, 0], [0, 1, 0], [-1, 1, -slope], [1, 0, 0], [1, 1, 0]])
    return TriMesh(V, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
