"""What the command line says: progress, warnings and errors on stderr, answers on stdout."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, TextIO, cast

from geounfold.backends.system.console import reader_has_left
from geounfold.cli.process.journal import Journal
from geounfold.cli.terminal.progress import Careful, Progress, progress_on
from geounfold.cli.terminal.time_left import Forecast
from geounfold.errors import OutputError


class Console:
    """Messages on stderr; progress only where that is a terminal.

    Parameters
    ----------
    quiet : bool, optional
        Neither progress nor warnings.
    json : bool, optional
        Answers are JSON.
    plain : bool, optional
        Progress that does not mind other lines between (``-v``).
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
        json: bool = False,
        plain: bool = False,
        stream: TextIO | None = None,
        journal: Journal | None = None,
    ) -> None:
        self.journal = journal or Journal()
        given = sys.stderr if stream is None else stream
        self._stream = None if given is None else cast(TextIO, Careful(given))
        self._quiet, self._json, self._plain = quiet, json, plain
        self._live = not quiet and self._stream is not None and self._stream.isatty()
        self._shown, self._stage = False, ""
        self._warned: set[str] = set()
        self._forecast = Forecast()

    @cached_property
    def _progress(self) -> Progress:
        return progress_on(cast(TextIO, self._stream), self._forecast, plain=self._plain)

    def stage(self, name: str, done: float | None = None) -> None:
        """Show the stage that runs, in place of the one before.

        Parameters
        ----------
        name : str
            Its name; "done" after the last.
        done : float, optional
            Share of the run that is done, 0 to 1, if it is known.
        """
        if not self._live:
            return
        self._forecast.tell(done)
        if name != self._stage or not self._shown:
            self._stage = name
            self._progress.stage(_one_line(name))
            self._shown = True

    def done(self, text: str) -> None:
        """Say what a run has done, on a terminal."""
        if self._live:
            self._clear()
            self._write(f"{_one_line(text)} ({self._forecast.elapsed:.1f} s)\n")

    def close(self, lines: Callable[[float], Sequence[str]]) -> None:
        """Print the lines that end a run, on a terminal.

        Parameters
        ----------
        lines : callable
            Makes them from the seconds since the run began.
        """
        if self._live:
            self._clear()
            for line in lines(self._forecast.elapsed):
                self._write(f"{_one_line(line, kept='  ')}\n")

    def warn(self, text: str) -> None:
        """Print a warning, in a pipe too, unless quiet; the same words once only."""
        if not self._quiet and text not in self._warned:
            self._warned.add(text)
            self._clear()
            self._write(f"geounfold: warning: {_one_line(text)}\n")

    def note(self, text: str) -> None:
        """Tell what was assumed, in a pipe too, unless quiet; the same words once only."""
        if not self._quiet and text not in self._warned:
            self._warned.add(text)
            self._clear()
            self._write(f"geounfold: note: {_one_line(text)}\n")

    def error(self, text: str) -> None:
        """Say in one line why nothing came of it."""
        self._clear()
        self._write(f"geounfold: error: {_one_line(text)}\n")

    def answer(self, facts: dict[str, Any], text: Callable[[], str] | None = None) -> None:
        """Give an answer on stdout: as one JSON object where that was asked for, else as text.

        Parameters
        ----------
        facts : dict
            What JSON tells.
        text : callable, optional
            Makes the text; without, only JSON says anything.

        Raises
        ------
        OutputError
            See `say`.
        """
        if self._json:
            from geounfold.io.json_text import json_text

            self.say(json_text(facts))
        elif text is not None:
            self.say(text())

    def say(self, text: str) -> None:
        """Print an answer on stdout.

        Raises
        ------
        OutputError
            It cannot be written where stdout leads; a reader that has left is BrokenPipeError.
        """
        self._clear()
        if sys.stdout is None:
            return
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError as error:
            if reader_has_left(error):
                raise BrokenPipeError from error
            raise OutputError(f"cannot write to stdout: {error.strerror or error}") from error

    def _clear(self) -> None:
        """Take progress away: another line comes; also what a run that was killed left."""
        if self._live:
            if self._shown:
                self._progress.clear()
            else:
                self._write("\r\x1b[K")
            self._shown = False

    def _write(self, text: str) -> None:
        """Write a message; one that cannot be shown (stderr closed, full) is no reason to fail."""
        if self._stream is not None:
            self._stream.write(text)
            self._stream.flush()


def _one_line(text: str, kept: str = "") -> str:
    """Return text without line breaks and control characters; gaps of ``kept`` stay as they are."""
    if kept and kept in text:
        head, _, rest = text.partition(kept)
        gap = len(rest) - len(rest.lstrip(" "))
        return f"{_one_line(head)}{kept}{' ' * gap}{_one_line(rest)}"
    return "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
