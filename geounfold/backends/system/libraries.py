"""The system's libraries that drawing needs, and the system's name."""

from __future__ import annotations

import ctypes
import platform

_DRAWING = ("libX11.so.6", "libGL.so.1", "libEGL.so.1")  # Linux; others have theirs built in


def system_name() -> str:
    """Return the system's name and release, for a report of what is installed."""
    return platform.platform()


def missing_for_drawing() -> tuple[str, ...]:
    """Return the system's libraries of OpenGL that cannot be loaded (Linux)."""
    if platform.system() != "Linux":
        return ()
    return tuple(name for name in _DRAWING if not _loads(name))


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
