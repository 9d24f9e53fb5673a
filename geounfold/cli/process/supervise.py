"""A run in a process of its own, so that it always ends with a status, a line and a clean disk.

Python sees a signal only between two of its own instructions, and a library's call may take
seconds; libraries also abort, or are killed by the system for want of memory. The process that
was started therefore computes nothing. It starts one that does, by a fork or as a new interpreter,
waits, and hands signals on. A run that does not stop within GRACE is killed. Then what it left of
outputs is removed, and one line says how it ended.
"""

from __future__ import annotations

import errno
import shutil
import time
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.backends.system.forked import Forked, can_fork, is_threaded
from geounfold.backends.system.signals import STOPS, stoppable
from geounfold.backends.system.worker import crash_of, lacks_memory, was_killed
from geounfold.cli.process.journal import Account
from geounfold.cli.terminal.console import Console

if TYPE_CHECKING:
    from geounfold.backends.system.worker import Run, Worker

GRACE = 0.5
"""Seconds that a run has to stop by itself."""

_MOVING = (
    10.0  # ... and, beyond them, to move outputs in place, which takes no time where disks work
)
_ENDING = 5.0  # ... or to leave once all is written
_TELLING = 2.0  # ... or to say its last line, on a machine that has no time for it
_PAUSE = 0.02  # shortest wait


def supervised(run: str, words: list[str], console: Console, *, verbose: bool = False) -> int:
    """Return the exit status of a run in a process of its own.

    Returns twice if the process is forked: in the new process with the run's own status.

    Parameters
    ----------
    run : str
        ``module:function`` of a Run; without a watching process, its journal is None.
    words : list of str
        The command's words.
    console : Console
        For what the run can no longer say itself.
    verbose : bool, optional
        Show what libraries write to stderr; without, it is looked at after a crash only.
    """
    if can_fork() and is_threaded():
        with stoppable():
            return _function(run)(words, None, lambda: None)
    if can_fork():
        fork = Forked(verbose=verbose)
        if fork.inside:
            with stoppable(restore=False):
                return _function(run)(words, fork.journal, fork.ready)
        return _Watch(fork, console).status()
    from geounfold.backends.system.spawned import Spawned

    try:
        worker = Spawned(run, f"{__name__}:unfinished", words, verbose=verbose)
    except OSError as error:
        if error.errno != errno.ENOMEM:
            raise
        console.error("out of memory; nothing was written")
        return 1
    return _Watch(worker, console).status()


def _function(name: str) -> Run:
    module, _, function = name.partition(":")
    found: Run = getattr(import_module(module), function)
    return found


def unfinished(journal: bytes) -> tuple[list[Path], bool]:
    """Return what must not stay on the disk, and whether outputs are moved in place or have been.

    Parameters
    ----------
    journal : bytes
        A journal as read.
    """
    account = Account.of(journal)
    return [*account.parts], account.committing or account.written


class _Watch:
    """Waits for the process of a run."""

    def __init__(self, worker: Worker, console: Console) -> None:
        self._worker = worker
        self._console = console
        self._read = b""
        self._stop: int | None = None

    def status(self) -> int:
        """Return the status to leave with, once the run is over and cleared away."""
        code = self._wait()
        account = self._account()
        noise = self._worker.noise().decode("utf-8", "replace")
        for part in account.parts:
            shutil.rmtree(part, ignore_errors=True)
        self._worker.close()
        if account.status is not None:
            return account.status
        outputs = "all outputs were written" if account.written else "nothing was written"
        status, words = self._explained(code, noise)
        self._console.error(f"{words}; {outputs}")
        return status

    def _wait(self) -> int:
        """Return the run's exit code (negative: the signal that killed it); hand signals on."""
        deadline: float | None = None
        while True:
            left = None if deadline is None else max(_PAUSE, deadline - time.monotonic())
            stop, code = self._worker.wait(left)
            if stop is not None:
                self._stop = self._stop or stop
            if code is not None:
                return code
            now = time.monotonic()
            if stop is not None:
                deadline = now + GRACE if deadline is None else deadline
                self._worker.stop(stop)
            if deadline is not None and now >= deadline + self._patience():
                return self._worker.kill()

    def _patience(self) -> float:
        """Return how long to wait beyond GRACE for a run that is past stopping."""
        account = self._account()
        if account.status is not None:
            return _TELLING
        if account.committing:
            return _MOVING
        return _ENDING if account.written else 0.0

    def _account(self) -> Account:
        self._read += self._worker.notes()
        return Account.of(self._read)

    def _explained(self, code: int, noise: str) -> tuple[int, str]:
        """Return the exit status and why the run ended without a word."""
        stop = self._stop or next((s for s in STOPS if code == -s), None)
        if stop is not None:
            return 128 + stop, next(word for each, word in STOPS.items() if each == stop)
        if lacks_memory(code, noise):
            return 1, "out of memory"
        if was_killed(code):
            return 1, "killed, as the system does where memory runs out"
        crash = crash_of(code)
        how = "ended the run" if crash is None else f"crashed ({crash})"
        last = noise.strip().splitlines()[-1:]
        return 1, f"a library {how}" + (f": {last[0].strip()}" if last else "")
