"""What differs between systems is named in one folder only, geounfold/backends/system."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.places import ROOT

PACKAGE = ROOT / "geounfold"
ROOM = PACKAGE / "backends" / "system"

MODULES = {
    *("resource", "fcntl", "pwd", "grp", "pty", "tty", "termios", "posix", "select", "selectors"),
    *("nt", "msvcrt", "winreg", "_winapi", "winsound", "_thread"),
    *("signal", "platform", "multiprocessing"),
}
"""Modules that not every system has, or whose functions differ between them."""

NAMES = {
    "os": {
        *("name", "uname", "fork", "forkpty", "kill", "killpg", "getppid", "setsid", "nice"),
        *("wait", "waitpid", "waitstatus_to_exitcode", "sched_getaffinity"),
        *("getuid", "geteuid", "umask", "mkfifo", "set_blocking", "pipe", "fsync", "fdatasync"),
        *("link", "symlink", "replace", "rename", "renames", "sep", "altsep", "startfile"),
        *("O_DIRECTORY", "O_CREAT", "O_EXCL", "O_NONBLOCK", "O_BINARY", "system", "popen"),
    },
    "sys": {"platform", "getwindowsversion", "getfilesystemencoding"},
    "ctypes": {"cdll", "windll", "WinDLL", "oledll", "pythonapi"},
    "time": {"tzset"},
}
"""Names of other modules that not every system has, or that behave differently."""

METHODS = {"hardlink_to", "symlink_to", "is_mount"}
"""Methods of paths of which the same holds."""

WORDS = {"/dev/", "/proc/", "/tmp/", "\\\\?\\"}
"""Beginnings of paths that only one system has."""

LIBRARY = PACKAGE / "backends" / "blas.py"  # opens OpenBLAS, by the path of a loaded module


def breaches(tree: ast.AST) -> list[tuple[int, str]]:
    """Return the lines of a module that name a system, and what they name."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, a.name) for a in node.names if _root(a.name) in MODULES]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            inside = {f"{node.module}.{a.name}" for a in node.names if _is_named(node.module, a)}
            if _root(node.module) in MODULES:
                inside.add(node.module)
            found += [(node.lineno, name) for name in sorted(inside)]
        elif isinstance(node, ast.Attribute):
            base = node.value.id if isinstance(node.value, ast.Name) else ""
            if node.attr in NAMES.get(base, ()) or node.attr in METHODS:
                found.append((node.lineno, f"{base}.{node.attr}"))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found += [(node.lineno, word) for word in WORDS if node.value.startswith(word)]
    return found


def _root(name: str) -> str:
    return name.partition(".")[0]


def _is_named(module: str, alias: ast.alias) -> bool:
    return alias.name in NAMES.get(module, ())


def _without_encoding(tree: ast.AST) -> list[int]:
    """Return the lines that read or write text in whatever encoding the system prefers."""
    lines = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = (
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        )
        if name not in ("open", "fdopen", "read_text", "write_text"):
            continue
        texts = [a.value for a in node.args if isinstance(a, ast.Constant)]
        binary = any(isinstance(t, str) and "b" in t and len(t) <= 3 for t in texts)
        given = any(k.arg == "encoding" for k in node.keywords)
        low = isinstance(node.func, ast.Attribute) and getattr(node.func.value, "id", "") == "os"
        positional = name == "fdopen" and len(node.args) > 3
        if not (binary or given or positional or (low and name == "open")):
            lines.append(node.lineno)
    return lines


def _modules() -> list[Path]:
    return sorted(p for p in PACKAGE.rglob("*.py") if ROOM not in p.parents)


def test_only_one_room_names_a_system() -> None:
    found = {
        f"{path.relative_to(ROOT)}:{line}": name
        for path in _modules()
        for line, name in breaches(ast.parse(path.read_text(encoding="utf-8")))
    }
    assert found == {}, "these belong in geounfold/backends/system"


def test_ctypes_opens_no_library_elsewhere() -> None:
    users = {path for path in _modules() if "import ctypes" in path.read_text(encoding="utf-8")}
    assert users == {LIBRARY}


def test_text_files_have_an_encoding() -> None:
    # Without one, Windows reads and writes cp1252.
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line in _without_encoding(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == []


def test_text_is_written_with_line_feeds() -> None:
    # Without newline, Windows writes a carriage return before each.
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                modes = [a.value for a in node.args if isinstance(a, ast.Constant)]
                writes = node.func.attr == "write_text" or (
                    node.func.attr == "open" and {*modes} & {"w", "x", "a", "wt"}
                )
                if writes and "newline" not in {k.arg for k in node.keywords}:
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert found == []


@pytest.mark.parametrize(
    ("code", "named"),
    [
        ("import resource", "resource"),
        ("import multiprocessing.pool", "multiprocessing.pool"),
        ("from signal import SIGHUP", "signal"),
        ("from os import fork", "os.fork"),
        ("import os\nif os.name == 'nt': pass", "os.name"),
        ("import sys\nx = sys.platform", "sys.platform"),
        ("path.hardlink_to(other)", "path.hardlink_to"),
        ("open('/dev/null')", "/dev/"),
    ],
)
def test_breaches_are_found(code: str, named: str) -> None:
    assert [name for _, name in breaches(ast.parse(code))] == [named]


@pytest.mark.parametrize(
    "code", ["open(p)", "p.read_text()", "p.open('w')", "p.write_text('a')", "os.fdopen(1, 'w')"]
)
def test_text_without_an_encoding_is_found(code: str) -> None:
    assert _without_encoding(ast.parse(code)) == [1]
    given = code.replace(")", ", encoding='utf-8')").replace("(, ", "(")
    assert _without_encoding(ast.parse(given)) == []
