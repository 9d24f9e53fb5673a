"""The memory that this process has used."""

from __future__ import annotations

import resource


def peak_memory_mb() -> float:
    """Return the largest resident memory of this process so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
