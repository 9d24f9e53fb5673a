"""Makes Linux behave like Windows or macOS in what geounfold meets of the system.

Python imports this module when it starts, in every process whose PYTHONPATH names this folder.
``GEOUNFOLD_IMITATE`` (``windows`` or ``macos``) chooses the system; without it nothing changes.
``GEOUNFOLD_FAULT`` names a script of Python that is run as well: a fault for the process to meet.

The names of the system (``sys.platform``, ``os.name``) stay: libraries choose their own code by
them. What geounfold does by these names alone is tested beside its code.
"""

from __future__ import annotations

import ctypes
import errno
import os
import runpy
import shutil
import signal
import subprocess  # noqa: F401  (takes what it needs from os before that is gone)
import sys
import tempfile  # noqa: F401
import threading  # noqa: F401
from pathlib import Path

WINDOWS_MODULES = ("resource", "fcntl", "pwd", "grp", "termios", "tty", "pty")
WINDOWS_OS = (
    *("fork", "forkpty", "sched_getaffinity", "geteuid", "mkfifo", "setsid", "killpg", "nice"),
    *("O_DIRECTORY", "waitid", "getpgid", "setpgid", "statvfs", "chown", "lchown"),
)
WINDOWS_SIGNALS = (
    *("SIGHUP", "SIGBUS", "SIGCHLD", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGSTOP", "SIGCONT"),
    *("SIGQUIT", "SIGPIPE", "pthread_sigmask", "pthread_kill", "sigtimedwait", "sigwait"),
    *("sigwaitinfo", "sigpending", "alarm", "pause"),
)
MACOS_OS = ("sched_getaffinity",)
MACOS_SIGNALS = ("sigtimedwait", "sigwaitinfo")


class SharingError(PermissionError):
    """What Windows says if a file is open elsewhere."""

    winerror = 32


def windows() -> None:
    """Take away what Windows does not have, and refuse what it refuses."""
    _write_protected_fsync()
    for name in WINDOWS_MODULES:
        sys.modules[name] = None  # type: ignore[assignment]
    _remove(os, WINDOWS_OS)
    _remove(signal, WINDOWS_SIGNALS)
    _no_folder_is_opened()
    _no_open_file_moves()
    _letter_case_is_ignored()
    _console_of_cp1252()
    ctypes.CDLL = _library(none=TypeError)  # type: ignore[misc,assignment]
    ctypes.WinDLL = _Kernel  # type: ignore[attr-defined]


def macos() -> None:
    """Take away what macOS does not have, and count memory in bytes."""
    _remove(os, MACOS_OS)
    _remove(signal, MACOS_SIGNALS)
    _letter_case_is_ignored()
    ctypes.CDLL = _library(none=None)  # type: ignore[misc,assignment]
    _bytes_of_memory()


def _remove(module: object, names: tuple[str, ...]) -> None:
    for name in names:
        if hasattr(module, name):
            delattr(module, name)


def _write_protected_fsync() -> None:
    import fcntl

    real = os.fsync

    def fsync(file: int) -> None:
        if fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "Bad file descriptor")
        real(file)

    os.fsync = fsync


def _no_folder_is_opened() -> None:
    real = os.open

    def open_(path: object, flags: int, *rest: object, **more: object) -> int:
        if not more and Path(os.fspath(path)).is_dir():  # type: ignore[call-overload]
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return real(path, flags, *rest, **more)  # type: ignore[call-overload]

    os.open = open_  # type: ignore[assignment]
    shutil._use_fd_functions = False  # type: ignore[attr-defined]


def _no_open_file_moves() -> None:
    real = {name: getattr(os, name) for name in ("replace", "rename", "unlink", "remove")}

    def wrapped(name: str) -> object:
        def step(*paths: object, **more: object) -> None:
            own = sys._getframe(1).f_globals.get("__name__") == "tempfile"  # has its way on Windows
            for path in () if own else paths:
                if _is_open(path):
                    raise SharingError(errno.EACCES, "Access is denied", path)
            if name == "rename" and os.path.lexists(paths[1]):  # type: ignore[arg-type]
                raise FileExistsError(errno.EEXIST, "File exists", paths[1])
            real[name](*paths, **more)

        return step

    for name in real:
        setattr(os, name, wrapped(name))


def _is_open(path: object) -> bool:
    """Return whether this process has a file open, or one in a folder."""
    whole = os.path.realpath(path)  # type: ignore[call-overload]
    for handle in Path("/proc/self/fd").iterdir():
        try:
            held = str(handle.readlink())
        except OSError:  # the listing's own
            continue
        if held == whole or held.startswith(f"{whole}/"):
            return True
    return False


def _letter_case_is_ignored() -> None:
    real = {name: getattr(os, name) for name in ("stat", "lstat")}

    def wrapped(name: str) -> object:
        def look(path: object, **more: object) -> os.stat_result:
            try:
                return real[name](path, **more)
            except FileNotFoundError:
                if not isinstance(path, str | os.PathLike) or more.get("dir_fd") is not None:
                    raise
                given = Path(os.fsdecode(path))
                try:
                    others = [*given.parent.iterdir()]
                except OSError:
                    others = []
                for other in others:
                    if other.name.casefold() == given.name.casefold():
                        return real[name](other, **more)
                raise

        return look

    for name in real:
        setattr(os, name, wrapped(name))


def _console_of_cp1252() -> None:
    if any("pytest" in word or "execnet" in word for word in sys.orig_argv):
        return  # the tests' own output
    for stream, errors in ((sys.stdout, "strict"), (sys.stderr, "backslashreplace")):
        if stream is not None:
            stream.reconfigure(encoding="cp1252", errors=errors)  # type: ignore[union-attr]


def _library(none: type[Exception] | None) -> type:
    real = ctypes.CDLL

    class Library(real):  # type: ignore[misc,valid-type]
        def __init__(self, name: str | None, *rest: object, **more: object) -> None:
            if name is None and none is not None:
                raise none("LoadLibrary() argument 1 must be str, not None")
            super().__init__(name, *rest, **more)
            self._own = name is not None

        def __getattr__(self, name: str) -> object:
            if name == "prctl":
                raise AttributeError("dlsym(RTLD_DEFAULT, prctl): symbol not found")
            return super().__getattr__(name)

    return Library


class _Function:
    def __init__(self, call: object) -> None:
        self._call = call

    def __call__(self, *given: object) -> object:
        return self._call(*given)  # type: ignore[operator]


class _Kernel:
    """The functions of kernel32 that geounfold calls."""

    def __init__(self, name: str, *_: object, **__: object) -> None:
        if name != "kernel32":
            raise FileNotFoundError(errno.ENOENT, f"Could not find module '{name}'")
        self.GetCurrentProcess = _Function(lambda: -1)
        self.K32GetProcessMemoryInfo = _Function(_memory)
        self.OpenProcess = _Function(lambda _access, _inherit, process: process)
        self.WaitForSingleObject = _Function(_wait)
        self.GetStdHandle = _Function(lambda number: number)

    def __getattr__(self, _: str) -> object:
        return _Function(lambda *_: 0)  # other libraries' calls: refused, as without a console


def _memory(_process: object, counters: object, size: int) -> int:
    peak = next(
        int(line.split()[1]) << 10
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        if line.startswith("VmHWM:")
    )
    target = counters._obj  # type: ignore[attr-defined]
    assert size == ctypes.sizeof(target) == 72, "as windows.h has it"
    target.PeakWorkingSetSize = peak
    return 1


def _wait(process: int, _limit: int) -> int:
    import time

    while Path(f"/proc/{process}").exists():
        time.sleep(0.05)
    return 0


def _bytes_of_memory() -> None:
    import resource

    real = resource.getrusage

    class Usage:
        def __init__(self, who: int) -> None:
            self._real = real(who)
            self.ru_maxrss = self._real.ru_maxrss << 10

        def __getattr__(self, name: str) -> object:
            return getattr(self._real, name)

    resource.getrusage = Usage  # type: ignore[assignment,misc]
    try:
        from geounfold.backends.system import memory
    except ImportError:
        return  # a process that does not have the package
    memory._UNIT = 1


if _system := os.environ.get("GEOUNFOLD_IMITATE"):
    {"windows": windows, "macos": macos}[_system]()
if _fault := os.environ.get("GEOUNFOLD_FAULT"):
    runpy.run_path(_fault)
