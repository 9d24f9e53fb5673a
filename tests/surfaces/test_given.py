"""Surfaces that are given as top and bottom."""

import numpy as np
import pytest

from geounfold.errors import InputError
from geounfold.geometry.mesh import TriMesh
from geounfold.surfaces.given import split_reference
from tests.shapes import plane


def level(z):
    """A square of 19 cells a side at a height."""
    nodes, F = plane(19, 19)
    return TriMesh(np.column_stack([nodes, np.full(len(nodes), z)]), F)


def test_reference_surfaces_are_turned_away_from_each_other():
    top, bottom = level(3.0), level(-2.0)
    for upper, lower in ((top, bottom), (TriMesh(top.V, top.F[:, ::-1]), bottom)):
        parts = split_reference(upper, lower)
        inner = ~parts.rim
        assert parts.thickness[inner] == pytest.approx(5.0)
        assert parts.median_thickness == pytest.approx(5.0)
        assert (parts.side[parts.opposite[inner]] == -parts.side[inner]).all()


def test_reference_surfaces_that_do_not_meet_are_refused():
    far = TriMesh(np.add(level(0.0).V, [100.0, 0, 0]), level(0.0).F)
    with pytest.raises(InputError, match="do not face each other"):
        split_reference(level(3.0), far)
