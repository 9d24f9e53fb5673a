"""A run in a new interpreter (macOS, Windows).

The two processes share a temporary folder: the run appends its journal to one file and what
libraries write to stderr to another, so that both outlive a crash. The run's stdin is a pipe. Its
first line says what to run, each further line is a signal to stop by, and its end means that the
process that watches is gone. Signals themselves do not do: Windows knows only Ctrl-C, and kills by
all others.

The interpreter is started by ``subprocess``, not by ``multiprocessing``: that would run the
caller's own script again, cannot keep the new process out of the console's Ctrl-C, and starts a
third process on macOS. Measured on Linux, it takes 0.04 s of processor time to start, not 0.01.
"""

from __future__ import annotations

import _thread
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

from geounfold.backends.system.signals import heeded, stoppable
from geounfold.backends.system.worker import Run, content_of, keep_aside, limit_threads

_LOOK = 0.1
"""Seconds between two looks for a signal: Windows does not interrupt a wait for a process."""

_START = "import sys; sys.path[:] = {path!r}; from {module} import serve; serve()"
_JOURNAL, _STDERR = "journal", "stderr"

Parts = Callable[[bytes], tuple[list[Path], bool]]
"""Takes a journal, and returns what must not stay on the disk and whether outputs are being moved
in place, or have been."""


class Spawned:
    """A run in a new interpreter.

    Parameters
    ----------
    run, parts : str
        ``module:function`` of a Run and of a Parts.
    words : list of str
        The command's words.
    verbose : bool
        Show what libraries write to stderr; otherwise it is looked at after a crash only.
    """

    def __init__(self, run: str, parts: str, words: list[str], *, verbose: bool) -> None:
        self._came: list[signal.Signals] = []
        self._read = 0
        for each in heeded():
            signal.signal(each, self._hear)
        self._folder = Path(tempfile.mkdtemp(prefix="geounfold-"))
        code = _START.format(path=[p or str(Path.cwd()) for p in sys.path], module=__name__)
        options = [f"-W{option}" for option in sys.warnoptions]
        options += ["-X", "utf8"] if sys.flags.utf8_mode else []
        with _held_back():
            self._process = subprocess.Popen(
                [sys.executable, *options, "-P", "-c", code],
                stdin=subprocess.PIPE,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )
        spec = {"run": run, "parts": parts, "words": words, "argv": sys.argv}
        self._tell(json.dumps({**spec, "folder": str(self._folder), "verbose": verbose}))

    def wait(self, seconds: float | None) -> tuple[signal.Signals | None, int | None]:
        """See Worker."""
        end = None if seconds is None else time.monotonic() + seconds
        while True:
            code = self._ended(_LOOK if end is None else min(_LOOK, max(0, end - time.monotonic())))
            if code is not None or self._came or (end is not None and time.monotonic() >= end):
                return (self._came.pop(0) if self._came else None), code

    def stop(self, number: signal.Signals) -> None:
        """See Worker."""
        self._tell(str(int(number)))

    def kill(self) -> int:
        """See Worker."""
        self._process.kill()
        return self._process.wait()

    def notes(self) -> bytes:
        """See Worker."""
        new = content_of(self._folder / _JOURNAL, self._read)
        self._read += len(new)
        return new

    def noise(self) -> bytes:
        """See Worker."""
        return content_of(self._folder / _STDERR)

    def close(self) -> None:
        """See Worker."""
        with suppress(OSError):
            self._pipe.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def _pipe(self) -> Any:
        return self._process.stdin

    def _tell(self, line: str) -> None:
        with suppress(OSError):  # the run has ended, as `wait` will tell
            self._pipe.write(line.encode("ascii") + b"\n")
            self._pipe.flush()

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self._came.append(signal.Signals(number))

    def _ended(self, seconds: float) -> int | None:
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None


class _held_back:  # noqa: N801
    """Signals that come to the new process before it can take them wait; it lets them in."""

    def __enter__(self) -> None:
        self._mask = (
            signal.pthread_sigmask(signal.SIG_BLOCK, heeded())
            if hasattr(signal, "pthread_sigmask")  # Windows: CREATE_NEW_PROCESS_GROUP does it
            else None
        )

    def __exit__(self, *_: object) -> None:
        if self._mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)


def serve() -> None:
    """Run what the first line of stdin says, and leave with its status."""
    pipe = _Lines(0)
    spec = json.loads(pipe.next() or "null")
    if spec is None:  # the process that watches has ended already
        sys.exit(1)
    sys.argv = spec["argv"]
    limit_threads()
    folder = Path(spec["folder"])
    new = os.O_CREAT | os.O_APPEND | os.O_WRONLY | getattr(os, "O_BINARY", 0)
    journal = os.open(folder / _JOURNAL, new, 0o600)
    if not spec["verbose"]:
        aside = os.open(folder / _STDERR, new, 0o600)
        keep_aside(aside)
        os.close(aside)
    run: Run = _named(spec["run"])
    with stoppable(restore=False):
        listener = threading.Thread(
            target=_listen, args=(pipe, folder, _named(spec["parts"])), daemon=True
        )
        listener.start()
        status = run(spec["words"], journal, _let_in)
    sys.exit(status)


def _named(name: str) -> Any:
    module, _, function = name.partition(":")
    return getattr(import_module(module), function)


def _let_in() -> None:
    """Let in the signals that were held back."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, heeded())


class _Lines:
    """Lines of a pipe, read without a lock that a thread would still hold at the end."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._read = b""

    def next(self) -> str:
        """Return the next line, or nothing at the end."""
        while b"\n" not in self._read:
            more = os.read(self._handle, 1 << 16)
            if not more:
                return ""
            self._read += more
        line, _, self._read = self._read.partition(b"\n")
        return line.decode("ascii")


def _listen(pipe: _Lines, folder: Path, parts: Parts) -> None:
    """Stop the run when a line says so; clear up and end it when the watching process ends."""
    while line := pipe.next():
        number = int(line)
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(threading.main_thread().ident or 0, number)
        else:
            _thread.interrupt_main(signal.Signals(number))
    unfinished, moving = parts(content_of(folder / _JOURNAL))
    if moving:
        return
    for part in (*unfinished, folder):
        shutil.rmtree(part, ignore_errors=True)
    os._exit(1)
