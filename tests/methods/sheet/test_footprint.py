"""The footprint of the blocks on the mid surface is one part."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.errors import ControlMeshError
from geounfold.methods.sheet.meshing.footprint import footprint


@pytest.mark.parametrize("apart", [[12.0, 0.0], [7.0, 9.0], [-30.0, 3.0]])
def test_parts_far_apart_are_an_error(apart: list[float]) -> None:
    U = np.random.default_rng(1).uniform(0, 5, (300, 2))
    footprint(U, 0.7, 1.0, dilation=1)
    with pytest.raises(ControlMeshError, match="in 2 parts that do not touch"):
        footprint(np.concatenate([U, U[:40] + apart]), 0.7, 1.0, dilation=1)


def test_a_slab_of_few_blocks_stays_flat() -> None:
    # All its sites lie near its rim, so that none speaks against the first fit.
    X = np.stack(np.meshgrid(*(np.arange(float(n)) for n in (30, 20, 4)), indexing="ij"), -1)
    X = X.reshape(-1, 3)
    u = gu.unfold(X)
    # Measured 0.003 of a block; 0.1 where it was fitted again all the same.
    assert gu.aligned_rms(u.points, X) < 0.02
