"""The memory that this process has used, and whether it is limited."""

from __future__ import annotations

import sys

_MIB = 1 << 20

_UNIT = 1 if sys.platform == "darwin" else 1 << 10
"""Bytes of one unit of ``ru_maxrss``: macOS counts bytes, Linux kibibytes (getrusage(2))."""


def peak_memory_mb() -> float:
    """Return the largest resident memory of this process so far, MiB."""
    try:
        import resource
    except ImportError:
        from geounfold.backends.system.working_set import peak_working_set

        return peak_working_set() / _MIB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _UNIT / _MIB


def memory_is_limited() -> bool:
    """Return whether the process's memory is limited (``ulimit -v``)."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return False
    return bool(resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY)
