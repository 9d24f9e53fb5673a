"""Results are the same bits whatever the number of threads."""

import os
import subprocess
import sys

import pytest

from geounfold.backends import threads
from geounfold.backends.system.memory import memory_is_limited

CODE = """
import hashlib, sys
import numpy as np
import geounfold as gu
from geounfold.backends import threads
threads.cores = lambda: int(sys.argv[1])
u = gu.unfold(gu.simulate("plunging", width=150.0).folded)
arrays = [u.points, u.stratigraphic, u.carried.element, *u.columns.values()]
arrays += [u.to_folded(u.points), np.array([u.round_trip_max, u.quality.nmd.mean])]
print(hashlib.sha256(b"".join(a.tobytes() for a in arrays)).hexdigest())
"""


def test_one_and_two_threads_give_the_same_bits():
    found = []
    for count in ("1", "2"):
        environment = {**os.environ, "OMP_NUM_THREADS": count, "OPENBLAS_NUM_THREADS": count}
        done = subprocess.run(
            [sys.executable, "-c", CODE, count],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=300,
        )
        found.append(done.stdout.strip())
    assert len(found[0]) == 64
    assert found[0] == found[1]


def test_slices_cover_all_rows_once_and_in_order():
    for count, size in [(0, 3), (1, 3), (3, 3), (10, 3)]:
        rows = [k for part in threads.slices(count, size) for k in range(part.start, part.stop)]
        assert rows == list(range(count))


def test_an_error_in_a_slice_is_raised(monkeypatch):
    monkeypatch.setattr(threads, "cores", lambda: 2)

    def work(rows):
        if rows.start == 4:
            raise ValueError("the third slice")

    with pytest.raises(ValueError, match="the third slice"):
        threads.over_slices(work, 10, 2)


def test_where_memory_is_limited_there_are_no_threads_to_wait_for():
    # CPython waits for ever for a thread that could not start for lack of memory.
    code = """
import resource
from geounfold.backends import threads
from geounfold.backends.system.memory import memory_is_limited
before = memory_is_limited()
limit = 1 << 40
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
print(before, memory_is_limited(), threads.cores())
"""
    pytest.importorskip("resource", reason="Windows has no limit of memory")
    if memory_is_limited():
        pytest.skip("the tests run with limited memory themselves")
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == ["False", "True", "1"]
