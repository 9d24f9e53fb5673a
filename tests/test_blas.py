"""The linear algebra library's threads."""

import pytest

from geounfold.backends import blas


def test_one_thread_inside_and_as_many_as_before_afterwards():
    controls = blas._controls()
    if controls is None:
        pytest.skip("SciPy's linear algebra library is not OpenBLAS")
    get, set_ = controls
    before = get()
    set_(2)
    try:
        with blas.one_thread():
            assert get() == 1
        assert get() == 2
    finally:
        set_(before)


def test_other_libraries_are_left_alone(monkeypatch):
    monkeypatch.setattr(blas, "_controls", lambda: None)
    with blas.one_thread():
        pass
