"""The threads of the linear algebra library behind SciPy."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

from scipy.linalg import lapack

_GETTERS_AND_SETTERS = tuple(
    (f"{prefix}openblas_get_num_threads{suffix}", f"{prefix}openblas_set_num_threads{suffix}")
    for prefix in ("scipy_", "")
    for suffix in ("", "64_")
)


@cache
def _controls() -> tuple[Callable[[], int], Callable[[int], None]] | None:
    """Return OpenBLAS' functions that get and set its threads; None with another library."""
    module = getattr(lapack, "_flapack", None)
    path = getattr(module, "__file__", None)
    if path is None:
        return None
    try:
        library = ctypes.CDLL(path)  # its symbols include those of the libraries it needs
    except OSError:
        return None
    for getter, setter in _GETTERS_AND_SETTERS:
        if hasattr(library, getter) and hasattr(library, setter):
            return getattr(library, getter), getattr(library, setter)
    return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep SciPy's OpenBLAS to one thread.

    Its threads wait for each other by spinning after every small block: the factorisation of a
    band takes ten to a hundred times longer with two threads when another process has one of the
    cores, and hardly less when none has.  With other libraries nothing is changed.
    """
    controls = _controls()
    if controls is None:
        yield
        return
    get, set_ = controls
    before = get()
    set_(1)
    try:
        yield
    finally:
        set_(before)
