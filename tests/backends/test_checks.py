"""libigl's exceptions are renamed, its answers checked."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.backends.checks import call_libigl, finite_array
from geounfold.errors import BackendError


def test_what_libigl_returns_is_passed_on():
    assert call_libigl("sum", lambda a, b: a + b, 1, 2) == 3
    given = np.arange(6.0).reshape(3, 2)
    assert finite_array(given, (3, 2), "lscm") is given


def test_a_runtime_error_is_renamed():
    def refuse(mesh):
        raise RuntimeError(f"no {mesh}")

    with pytest.raises(BackendError, match=r"^libigl's lscm failed: no mesh$"):
        call_libigl("lscm", refuse, "mesh")


def test_other_errors_are_not_renamed():
    with pytest.raises(TypeError, match="positional argument"):
        call_libigl("lscm", lambda: None, "mesh")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((2, 3)), r"lscm returned an array of shape \(2, 3\) instead of \(3, 2\)"),
        (np.full((3, 2), np.inf), "lscm returned values that are not finite"),
        ([[0, 1], [1, 0], [np.nan, 1]], "lscm returned values that are not finite"),
    ],
)
def test_other_shapes_and_values_that_are_not_finite_are_refused(values, message):
    with pytest.raises(BackendError, match=message):
        finite_array(values, (3, 2), "lscm")
