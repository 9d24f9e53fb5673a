"""The field case of a closed wireframe: every format is filled with the body's own blocks."""

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from tests.places import shared


@pytest.mark.parametrize("kind", ["dxf", "obj", "omf", "stl", "ts"])
def test_a_shell_of_blocks_is_filled_with_these_blocks(tmp_path, kind):
    path = shared("field", "inputs", "15_solid_as_body", f"solid.{kind}")
    assert main(["fill", str(path), "-o", str(tmp_path / "b.csv")]) == 0
    blocks = pd.read_csv(tmp_path / "b.csv")
    # The shell is that of the 4,005 blocks of 10 m in ../base.
    assert len(blocks) == 4005
    assert (blocks[["dx", "dy", "dz"]] == 10).to_numpy().all()
    assert np.allclose(blocks[["x", "y", "z"]] % 10, blocks[["x", "y", "z"]].iloc[0] % 10)


def test_it_is_unfolded_in_one_command(tmp_path):
    path = shared("field", "inputs", "15_solid_as_body", "solid.ts")
    out = tmp_path / "o.csv"
    assert main(["unfold", str(path), "-o", str(out)]) == 0
    flat = pd.read_csv(out)
    assert len(flat) == 4005
    assert flat.location.eq("inside").all()
    assert -0.1 < flat.stratigraphic.min() < 0.2 < 0.8 < flat.stratigraphic.max() < 1.1
