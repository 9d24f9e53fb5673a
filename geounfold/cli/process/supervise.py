"""A run in a process of its own, so that it always ends with a status, a line and a clean disk.

Python sees a signal only between two of its own instructions, and a library's call may take
seconds; libraries also abort, or are killed by the system for want of memory. The process that
was started therefore computes nothing. It forks one that does, waits, and hands signals on.
A run that does not stop within GRACE is killed; what it left of outputs is removed, and what
became of it is said in one line.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from geounfold.backends.threads import memory_is_limited
from geounfold.cli.process.journal import Account, Journal
from geounfold.cli.process.signals import STOPS, heeded, stoppable
from geounfold.cli.terminal.console import Console

GRACE = 0.5
"""Seconds that a run has to stop by itself."""

_MOVING = (
    10.0  # ... and, beyond them, to move outputs in place, which takes no time where disks work
)
_ENDING = 5.0  # ... or to leave once all is written
_TELLING = 2.0  # ... or to say its last line, on a machine that has no time for it
_PAUSE = 0.02
_NOISE = 1 << 16
_MEMORY = re.compile(r"bad_alloc|alloc|memory", re.IGNORECASE)
_CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGILL, signal.SIGFPE)

Run = Callable[[Journal, Callable[[], None]], int]
"""A run: keeps a journal, its end included, calls the second argument once it can be stopped, and
returns its status."""


def supervised(run: Run, console: Console, *, verbose: bool = False) -> int:
    """Return the exit status of a run in a process of its own.

    Returns twice, as fork does: in the new process with what `run` returns.

    Parameters
    ----------
    run : callable
        See Run.
    console : Console
        For what the run can no longer say itself.
    verbose : bool, optional
        Show what libraries write to stderr; without, it is looked at after a crash only.
    """
    if threading.active_count() > 1 or not hasattr(signal, "sigtimedwait"):
        with stoppable():
            return run(Journal(), lambda: None)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [*heeded(), signal.SIGCHLD])
    notes, journal = os.pipe()
    noise, stderr = os.pipe()
    parent = os.getpid()
    worker = os.fork()
    if worker == 0:
        os.close(notes)
        os.close(noise)
        _die_with(parent)
        if memory_is_limited():  # OpenBLAS tries for ever where its threads find no memory
            os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        if not verbose:
            _keep_aside(stderr)
        with stoppable(restore=False):
            return run(Journal(journal), lambda: _unmask(mask))
    os.close(journal)
    os.close(stderr)
    return _Watch(worker, notes, noise, console).status()


def _unmask(mask: set[signal.Signals | int]) -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _die_with(parent: int) -> None:
    """Have the system kill this process when its parent dies (Linux)."""
    with suppress(AttributeError, OSError, ImportError):
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(1)


def _keep_aside(pipe: int) -> None:
    """Send what libraries write to stderr into a pipe, and Python's own where it went."""
    if sys.stderr is None:
        return
    os.set_blocking(pipe, False)
    own = os.dup(2)
    sys.stderr.flush()
    sys.stderr = os.fdopen(own, "w", 1, sys.stderr.encoding, "backslashreplace")
    os.dup2(pipe, 2)


class _Watch:
    """Waits for the process of a run."""

    def __init__(self, worker: int, notes: int, noise: int, console: Console) -> None:
        self._worker = worker
        self._notes, self._noise = notes, noise
        self._console = console
        self._read = b""
        self._stop: signal.Signals | None = None
        for handle in (notes, noise):
            os.set_blocking(handle, False)

    def status(self) -> int:
        """Return the status to leave with, once the run is over and cleared away."""
        code = self._wait()
        account = self._account()
        for part in account.parts:
            shutil.rmtree(part, ignore_errors=True)
        if account.status is not None:
            return account.status
        outputs = "all outputs were written" if account.written else "nothing was written"
        status, words = self._explained(code)
        self._console.error(f"{words}; {outputs}")
        return status

    def _wait(self) -> int:
        """Return the run's exit code (negative: the signal that killed it); hand signals on."""
        awaited = [*heeded(), signal.SIGCHLD]
        deadline: float | None = None
        while True:
            if deadline is None:
                got: signal.Signals | None = signal.Signals(signal.sigwait(awaited))
            else:
                info = signal.sigtimedwait(awaited, max(_PAUSE, deadline - time.monotonic()))
                got = None if info is None else signal.Signals(info.si_signo)
            ended, code = os.waitpid(self._worker, os.WNOHANG)
            if ended:
                return os.waitstatus_to_exitcode(code)
            now = time.monotonic()
            if got in STOPS:
                self._stop = self._stop or signal.Signals(got)
                deadline = now + GRACE if deadline is None else deadline
                os.kill(self._worker, got)
            if deadline is not None and now >= deadline + self._patience():
                os.kill(self._worker, signal.SIGKILL)
                return os.waitstatus_to_exitcode(os.waitpid(self._worker, 0)[1])

    def _patience(self) -> float:
        """Return how long to wait beyond GRACE for a run that is past stopping."""
        account = self._account()
        if account.status is not None:
            return _TELLING
        if account.committing:
            return _MOVING
        return _ENDING if account.written else 0.0

    def _account(self) -> Account:
        self._read += _drained(self._notes)
        return Account.of(self._read)

    def _explained(self, code: int) -> tuple[int, str]:
        """Return the exit status and why the run ended without a word."""
        number = None if code >= 0 else -code
        stop = self._stop or (signal.Signals(number) if number in {*STOPS} else None)
        if stop is not None:
            return 128 + stop, STOPS[stop]
        noise = _drained(self._noise).decode("utf-8", "replace")
        if _MEMORY.search(noise) or (number in _CRASHES and memory_is_limited()):
            return 1, "out of memory"
        if number == signal.SIGKILL:
            return 1, "killed, as the system does where memory runs out"
        how = "ended the run" if number is None else f"crashed ({signal.Signals(number).name})"
        last = noise.strip().splitlines()[-1:]
        return 1, f"a library {how}" + (f": {last[0].strip()}" if last else "")


def _drained(pipe: int) -> bytes:
    """Return what a pipe holds."""
    text = b""
    with suppress(BlockingIOError):
        while more := os.read(pipe, _NOISE):
            text += more
    return text
