"""A run in a process of its own, as the process that watches it sees it."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from geounfold.backends.system.memory import memory_is_limited

Run = Callable[[list[str], int | None, Callable[[], None]], int]
"""A run. It takes the command's words, a file descriptor to write its journal to and a function to
call once it can be stopped, and returns its exit status."""

_MEMORY = re.compile(r"bad_alloc|alloc|memory", re.IGNORECASE)

_CRASHES = {
    signal.Signals[name]
    for name in ("SIGSEGV", "SIGABRT", "SIGBUS", "SIGILL", "SIGFPE")
    if hasattr(signal, name)
}

_NO_MEMORY = 0xC0000017  # STATUS_NO_MEMORY of ntstatus.h

_STATUSES = {
    0xC0000005: "access violation",
    0xC000001D: "illegal instruction",
    0xC0000094: "division by zero",
    0xC00000FD: "stack overflow",
    0xC0000374: "heap corruption",
    0xC0000409: "abort",
}
"""Exit codes of crashes on Windows (ntstatus.h)."""


class Worker(Protocol):
    """A run in a process of its own."""

    def wait(self, seconds: float | None) -> tuple[signal.Signals | None, int | None]:
        """Wait for a signal, the run's end, or some seconds.

        Parameters
        ----------
        seconds : float or None
            Longest time to wait, s; None has no limit.

        Returns
        -------
        Signals or None
            The stop that came to this process.
        int or None
            The run's exit code (negative: the signal that killed it).
        """

    def stop(self, number: signal.Signals) -> None:
        """Have the run stop by itself, as by this signal."""

    def kill(self) -> int:
        """End the run at once, and return its exit code."""

    def notes(self) -> bytes:
        """Return what the run has added to its journal since the last call."""

    def noise(self) -> bytes:
        """Return what libraries wrote to stderr."""

    def close(self) -> None:
        """Remove what the two processes shared."""


def limit_threads() -> None:
    """Keep OpenBLAS to one thread where memory is limited: for more it tries for ever."""
    if memory_is_limited():
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def keep_aside(handle: int) -> None:
    """Send what libraries write to stderr to a file descriptor, and Python's own where it went."""
    if sys.stderr is None:
        return
    own = os.dup(2)
    sys.stderr.flush()
    sys.stderr = os.fdopen(own, "w", 1, sys.stderr.encoding, "backslashreplace")
    os.dup2(handle, 2)


def end_of(code: int, noise: str) -> str:
    """Return words for how a process ended that gave no answer.

    Parameters
    ----------
    code : int
        Its exit code; negative: the signal that killed it.
    noise : str
        What libraries wrote to its stderr.
    """
    crash = crash_of(code)
    if crash is not None:
        return f"crashed ({crash})"
    last = noise.strip().splitlines()[-1:]
    return "ended without an answer" + (f": {last[0].strip()}" if last else "")


def crash_of(code: int) -> str | None:
    """Return the name of the crash behind an exit code, or None if it is none.

    Examples
    --------
    >>> crash_of(-11), crash_of(0xC0000005), crash_of(3)
    ('SIGSEGV', 'access violation', None)
    """
    if -128 < code < 0:
        known = {each.value: each.name for each in signal.Signals}
        return known.get(-code, f"signal {-code}")
    unsigned = code & 0xFFFFFFFF
    return _STATUSES.get(unsigned, f"{unsigned:#x}") if unsigned >= 0xC0000000 else None


def lacks_memory(code: int, noise: str) -> bool:
    """Return whether a process ended for want of memory."""
    crashed = -code in _CRASHES and memory_is_limited()
    return bool(_MEMORY.search(noise)) or crashed or code & 0xFFFFFFFF == _NO_MEMORY


def was_killed(code: int) -> bool:
    """Return whether the system or another process ended it at once."""
    return hasattr(signal, "SIGKILL") and code == -signal.SIGKILL


def drained(pipe: int) -> bytes:
    """Return what a pipe that does not block holds."""
    text = b""
    with suppress(BlockingIOError):
        while more := os.read(pipe, 1 << 16):
            text += more
    return text


def content_of(path: Path, start: int = 0) -> bytes:
    """Return a file's content from a place on, or nothing if there is no such file."""
    try:
        with path.open("rb") as stream:
            stream.seek(start)
            return stream.read()
    except OSError:
        return b""
