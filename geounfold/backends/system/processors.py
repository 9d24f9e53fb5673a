"""How many processors this process may use."""

from __future__ import annotations

import os

from geounfold.backends.system.memory import memory_is_limited


def cores() -> int:
    """Return how many cores this process may use.

    If its memory is limited, one: Python waits for ever for a thread that finds no memory to
    start.
    """
    if memory_is_limited():
        return 1
    if hasattr(os, "sched_getaffinity"):  # neither macOS nor Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
