"""What the command line says on stderr: progress, warnings, one line per error."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import TextIO

from geounfold.cli.journal import Journal
from geounfold.errors import OutputError


class Console:
    """Messages on stderr; progress only where that is a terminal.

    Parameters
    ----------
    quiet : bool, optional
        Neither progress nor warnings.
    stream : text stream, optional
        Instead of stderr.
    journal : Journal, optional
        Where outputs are noted; nobody reads it without.

    Attributes
    ----------
    journal : Journal
        As given.
    """

    def __init__(
        self,
        *,
        quiet: bool = False,
        stream: TextIO | None = None,
        journal: Journal | None = None,
    ) -> None:
        self.journal = journal or Journal()
        self._stream = sys.stderr if stream is None else stream
        self._quiet = quiet
        self._live = not quiet and self._stream is not None and self._stream.isatty()
        self._since = time.perf_counter()

    def stage(self, name: str) -> None:
        """Show the stage that begins, in place of the one before."""
        if self._live:
            seconds = time.perf_counter() - self._since
            self._write(f"\r\x1b[K[{seconds:5.1f} s] {_one_line(name)} ...")

    def done(self, text: str) -> None:
        """Say what a run has done, on a terminal."""
        if self._live:
            self._clear()
            self._write(f"{_one_line(text)} ({time.perf_counter() - self._since:.1f} s)\n")

    def warn(self, text: str) -> None:
        """Say what to distrust; in a pipe too, unless quiet."""
        if not self._quiet:
            self._clear()
            self._write(f"geounfold: warning: {_one_line(text)}\n")

    def error(self, text: str) -> None:
        """Say in one line why nothing came of it."""
        self._clear()
        self._write(f"geounfold: error: {_one_line(text)}\n")

    def say(self, text: str) -> None:
        """Print an answer on stdout.

        Raises
        ------
        OutputError
            It cannot be written where stdout leads; a reader that has left is BrokenPipeError.
        """
        if sys.stdout is None:
            return
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(f"cannot write to stdout: {error.strerror or error}") from error

    def _clear(self) -> None:
        if self._live:
            self._write("\r\x1b[K")

    def _write(self, text: str) -> None:
        """Write a message; one that cannot be shown (stderr closed, full) is no reason to fail."""
        if self._stream is not None:
            with suppress(OSError, ValueError):
                self._stream.write(text)
                self._stream.flush()


def _one_line(text: str) -> str:
    """Return text without line breaks and control characters."""
    return "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
