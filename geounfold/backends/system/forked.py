"""A run in a process that is forked (Linux)."""

from __future__ import annotations

import os
import signal
import threading
import time

from geounfold.backends.system.parent import end_with
from geounfold.backends.system.signals import heeded
from geounfold.backends.system.worker import drained, keep_aside, limit_threads

_PAUSE = 0.02  # s, the shortest wait


def can_fork() -> bool:
    """Return whether runs are forked.

    macOS has a fork, but its own libraries do not work in a forked process; it has no
    ``sigtimedwait`` either.
    """
    return hasattr(os, "fork") and hasattr(signal, "sigtimedwait")


def is_threaded() -> bool:
    """Return whether this process has threads, which a fork does not take along."""
    return threading.active_count() > 1


class Forked:
    """Both sides of a fork.

    Parameters
    ----------
    verbose : bool
        Show what libraries write to stderr; otherwise it is looked at after a crash only.

    Attributes
    ----------
    inside : bool
        Whether this is the new process.
    journal : int
        File descriptor to write the journal to, in the new process.
    """

    def __init__(self, *, verbose: bool) -> None:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self._mask = signal.pthread_sigmask(signal.SIG_BLOCK, [*heeded(), signal.SIGCHLD])
        self._notes, self.journal = os.pipe()
        self._noise, stderr = os.pipe()
        parent = os.getpid()
        self._worker = os.fork()
        self.inside = self._worker == 0
        if self.inside:
            os.close(self._notes)
            os.close(self._noise)
            end_with(parent)
            limit_threads()
            if not verbose:
                os.set_blocking(stderr, False)
                keep_aside(stderr)
        else:
            os.close(self.journal)
            os.close(stderr)
            for handle in (self._notes, self._noise):
                os.set_blocking(handle, False)

    def ready(self) -> None:
        """Let signals in, those that have come already included."""
        signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)

    def wait(self, seconds: float | None) -> tuple[signal.Signals | None, int | None]:
        """See Worker."""
        awaited = [*heeded(), signal.SIGCHLD]
        end = None if seconds is None else time.monotonic() + seconds
        if end is None:
            got: signal.Signals | None = signal.Signals(signal.sigwait(awaited))
        else:
            info = signal.sigtimedwait(awaited, max(_PAUSE, end - time.monotonic()))
            got = None if info is None else signal.Signals(info.si_signo)
        ended, code = os.waitpid(self._worker, os.WNOHANG)
        stop = None if got == signal.SIGCHLD else got
        return stop, os.waitstatus_to_exitcode(code) if ended else None

    def stop(self, number: signal.Signals) -> None:
        """See Worker."""
        os.kill(self._worker, number)

    def kill(self) -> int:
        """See Worker."""
        os.kill(self._worker, signal.SIGKILL)
        return os.waitstatus_to_exitcode(os.waitpid(self._worker, 0)[1])

    def notes(self) -> bytes:
        """See Worker."""
        return drained(self._notes)

    def noise(self) -> bytes:
        """See Worker."""
        return drained(self._noise)

    def close(self) -> None:
        """See Worker."""
        os.close(self._notes)
        os.close(self._noise)
