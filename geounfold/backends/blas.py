"""The threads of the linear algebra libraries behind NumPy and SciPy."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module

_USERS = ("numpy.linalg._umath_linalg", "scipy.linalg._flapack")
"""Extension modules that load OpenBLAS; its functions are looked up through them."""

_NAMES = tuple(
    (f"{prefix}openblas_get_num_threads{suffix}", f"{prefix}openblas_set_num_threads{suffix}")
    for prefix in ("scipy_", "")
    for suffix in ("64_", "")
)

Control = tuple[Callable[[], int], Callable[[int], object]]


@cache
def _controls() -> tuple[Control, ...]:
    """Return the functions that get and set the threads of each OpenBLAS that is loaded."""
    found = []
    for user in _USERS:
        try:
            library = ctypes.CDLL(str(import_module(user).__file__))
        except (ImportError, OSError):  # another build, without OpenBLAS
            continue
        for getter, setter in _NAMES:
            if hasattr(library, getter) and hasattr(library, setter):
                found.append((getattr(library, getter), getattr(library, setter)))
                break
    return tuple(found)


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep OpenBLAS to one thread, in the whole process.

    On narrow matrices its threads gain nothing, and they wait for each other by spinning: if
    another process uses one of two cores, factoring a band takes ten to a hundred times longer
    with two threads than with one. Other libraries than OpenBLAS keep their threads.
    """
    controls = _controls()
    before = [get() for get, _ in controls]
    for _, set_threads in controls:
        set_threads(1)
    try:
        yield
    finally:
        for (_, set_threads), count in zip(controls, before, strict=True):
            set_threads(count)
