"""Signals that ask a run to stop: the first unwinds it, later ones do not disturb that."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOPS = {
    signal.Signals[name]: word
    for name, word in (
        ("SIGINT", "interrupted"),
        ("SIGTERM", "terminated"),
        ("SIGHUP", "hung up"),  # not on Windows
        ("SIGBREAK", "interrupted"),  # Windows alone: Ctrl-Break, or the console is closed
    )
    if hasattr(signal, name)
}
"""What each signal does to a run, of those that the system has."""


class StoppedError(KeyboardInterrupt):
    """A signal asked the run to stop.

    Attributes
    ----------
    number : int
        The signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def stop_of(error: KeyboardInterrupt) -> signal.Signals:
    """Return the signal behind an interrupt."""
    return signal.Signals(getattr(error, "number", signal.SIGINT))


def heeded() -> list[signal.Signals]:
    """Return the signals that whoever started the process wants heeded (not nohup's)."""
    return [s for s in STOPS if signal.getsignal(s) not in (signal.SIG_IGN, None)]


@contextmanager
def stoppable(*, restore: bool = True) -> Iterator[None]:
    """Let the first of STOPS unwind the stack, so that what was begun is cleared away.

    Parameters
    ----------
    restore : bool, optional
        Bring the earlier handlers back at the end; without, the signals stay ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    hook = sys.unraisablehook
    chosen = heeded()

    def stop(number: int, _frame: FrameType | None) -> None:
        for each in chosen:
            signal.signal(each, signal.SIG_IGN)
        sys.unraisablehook = lambda _: None  # objects half made may complain as they go
        raise StoppedError(number)

    before = {each: signal.getsignal(each) for each in chosen}
    try:
        for each in chosen:
            signal.signal(each, stop)
        yield
    finally:
        for each in chosen:
            signal.signal(each, before[each] if restore else signal.SIG_IGN)
        sys.unraisablehook = hook


def ignore_stops() -> None:
    """Ignore the signals from here on; one that has come already still stops."""
    if threading.current_thread() is threading.main_thread():
        for each in heeded():
            signal.signal(each, signal.SIG_IGN)


@contextmanager
def unstoppable() -> Iterator[None]:
    """Ignore the signals in what must not be left half done, and after it where it went well."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {each: signal.getsignal(each) for each in heeded()}
    try:
        ignore_stops()
        yield
    except BaseException:
        for each, handler in before.items():
            signal.signal(each, handler)
        raise
