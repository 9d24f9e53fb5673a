"""The linear algebra libraries' threads."""

import pytest

from geounfold.backends import blas


def test_one_thread_inside_and_as_many_as_before_afterwards():
    controls = blas._controls()
    if not controls:
        pytest.skip("neither NumPy nor SciPy uses OpenBLAS")
    before = [get() for get, _ in controls]
    for _, set_threads in controls:
        set_threads(2)
    try:
        with blas.one_thread():
            assert [get() for get, _ in controls] == [1] * len(controls)
        assert [get() for get, _ in controls] == [2] * len(controls)
    finally:
        for (_, set_threads), count in zip(controls, before, strict=True):
            set_threads(count)


def test_other_libraries_are_left_alone(monkeypatch):
    monkeypatch.setattr(blas, "_controls", lambda: ())
    with blas.one_thread():
        pass
