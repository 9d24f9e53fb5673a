"""Libraries in a process of their own: what they do to it comes back as one line."""

from __future__ import annotations

import textwrap

import numpy as np
import pytest

from geounfold.backends.own_process import call_apart
from geounfold.errors import BackendError

LIBRARY = """
    import os
    import time
    import numpy as np

    def noisy(a, b):
        os.write(1, b"printed below Python\\n")
        print("printed")
        return a + b, a.astype(np.int64)

    def refuses():
        raise RuntimeError("no\\n  manifold")

    def gives_nothing():
        return None

    def leaves():
        os._exit(3)

    def sleeps():
        time.sleep(60)

    def hoards():
        raise MemoryError
"""


@pytest.fixture(autouse=True)
def _library(tmp_path, monkeypatch):
    (tmp_path / "stub_library.py").write_text(textwrap.dedent(LIBRARY))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def test_arrays_go_there_and_back_bit_for_bit_past_what_is_printed(capfd):
    a = np.array([[0.1, 1 / 3], [np.pi, 1e-300]])
    total, whole = call_apart("stub", "stub_library:noisy", {"a": a, "b": 0.1}, 60)
    assert total.tobytes() == (a + 0.1).tobytes()
    assert whole.dtype == np.int64
    assert whole.tolist() == [[0, 0], [3, 0]]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("stub_library:refuses", "^stub failed: no manifold$"),
        ("stub_library:gives_nothing", "^stub failed: .*NoneType"),
        ("stub_library:hoards", "^stub failed: out of memory$"),
        ("stub_library:leaves", "^stub ended without an answer$"),
        ("os:abort", r"^stub crashed \(SIGABRT\)$"),
        ("no_such_library:f", "^stub failed: No module named 'no_such_library'$"),
    ],
)
def test_every_end_is_one_line(function, message):
    with pytest.raises(BackendError, match=message):
        call_apart("stub", function, {}, 60)


def test_a_call_that_takes_too_long_is_stopped():
    with pytest.raises(BackendError, match=r"^stub took longer than 0\.5 s and was stopped$"):
        call_apart("stub", "stub_library:sleeps", {}, 0.5)


def test_a_call_that_cannot_start_says_so(monkeypatch):
    monkeypatch.setattr("sys.executable", "/no/such/python")
    with pytest.raises(BackendError, match=r"^stub could not be started: No such file"):
        call_apart("stub", "stub_library:sleeps", {}, 0.5)
