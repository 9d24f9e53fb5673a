"""Files: flushed to the disk, moved in place, and names that some systems do not take."""

from __future__ import annotations

import errno
import os
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path, PurePath, PureWindowsPath

_PATIENCE = 2.0
"""Seconds to try again if another program has the file open: virus scanners take about one."""

_PAUSE = 0.05  # s between two tries
_LONGEST = 248  # characters of a folder's path, CreateDirectory's limit; a file's is 260
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³]|conin\$|conout\$)", re.IGNORECASE)
_FORBIDDEN = re.compile(r'[<>:"|?*\x00-\x1f]')

WINDOWS = os.name == "nt"
"""Whether names follow the rules of Windows."""


def flush(path: Path) -> None:
    """Write a file's or folder's cached data to the disk.

    Windows flushes only files that are open for writing, and opens no folders: there a folder's
    entries are left to its journal.
    """
    if path.is_dir():
        if not hasattr(os, "O_DIRECTORY"):
            return
        handle = os.open(path, os.O_RDONLY)
    else:
        handle = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # the file system has no such call
            raise
    finally:
        os.close(handle)


def replace(source: Path, target: Path) -> None:
    """Move a file or folder in place of another, in one step.

    Windows refuses while another program has one of them open, so that a refusal is final only
    after two seconds. Other systems refuse at once.

    Raises
    ------
    OSError
        The file cannot be moved.
    """
    _again(lambda: os.replace(source, target), target)  # noqa: PTH105


def move(source: Path, target: Path) -> None:
    """Move a folder to a path that is free."""
    _again(lambda: source.rename(target), target)


def _again(step: Callable[[], object], target: Path) -> None:
    """Take a step, and again if Windows says that a file is open."""
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            step()
        except PermissionError as error:
            if not hasattr(error, "winerror"):
                raise
            if time.monotonic() > end:
                raise PermissionError(
                    error.errno,
                    "another program has it open, or it is write-protected",
                    str(target),
                ) from error
            time.sleep(_PAUSE)
        else:
            return


def keep(target: Path, copy: Path) -> None:
    """Keep a file under a second name until its replacement is in place."""
    try:
        os.link(target, copy)
    except OSError:  # a file system without hard links
        shutil.copy2(target, copy)


def move_new(part: Path, target: Path) -> None:
    """Move a file in place unless the target exists, checked and moved in one step.

    Raises
    ------
    FileExistsError
        The target exists.
    """
    try:
        os.link(part, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        _claim(part, target)


def _claim(part: Path, target: Path) -> None:
    """Make the target as an empty file, unless it exists, and then replace that."""
    os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
    try:
        replace(part, target)
    except BaseException:
        with suppress(OSError):
            target.unlink()
        raise


def same_file(a: Path, b: Path) -> bool:
    """Return whether two paths lead to one file: links, and letter cases that the disk ignores."""
    try:
        if a.resolve() == b.resolve():
            return True
        if a.exists() and b.exists():
            return a.samefile(b)
        return (
            a.name.casefold() == b.name.casefold()
            and a.parent.samefile(b.parent)
            and _ignores_case(a.parent)
        )
    except (OSError, ValueError, RuntimeError):  # a folder is missing or not a valid path
        return False


def _ignores_case(folder: Path) -> bool:
    """Return whether a folder's disk takes `A` and `a` for one name, which is tried."""
    trial = folder / f".geounfold-case-{os.getpid()}.part"
    try:
        trial.mkdir()
    except OSError:
        return False
    try:
        return os.path.lexists(trial.with_name(trial.name.upper()))
    finally:
        trial.rmdir()


def fault_of_name(path: PurePath, *, windows: bool = WINDOWS) -> str:
    """Return why the system takes no file of this name, or nothing.

    Examples
    --------
    >>> fault_of_name(PureWindowsPath("out/con.csv"), windows=True)
    "'con.csv' is the name of a device"
    >>> fault_of_name(PureWindowsPath("C:/out/b?.csv"), windows=True)
    "'?' cannot be in a name"
    >>> fault_of_name(PureWindowsPath("C:/out/b.csv"), windows=True)
    ''
    """
    if not windows:
        return ""
    for part in path.relative_to(path.anchor).parts:
        if found := _FORBIDDEN.search(part):
            return f"'{found.group()}' cannot be in a name"
        if part not in (".", "..") and part[-1:] in (".", " "):
            return f"'{part}' ends in a dot or a space"
        if _DEVICES.fullmatch(part.split(".")[0].rstrip(" ")):
            return f"'{part}' is the name of a device"
    return ""


def unlimited(path: Path) -> Path:
    r"""Return an absolute path that Windows does not cut off at 260 characters.

    Other systems, and shorter paths, keep theirs.
    """
    return Path(unlimited_name(str(path))) if WINDOWS else path


def reachable(path: Path, *, windows: bool = WINDOWS) -> Path:
    r"""Return the path of an input that Windows opens too if it is longer than 260 characters.

    Other systems, and shorter paths, keep theirs.

    Examples
    --------
    >>> reachable(Path("blocks.csv"), windows=True).name
    'blocks.csv'
    """
    if not windows:
        return path
    whole = os.path.abspath(path)  # noqa: PTH100  (the long form takes neither .. nor /)
    name = unlimited_name(whole)
    return path if name == whole else Path(name)


def unlimited_name(name: str) -> str:
    r"""Return an absolute path of Windows in the form that has no limit of length.

    Examples
    --------
    >>> unlimited_name("C:\\b\\" + 260 * "x")[:10]
    '\\\\?\\C:\\b\\x'
    >>> unlimited_name("\\\\mine\\models\\" + 260 * "x")[:21]
    '\\\\?\\UNC\\mine\\models\\x'
    >>> unlimited_name("C:\\b")
    'C:\\b'
    """
    if len(name) < _LONGEST - 40 or name.startswith("\\\\?\\"):
        return name
    if name.startswith("\\\\"):
        return "\\\\?\\UNC\\" + name[2:]
    return "\\\\?\\" + str(PureWindowsPath(name))
