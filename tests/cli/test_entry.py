"""The command line as a whole: help, version, and the status of every way to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import geounfold
from geounfold import _version
from geounfold.cli import main
from geounfold.errors import HullError, InputError, MissingDependencyError
from tests.cli.fakes import replace_module

COMMANDS = ["unfold", "map", "estimate", "compare", "crosscheck", "quality", "simulate"]


COMMANDS += ["view", "grid", "transfer", "init", "doctor", "completion"]


def _process(*argv: str, **settings: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "geounfold", *argv],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        **settings,
    )


@pytest.mark.parametrize("argv", [["--help"], *([c, "--help"] for c in COMMANDS)], ids=" ".join)
def test_help(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == 0
    out, err = capsys.readouterr()
    assert out.startswith("usage: geounfold")
    assert "exit status" in out
    assert err == ""


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"geounfold {_version.__version__}\n"


def test_help_loads_nothing_heavy() -> None:
    # The package's own __init__ is left out: what counts here is what the command line loads.
    code = (
        "import sys, types\n"
        "bare = types.ModuleType('geounfold')\n"
        "bare.__path__ = [sys.argv[1]]\n"
        "sys.modules['geounfold'] = bare\n"
        "from geounfold.cli import main\n"
        "assert main(['unfold', '--help']) == 0\n"
        "heavy = {'igl', 'matplotlib', 'numpy', 'pandas', 'pymeshlab', 'pyvista', 'scipy'}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))\n"
    )
    folder = str(Path(_version.__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", code, folder], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (InputError("all on\na line"), 2, "geounfold: error: all on a line\n"),
        (HullError("no hull"), 1, "geounfold: error: no hull\n"),
        (KeyboardInterrupt(), 130, "geounfold: error: interrupted; nothing was written\n"),
        (MemoryError(), 1, "geounfold: error: out of memory; nothing was written\n"),
        (  # an input that is removed between two looks at it
            FileNotFoundError(2, "No such file or directory", "p.csv"),
            2,
            "geounfold: error: p.csv: cannot be read: No such file or directory; "
            "nothing was written\n",
        ),
    ],
)
def test_errors_are_one_line(
    error: BaseException,
    status: int,
    words: str,
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(geounfold.unfolding.run, "unfold", _raise(error))
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == status
    assert capsys.readouterr() == ("", words)
    assert list(tmp_path.iterdir()) == [points]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_failing_last_output_leaves_none(
    error: BaseException,
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    replace_module(monkeypatch, "report.plots.rendering", check_rendering=lambda: None)
    report = {"write_report": _raise(error), "carried_faults": lambda _: None}
    replace_module(monkeypatch, "report", **report)
    assert main(["unfold", "p.csv", "-o", "out.csv", "--report", "r.html"]) in (2, 130)
    assert capsys.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [points]


def test_pictures_are_tried_before_computing(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    missing = MissingDependencyError("libGL is missing: apt install libgl1")
    replace_module(monkeypatch, "report.plots.rendering", check_rendering=_raise(missing))
    assert main(["unfold", "p.csv", "-o", "out.csv", "--report", "r.html"]) == 1
    assert capsys.readouterr().err == f"geounfold: error: {missing}\n"
    assert calls == []
    assert list(tmp_path.iterdir()) == [points]


@pytest.mark.parametrize("error", [ZeroDivisionError("oops"), OSError(2, "No such", "other")])
def test_anything_else_is_a_traceback(
    error: Exception,
    points: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(geounfold.unfolding.run, "unfold", _raise(error))
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == 1
    assert "Traceback" in capsys.readouterr().err


def _raise(error: BaseException) -> Callable[..., None]:
    def fail(*_: object, **__: object) -> None:
        raise error

    return fail


def test_process_has_the_status(tmp_path: Path) -> None:
    done = _process("unfold", "nowhere.csv", "-o", "out.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "geounfold: error: nowhere.csv: no such file\n"
    assert done.stdout == ""


def test_reader_that_leaves_early() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "geounfold", "simulate", "--list"],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.skipif(os.name == "nt", reason="tests/hostile/test_guard.py does it there")
@pytest.mark.parametrize(
    ("sent", "status", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_signals_clear_what_was_begun(
    sent: signal.Signals, status: int, word: str, tmp_path: Path
) -> None:
    script = (
        "import pathlib, sys, time\n"
        "import geounfold.cli.entry as entry\n"
        "from geounfold.io import Outputs\n"
        "def slow(args, console):\n"
        "    with Outputs.planned({'o': ('out.csv', ())}).writing() as parts:\n"
        "        parts['o'].write_text('half')\n"
        "        print('begun', flush=True)\n"
        "        time.sleep(30)\n"
        "entry._command = lambda name: slow\n"
        "sys.exit(entry.main(['simulate', '--list']))\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell's background ignores interruptions, which a run would heed.
        preexec_fn=lambda: signal.signal(sent, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(0.05)
    process.send_signal(sent)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (
        status,
        f"geounfold: error: {word}; nothing was written\n",
    )
    assert list(tmp_path.iterdir()) == []
