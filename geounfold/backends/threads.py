"""Work on slices of arrays by all cores.

NumPy's loops run without Python's lock, so threads run at the same time. Slices have a fixed size
and do not depend on each other, so the answer is the same for every number of cores.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from geounfold.backends.system.processors import cores

__all__ = ["cores", "over_slices", "slices"]

T = TypeVar("T")


def slices(count: int, size: int) -> Iterator[slice]:
    """Yield slices of ``size`` rows, the last one shorter, that cover ``count`` rows.

    >>> list(slices(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def over_slices(work: Callable[[slice], T], count: int, size: int) -> list[T]:
    """Return what ``work`` returns for every slice of ``count`` rows, in their order.

    Parameters
    ----------
    work : callable
        Called with one slice. It may write that slice of arrays and nothing else.
    count, size : int
        Number of rows in all, and of a slice.

    Examples
    --------
    >>> over_slices(lambda rows: rows.stop - rows.start, 5, 2)
    [2, 2, 1]
    """
    parts = list(slices(count, size))
    if len(parts) < 2 or cores() < 2:
        return [work(part) for part in parts]
    with ThreadPoolExecutor(min(cores(), len(parts))) as pool:
        return list(pool.map(work, parts))
