"""The console: characters that it cannot show, and lines that are drawn over."""

from __future__ import annotations

import ctypes
import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

_ESCAPES = 4  # ENABLE_VIRTUAL_TERMINAL_PROCESSING of consoleapi.h
_HANDLE = {1: -11, 2: -12}  # GetStdHandle's numbers of stdout and stderr


def speak_to_any_console() -> None:
    """Write a character that the console's encoding lacks as an escape, instead of failing.

    On Windows a pipe or a file gets text in the language's old code page, cp1252 for English.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


@contextmanager
def answers_kept_clean() -> Iterator[None]:
    """Send what libraries write to stdout to stderr, so that answers on stdout stay whole."""
    kept = None
    with suppress(OSError):  # stdout or stderr is closed
        kept = os.dup(1)
        if sys.stdout is not None:
            sys.stdout.flush()
        os.dup2(2, 1)
    try:
        yield
    finally:
        if kept is not None:
            os.dup2(kept, 1)
            os.close(kept)


def reader_has_left(error: OSError) -> bool:
    """Return whether a pipe could not be written because nobody reads it any more."""
    if isinstance(error, BrokenPipeError):
        return True
    return error.errno == errno.EINVAL and hasattr(error, "winerror")  # as Windows says it


def redraws(stream: TextIO) -> bool:
    """Return whether a terminal takes escapes that clear a line; switch them on if it can."""
    terminal = os.environ.get("TERM", "").lower()
    if not terminal and hasattr(ctypes, "WinDLL"):  # Windows names none
        return _switches_on(stream)
    return terminal not in ("", "dumb", "unknown")


def _switches_on(stream: TextIO) -> bool:
    """Switch escapes on in a console of Windows 10 or later; return whether it takes them."""
    kernel: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined,unused-ignore]
    kernel.GetStdHandle.restype = ctypes.c_void_p
    kernel.GetConsoleMode.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    kernel.SetConsoleMode.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    mode = ctypes.c_uint32()
    handle = kernel.GetStdHandle(_HANDLE[2 if stream is sys.stderr else 1])
    if not kernel.GetConsoleMode(handle, ctypes.byref(mode)):
        return False
    return bool(kernel.SetConsoleMode(handle, mode.value | _ESCAPES))
