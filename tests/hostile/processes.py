"""Runs in a process of their own, and what they leave on disk."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.hostile.environment import LONG, with_fault

UNFOLD = ("unfold", "p.csv", "-o", "out.csv", "--summary", "s.json", "--map", "m.npz")


def heed_stops() -> None:
    """Undo what the tests' own caller may have set, and a run would heed.

    ``nohup`` ignores hang-ups, a shell interruptions of what it runs in the background, and a
    library that ran in the tests' own process may have left terminations ignored.
    """
    for stop in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        signal.signal(stop, signal.SIG_DFL)


class Run:
    """A command in a process whose stderr is a terminal."""

    def __init__(self, *argv: str, cwd: Path, fault: Path | None = None, **settings: object):
        self._master, slave = pty.openpty()
        settings.setdefault("preexec_fn", heed_stops)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "geounfold", *argv],
            cwd=cwd,
            env=with_fault(fault),
            stdout=subprocess.PIPE,
            stderr=slave,
            **settings,  # type: ignore[call-overload]
        )
        os.close(slave)
        self._text = ""

    def until(self, stage: str) -> Run:
        """Wait for a stage's name on the terminal."""
        end = time.monotonic() + LONG
        while f"] {stage}" not in self._text:
            assert time.monotonic() < end, f"no stage {stage}: {self._text!r}"
            assert self._more(), f"over before stage {stage}: {self._text!r}"
        return self

    def send(self, number: int) -> Run:
        self.process.send_signal(number)
        return self

    def workers(self) -> list[int]:
        """Return the processes that this one has started."""
        psutil = pytest.importorskip("psutil", reason="it finds the processes")
        return [child.pid for child in psutil.Process(self.process.pid).children()]

    def end(self) -> tuple[int, str]:
        """Return the exit status and what stays on the terminal."""
        while self._more():
            pass
        os.close(self._master)
        self.process.communicate(timeout=LONG)
        lines = self._text.replace("\r\n", "\n").split("\n")
        # What a carriage return goes back over, and an escape clears, does not stay.
        left = [line.rpartition("\r\x1b[K")[2] for line in lines]
        return self.process.returncode, "\n".join(left)

    def _more(self) -> bool:
        ready, _, _ = select.select([self._master], [], [], LONG)
        assert ready, f"silent for {LONG} s: {self._text!r}"
        try:
            read = os.read(self._master, 1 << 16)
        except OSError:  # a terminal that all others have left
            return False
        self._text += read.decode()
        return bool(read)
