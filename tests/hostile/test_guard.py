"""Runs that end badly, on every system: a status, one line, a clean disk.

tests/hostile/test_signals.py has more of these, for systems with terminals and signals.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from geounfold.backends.system import files
from geounfold.backends.system.forked import can_fork
from geounfold.errors import OutputError
from geounfold.io import Outputs
from tests.hostile.environment import LONG, state_of, with_fault

# The fault: a command that begins an output, says so by a file, and then does what END says.
FAULT = """
import ctypes, itertools, os, time
from pathlib import Path
import geounfold.cli.entry as entry
def endless(args, console):
    from geounfold.io import Outputs
    outputs = Outputs.planned({'o': ('new.csv', ())}, watcher=console.journal)
    with outputs.writing() as parts:
        parts['o'].write_text('half', encoding='utf-8')
        Path(SIGN).write_text(str(os.getpid()), encoding='utf-8')
        END
entry._command = lambda name: endless
"""

# Windows alone: Ctrl-C can be sent to all processes of a console only, Ctrl-Break to a group.
BREAK = getattr(signal, "CTRL_BREAK_EVENT", None)
GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


class Begun:
    """A command that has begun an output and then meets a fault."""

    def __init__(self, end: str, folder: Path, apart: Path) -> None:
        self._sign = apart / "begun"
        fault = apart / "fault.py"
        text = FAULT.replace("END", end).replace("SIGN", repr(str(self._sign)))
        fault.write_text(text, encoding="utf-8")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "geounfold", "simulate", "--list"],
            cwd=folder,
            env=with_fault(fault),
            stderr=subprocess.PIPE,
            creationflags=GROUP,
        )
        stop = time.monotonic() + LONG
        while not self._sign.exists() or not self._sign.read_text(encoding="utf-8"):
            assert time.monotonic() < stop, "it does not begin"
            time.sleep(0.01)
        self.worker = int(self._sign.read_text(encoding="utf-8"))

    def end(self) -> tuple[int, str]:
        """Return the exit status and what was written to stderr."""
        _, text = self.process.communicate(timeout=LONG)
        return self.process.returncode, text.decode("utf-8").replace("\r\n", "\n")


@pytest.fixture
def begun(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Begun]:
    return lambda end: Begun(end, tmp_path, tmp_path_factory.mktemp("fault"))


@pytest.mark.parametrize("end", ["sum(itertools.repeat(1))", "time.sleep(600)"])
def test_interrupted(end: str, begun: Callable[[str], Begun], tmp_path: Path) -> None:
    # sum() keeps the interpreter to itself and does not look at signals.
    run = begun(end)
    run.process.send_signal(signal.SIGINT if BREAK is None else BREAK)
    status = 130 if BREAK is None else 128 + signal.SIGBREAK
    assert run.end() == (status, "geounfold: error: interrupted; nothing was written\n")
    assert state_of(tmp_path) == {}


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("ctypes.string_at(1)", "a library crashed ("),
        ("os.write(2, b'so sad\\n'), os._exit(3)", "a library ended the run: so sad; nothing"),
        ("os.write(2, b'std::bad_alloc\\n'), os.abort()", "out of memory; nothing was written"),
        ("raise MemoryError", "out of memory; nothing was written"),
        ("bytearray(1 << 62)", "out of memory; nothing was written"),
    ],
)
def test_a_library_that_ends_the_process(
    end: str, words: str, begun: Callable[[str], Begun], tmp_path: Path
) -> None:
    status, line = begun(end).end()
    assert status == 1
    assert line.startswith(f"geounfold: error: {words}")
    assert line.count("\n") == 1
    assert state_of(tmp_path) == {}


def _killed(number: int) -> None:
    psutil = pytest.importorskip("psutil", reason="it ends processes on every system")
    psutil.Process(number).kill()


def _wait_for_the_end_of(number: int) -> None:
    psutil = pytest.importorskip("psutil")
    stop = time.monotonic() + LONG
    while psutil.pid_exists(number) and psutil.Process(number).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < stop, "the run goes on alone"
        time.sleep(0.02)


def test_the_run_is_killed(begun: Callable[[str], Begun], tmp_path: Path) -> None:
    run = begun("time.sleep(600)")
    _killed(run.worker)
    status, line = run.end()
    assert (status, line.count("\n")) == (1, 1)
    assert line.endswith("nothing was written\n")
    assert state_of(tmp_path) == {}


def test_the_process_that_watches_is_killed(begun: Callable[[str], Begun], tmp_path: Path) -> None:
    run = begun("time.sleep(600)")
    run.process.kill()
    _wait_for_the_end_of(run.worker)
    run.end()
    left = [name for name in state_of(tmp_path) if not name.startswith(".geounfold-")]
    assert left == []
    if not can_fork():  # a spawned run clears up before it ends
        assert state_of(tmp_path) == {}


def test_a_library_that_prints_more_than_a_pipe_holds(
    begun: Callable[[str], Begun], tmp_path: Path
) -> None:
    run = begun("[os.write(2, b'noise' * 20000) for _ in range(20)]" if not can_fork() else "pass")
    assert run.end() == (0, "")
    assert {*state_of(tmp_path)} == {"new.csv"}


@pytest.mark.parametrize(
    "argv",
    [
        ("simulate", "sim_case_1", "-o", "new.csv"),
        ("unfold", "p.csv", "-o", "new.csv", "--summary", "s2.json", "--map", "m2.npz"),
        ("map", "given.npz", "p.csv", "-o", "new.csv"),
        ("compare", "p.csv", "-o", "new.csv", "--flatteners", "lscm"),
        ("quality", "p.csv", "higher.csv"),
        ("init", "-o", "new.toml"),
    ],
    ids=lambda argv: argv[0],
)
def test_main_commands(argv: tuple[str, ...], folder: Path) -> None:
    points = pd.read_csv(folder / "p.csv")
    (points + 1).to_csv(folder / "higher.csv", index=False)
    before = {*state_of(folder)}
    done = subprocess.run(
        [sys.executable, "-m", "geounfold", *argv],
        cwd=folder,
        env=with_fault(),
        capture_output=True,
        check=False,
        timeout=LONG,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    new = {*state_of(folder)} - before
    assert new == {w for w in argv if w in ("new.csv", "s2.json", "m2.npz", "new.toml")}


def test_text_that_the_console_lacks_is_escaped(tmp_path: Path) -> None:
    # Windows gives a pipe the old code page, which has no Greek letters.
    name = "\u03c6.csv"
    done = subprocess.run(
        [sys.executable, "-m", "geounfold", "unfold", name, "-o", "out.csv"],
        cwd=tmp_path,
        env=with_fault(PYTHONIOENCODING="cp1252", PYTHONUTF8="0"),
        capture_output=True,
        check=False,
        timeout=LONG,
    )
    assert done.returncode == 2
    assert b"\\u03c6.csv: no such file" in done.stderr.replace(b"\r", b"")


class _InUseError(PermissionError):
    winerror = 32


@pytest.mark.parametrize("times", [2, 10_000])
def test_a_target_that_another_program_has_open(
    times: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Windows refuses to replace it: for a moment if a virus scanner reads it, for long if a
    # spreadsheet shows it.
    left = [times]
    real = files.os.replace

    def refuse(source: Path, target: Path) -> None:
        if target == tmp_path / "b.csv" and left[0]:
            left[0] -= 1
            raise _InUseError(13, "Access is denied")
        real(source, target)

    monkeypatch.setattr(files.os, "replace", refuse)
    monkeypatch.setattr(files, "_PATIENCE", 0.2)
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("old", encoding="utf-8")
    wanted = {name: (tmp_path / name, ()) for name in ("a.csv", "b.csv")}
    outputs = Outputs.planned(wanted, overwrite=True)

    def run() -> None:
        with outputs.writing() as parts:
            for part in parts.values():
                part.write_text("new", encoding="utf-8")

    if times < 100:
        run()
        assert {*state_of(tmp_path).values()} == {b"new"}
    else:
        with pytest.raises(OutputError, match="another program has it open"):
            run()
        assert state_of(tmp_path) == {"a.csv": b"old", "b.csv": b"old"}


def test_outputs_whose_names_differ_by_letter_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {"--output": (tmp_path / "Out.csv", ()), "--map": (tmp_path / "out.csv", ())}
    monkeypatch.setattr(files, "_ignores_case", lambda _: True)
    with pytest.raises(OutputError, match="--output and --map name the same file"):
        Outputs.planned(wanted)
    monkeypatch.setattr(files, "_ignores_case", lambda _: False)
    assert len(Outputs.planned(wanted).paths) == 2


def test_letter_case_is_tried_on_the_disk(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    assert files._ignores_case(tmp_path) == (tmp_path / "A").exists()
    assert {*state_of(tmp_path)} == {"a"}
