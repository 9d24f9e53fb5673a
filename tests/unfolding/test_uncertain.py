"""The uncertainty of a run: its bodies in the data's unit, and the joining of fault blocks."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from geounfold.body.working_frame import Frame
from geounfold.quality.uncertainty import Spread
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.uncertain import uncertainty_of

FRAME = Frame(np.array([100.0, 0, 0]), np.eye(3), 10.0, None)
OPTIONS = UnfoldOptions(uncertainty=8)


def body(size: float) -> Any:
    field = {"noise": np.full(2, size**2)}
    return SimpleNamespace(spread=Spread(np.array([[0.0, 0, 0], [1.0, 0, 0]]), field, field, ()))


def test_bodies_are_joined_in_the_datas_unit() -> None:
    found = uncertainty_of([body(0.1), body(0.3)], FRAME, OPTIONS)
    assert found is not None
    assert found.points[:, 0].tolist() == [100, 110, 100, 110]
    # Of blocks of 10: the noise itself, and the floor of 0.003 blocks.
    assert found.sd[:, 1] == pytest.approx([1, 1, 3, 3], rel=1e-3)
    assert uncertainty_of([SimpleNamespace(spread=None)], FRAME, OPTIONS) is None  # type: ignore[list-item]


def test_the_worst_misfit_of_the_cut_offs_is_an_error_along_the_layers() -> None:
    slips = [None, SimpleNamespace(misfit=0.2), SimpleNamespace(misfit=1.2)]
    faulted = cast(Any, SimpleNamespace(faults=[SimpleNamespace(slips=s) for s in slips]))
    found = uncertainty_of([body(0.1)], FRAME, OPTIONS, faulted)
    assert found is not None
    # Half of 1.2 blocks, 0.08 of every joining, and 0.1 of noise.
    assert found.sd[:, 0] == pytest.approx(10 * np.sqrt(0.6**2 + 0.08**2 + 0.1**2), rel=1e-3)
    assert found.sd[:, 1] == pytest.approx(1.0, rel=1e-3)
