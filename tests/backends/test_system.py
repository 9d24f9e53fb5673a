"""What differs between systems: each side of a difference, wherever the tests run."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from pathlib import Path, PurePosixPath, PureWindowsPath

import pandas as pd
import pytest

import geounfold as gu
from geounfold.backends.system import console, files, memory, processors, worker
from geounfold.errors import InputError, OutputError
from geounfold.geometry.mesh import TriMesh
from geounfold.io import Outputs, read_points, read_surface, write_surface
from geounfold.io.paths import ending
from geounfold.io.solids import is_wireframe
from geounfold.io.tables import large
from geounfold.mapping import domain_file
from tests.body.fill.solids import box
from tests.hostile.environment import LONG, with_fault
from tests.shapes import grid_cells


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("out.csv", ""),
        ("..\\out.csv", ""),
        ("C:\\mine\\out.csv", ""),
        ("C:out.csv", ""),
        ("\\\\server\\share\\out.csv", ""),
        ("console.csv", ""),
        ("con.csv", "'con.csv' is the name of a device"),
        ("NUL", "'NUL' is the name of a device"),
        ("C:\\mine\\Lpt1.tar.gz", "'Lpt1.tar.gz' is the name of a device"),
        ("aux \\out.csv", "'aux ' ends in a dot or a space"),
        ("out.", "'out.' ends in a dot or a space"),
        ("a?b.csv", "'?' cannot be in a name"),
        ("out.csv:stream", "':' cannot be in a name"),
    ],
)
def test_names_that_windows_does_not_take(name: str, fault: str) -> None:
    assert files.fault_of_name(PureWindowsPath(name), windows=True) == fault
    assert files.fault_of_name(PurePosixPath(name), windows=False) == ""


def test_an_output_of_such_a_name_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = "'con.csv' is the name of a device"
    monkeypatch.setattr(files, "fault_of_name", lambda _: fault)
    with pytest.raises(OutputError, match=r"con\.csv.* is the name of a device on this system"):
        Outputs.planned({"--output": (tmp_path / "con.csv", ())})


@pytest.mark.parametrize(
    ("name", "whole"),
    [
        ("C:\\a.csv", "C:\\a.csv"),
        ("C:\\" + "d" * 300 + "\\a.csv", "\\\\?\\C:\\" + "d" * 300 + "\\a.csv"),
        ("\\\\s\\m\\" + "d" * 300, "\\\\?\\UNC\\s\\m\\" + "d" * 300),
        ("\\\\?\\C:\\" + "d" * 300, "\\\\?\\C:\\" + "d" * 300),
    ],
)
def test_long_paths(name: str, whole: str) -> None:
    assert files.unlimited_name(name) == whole


@pytest.mark.parametrize(
    ("name", "kind"),
    [("C:\\mine\\Blocks.v2.CSV", ".csv"), ("\\\\s\\m\\b.csv.GZ", ".csv.gz"), ("D:b.dxf", ".dxf")],
)
def test_endings_of_windows_paths(name: str, kind: str) -> None:
    assert ending(PureWindowsPath(name)) == kind  # type: ignore[arg-type]


@pytest.mark.skipif(not hasattr(os, "O_DIRECTORY"), reason="folders cannot be opened here")
def test_folders_and_files_that_are_read_only_to_others_are_flushed(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("a", encoding="utf-8")
    files.flush(tmp_path / "a")
    files.flush(tmp_path)
    with pytest.raises(FileNotFoundError):
        files.flush(tmp_path / "b")


def test_a_disk_that_cannot_flush_fails_only_if_it_should(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").touch()

    def fsync(_: int) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(files.os, "fsync", fsync)
    code = errno.EINVAL  # the file system has no such call
    files.flush(tmp_path / "a")
    code = errno.EIO
    with pytest.raises(OSError, match=os.strerror(errno.EIO)):
        files.flush(tmp_path / "a")


def test_a_refusal_without_a_lock_is_final_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = []

    def refuse(*_: object) -> None:
        tries.append(1)
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.os, "replace", refuse)
    with pytest.raises(PermissionError, match="Permission denied"):
        files.replace(tmp_path / "a", tmp_path / "b")
    assert len(tries) == 1


def test_memory_is_in_mebibytes() -> None:
    # A list of 16 Mi pointers takes 128 MiB; the interpreter itself at least 5.
    before = memory.peak_memory_mb()
    held = [None] * (1 << 24)
    after = memory.peak_memory_mb()
    assert len(held) == 1 << 24
    assert 5 < before <= after < 64 * 1024
    assert after >= 128


def test_memory_by_the_units_of_macos(monkeypatch: pytest.MonkeyPatch) -> None:
    resource = pytest.importorskip("resource", reason="Windows counts memory otherwise")
    usage = type("Usage", (), {"ru_maxrss": 3 << 20})
    monkeypatch.setattr(resource, "getrusage", lambda _: usage)
    monkeypatch.setattr(memory, "_UNIT", 1)
    assert memory.peak_memory_mb() == 3.0
    monkeypatch.setattr(memory, "_UNIT", 1024)
    assert memory.peak_memory_mb() == 3072.0


def test_processors() -> None:
    assert 1 <= processors.cores() <= (os.cpu_count() or 1)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0, None),
        (3, None),
        (0xC0000005, "access violation"),
        (0xC0000005 - (1 << 32), "access violation"),
        (0xC00000FD, "stack overflow"),
        (0xC0000999, "0xc0000999"),
    ],
)
def test_exit_codes_of_windows(code: int, name: str | None) -> None:
    assert worker.crash_of(code) == name


def test_want_of_memory() -> None:
    assert worker.lacks_memory(1, "std::bad_alloc")
    assert worker.lacks_memory(0xC0000017, "")
    assert not worker.lacks_memory(1, "a singular matrix")


@pytest.mark.parametrize(
    ("terminal", "can"), [("xterm-256color", True), ("dumb", False), ("unknown", False)]
)
def test_terminals_that_redraw(terminal: str, can: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", terminal)
    assert console.redraws(sys.stderr) == can


def test_a_reader_that_has_left() -> None:
    windows = type("WindowsError", (OSError,), {"winerror": None})
    assert console.reader_has_left(BrokenPipeError(errno.EPIPE, "Broken pipe"))
    assert console.reader_has_left(windows(errno.EINVAL, "Invalid argument"))
    assert not console.reader_has_left(OSError(errno.EINVAL, "Invalid argument"))
    assert not console.reader_has_left(OSError(errno.ENOSPC, "No space left on device"))


def test_streams_of_an_old_code_page(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding="cp1252", write_through=True)
    monkeypatch.setattr(sys, "stdout", stream)
    with pytest.raises(UnicodeEncodeError):
        stream.write("\u03b5")
    console.speak_to_any_console()
    stream.write("\u03b5 20 \u00b0")
    assert raw.getvalue() == b"\\u03b5 20 \xb0"


# Each thing that an imitation takes away, and how a process finds it missing.
IMITATED = {
    "windows": [
        ("import resource", "ModuleNotFoundError"),
        ("import fcntl", "ModuleNotFoundError"),
        ("import pwd", "ModuleNotFoundError"),
        ("import os; os.fork()", "AttributeError"),
        ("import os; os.sched_getaffinity(0)", "AttributeError"),
        ("import signal; signal.SIGHUP", "AttributeError"),
        ("import signal; signal.SIGBUS", "AttributeError"),
        ("import signal; signal.pthread_sigmask", "AttributeError"),
        ("import signal; signal.sigtimedwait", "AttributeError"),
        ("import ctypes; ctypes.CDLL(None)", "TypeError"),
        ("import os; os.fsync(os.open('a', os.O_RDONLY))", "OSError"),
        ("import os; os.open('.', os.O_RDONLY)", "PermissionError"),
        ("import os; f = open('a'); os.replace('b', 'a')", "SharingError"),
        ("import os; os.rename('b', 'a')", "FileExistsError"),
        ("print('\\u03b5')", "UnicodeEncodeError"),
    ],
    "macos": [
        ("import os; os.sched_getaffinity(0)", "AttributeError"),
        ("import signal; signal.sigtimedwait", "AttributeError"),
        ("import ctypes; ctypes.CDLL(None).prctl", "AttributeError"),
    ],
}


@pytest.mark.skipif(sys.platform != "linux", reason="other systems are not imitated")
@pytest.mark.parametrize(
    ("system", "code", "error"),
    [(system, *case) for system, cases in IMITATED.items() for case in cases],
)
def test_the_imitation_takes_away_what_it_says(
    system: str, code: str, error: str, tmp_path: Path
) -> None:
    for name in "ab":
        (tmp_path / name).touch()

    def end(imitated: str) -> str:
        environment = with_fault(GEOUNFOLD_IMITATE=imitated, PYTHONIOENCODING="utf-8")
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=LONG,
        )
        return done.stderr.strip().rpartition("\n")[2]

    assert error in end(system)
    assert end("") == ""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems are not imitated")
@pytest.mark.parametrize("system", IMITATED)
def test_letter_case_is_ignored_as_there(system: str, tmp_path: Path) -> None:
    code = (
        "from pathlib import Path; from geounfold.io import Outputs\n"
        "Outputs.planned({'--output': (Path('A.csv'), ()), '--map': (Path('a.csv'), ())})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=with_fault(GEOUNFOLD_IMITATE=system),
        capture_output=True,
        text=True,
        check=False,
        timeout=LONG,
    )
    assert "--output and --map name the same file" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_long_paths_of_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Readers open the path that `reachable` returns: here in another folder, on Windows a long one.
    short = Path("blocks.csv")
    assert files.reachable(short, windows=False) == short
    assert files.reachable(short, windows=True) == short
    long = files.reachable(Path("a" * 300 + ".csv"), windows=True)
    assert str(long).startswith("\\\\?\\")
    assert str(long).endswith("aaa.csv")

    def gone(path: Path) -> Path:
        return tmp_path / path.name

    pd.DataFrame(grid_cells(5, 4, 3), columns=list("xyz")).to_csv(tmp_path / "b.csv", index=False)
    V, F = box((0, 0, 0), (4.0, 3.0, 2.0), cell=1.0)
    write_surface(tmp_path / "s.ts", TriMesh(V, F))
    monkeypatch.setattr(files, "reachable", gone)
    for module in (large, domain_file):
        monkeypatch.setattr(module, "reachable", gone)
    there = tmp_path / "elsewhere"  # is no folder: only the other path can be opened
    assert len(read_points(there / "b.csv")) == 60
    assert len(read_surface(there / "s.ts").F) == len(F)
    assert is_wireframe(there / "s.ts")
    with pytest.raises(InputError, match="not a geounfold map"):
        gu.load(there / "b.csv")
