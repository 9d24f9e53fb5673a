"""A process that ends when the process that started it does."""

from __future__ import annotations

import ctypes
import os
import signal
import threading
import time
from typing import Any

_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of linux/prctl.h
_SYNCHRONIZE = 0x00100000  # access right of winnt.h
_FOR_EVER = 0xFFFFFFFF  # INFINITE of winbase.h
_PAUSE = 0.5  # s between two looks at the parent's number (macOS)


def end_with(parent: int) -> None:
    """Have the system, or a thread if the system cannot, end this process when its parent ends.

    Parameters
    ----------
    parent : int
        The parent's number. On Windows the process that is started may be a launcher, so that
        the parent is not the one that the system names.
    """
    try:
        ask = ctypes.CDLL(None).prctl
    except (AttributeError, TypeError, OSError):  # macOS has no prctl, Windows no CDLL(None)
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
        return
    ask(_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _watch(parent: int) -> None:
    """Wait for the end of a process, then end this one."""
    if hasattr(ctypes, "WinDLL"):
        _wait_for(parent)
    else:
        while os.getppid() == parent:
            time.sleep(_PAUSE)
    os._exit(1)


def _wait_for(process: int) -> None:
    """Wait for the end of a process (Windows)."""
    kernel: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined,unused-ignore]
    kernel.OpenProcess.restype = ctypes.c_void_p
    kernel.WaitForSingleObject.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    handle = kernel.OpenProcess(_SYNCHRONIZE, False, process)
    if handle:
        kernel.WaitForSingleObject(handle, _FOR_EVER)
