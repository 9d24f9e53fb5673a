"""Runs that are stopped, killed, or ended by a library: nothing is left half written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from geounfold.backends.system.signals import stoppable
from geounfold.cli.process.journal import Account, Journal
from tests.hostile.environment import LONG, state_of
from tests.hostile.processes import UNFOLD, Run

LINES = {
    signal.SIGINT: (130, "geounfold: error: interrupted; nothing was written\n"),
    signal.SIGTERM: (143, "geounfold: error: terminated; nothing was written\n"),
    signal.SIGHUP: (129, "geounfold: error: hung up; nothing was written\n"),
}

SAMPLES = ("--samples", "p.csv", "--samples-out", "q.csv")

# Stages as pipeline.py, fitting.py, comparison.py and cli/commands name them.
SHEET = ("reading", "frame", "hull", "split", "sheet", "map", "quality", "writing")

THESIS = ("reading", "frame", "hull", "split", "thesis", "map", "quality", "writing")


def _shown(state: dict[str, bytes | None]) -> dict[str, bytes | None]:
    """Return the state without what SIGKILL may leave behind."""
    return {name: content for name, content in state.items() if not name.startswith(".geounfold-")}


def _gone(pid: int) -> bool:
    """Return whether a process has ended, reaped or not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def _stopped(argv: tuple[str, ...], stage: str, sent: signal.Signals, folder: Path) -> None:
    before = state_of(folder)
    status, line = Run(*argv, "--overwrite", cwd=folder).until(stage).send(sent).end()
    if status == 0 and stage == "writing":  # the signal came too late: all was in place
        after = state_of(folder)
        assert {*after} == {*before}
        assert all(
            after[argv[k + 1]] != before[argv[k + 1]] for k, w in enumerate(argv) if w == "-o"
        )
        return
    assert (status, line) == LINES[sent]
    assert state_of(folder) == before


@pytest.mark.parametrize(
    ("stage", "sent"),
    [
        ("reading", signal.SIGHUP),
        ("hull", signal.SIGINT),
        ("sheet", signal.SIGTERM),
        ("writing", signal.SIGINT),
    ],
)
def test_stopped(stage: str, sent: signal.Signals, folder: Path) -> None:
    _stopped((*UNFOLD, *SAMPLES), stage, sent, folder)


EVERY = [
    *((UNFOLD, stage) for stage in SHEET),
    *(((*UNFOLD, "--report", "r.html"), stage) for stage in ("checking", "reading", "writing")),
    *(((*UNFOLD, "--method", "thesis"), stage) for stage in THESIS),
    *((("compare", "p.csv", "-o", "out.csv"), s) for s in (*SHEET[:-1], "top", "bottom", "mid")),
    *((("map", "given.npz", "p.csv", "-o", "out.csv"), s) for s in ("reading", "carrying")),
    (("simulate", "large", "-o", "out.csv"), "simulating"),
    (("crosscheck", "p.csv", "-o", "out.csv"), "tetwild mesh"),  # in a process further down
]


@pytest.mark.slow
@pytest.mark.parametrize("sent", LINES, ids=lambda s: s.name)
@pytest.mark.parametrize(("argv", "stage"), EVERY, ids=lambda v: v if isinstance(v, str) else v[0])
def test_stopped_everywhere(
    argv: tuple[str, ...], stage: str, sent: signal.Signals, folder: Path
) -> None:
    (folder / "r.html").write_text("precious report")
    _stopped(argv, stage, sent, folder)


def _killed(argv: tuple[str, ...], stage: str, folder: Path) -> None:
    before = state_of(folder)
    run = Run(*argv, "--overwrite", cwd=folder).until(stage)
    workers = run.workers()
    assert workers
    status, line = run.send(signal.SIGKILL).end()
    assert status == -signal.SIGKILL
    assert "error" not in line
    end = time.monotonic() + LONG
    while not all(map(_gone, workers)):
        assert time.monotonic() < end, "the run goes on without its parent"
        time.sleep(0.01)
    after = _shown(state_of(folder))
    if stage == "writing":  # moves may have begun: each output is the old one or a whole new one
        assert {*after} == {*before}
    else:
        assert after == before
    left = state_of(folder)
    status, _ = Run(*argv, "--overwrite", cwd=folder).end()
    assert status == 0
    assert {*state_of(folder)} == {*left}  # no output besides, leftovers not taken for any
    assert state_of(folder)["out.csv"] != before["out.csv"]


@pytest.mark.parametrize("stage", ["quality"])
def test_killed(stage: str, folder: Path) -> None:
    _killed(UNFOLD, stage, folder)


@pytest.mark.slow
@pytest.mark.parametrize(("argv", "stage"), EVERY, ids=lambda v: v if isinstance(v, str) else v[0])
def test_killed_everywhere(argv: tuple[str, ...], stage: str, folder: Path) -> None:
    (folder / "r.html").write_text("precious report")
    _killed(argv, stage, folder)


def test_a_run_that_cannot_react_is_left_at_once(folder: Path) -> None:
    # A stopped process acts like one inside a library's call: it reacts to nothing.
    before = state_of(folder)
    run = Run(*UNFOLD, "--overwrite", cwd=folder).until("writing")
    for worker in run.workers():
        os.kill(worker, signal.SIGSTOP)
    status, line = run.send(signal.SIGINT).end()
    if status == 130 and "all outputs" not in line:
        assert (status, line) == LINES[signal.SIGINT]
        assert state_of(folder) == before
    else:  # it was stopped when all was in place
        assert {*state_of(folder)} == {*before}
        assert state_of(folder)["out.csv"] != before["out.csv"]


ENDLESS = """
import itertools
import geounfold.cli.entry as entry
def endless(args, console):
    from geounfold.io import Outputs
    outputs = Outputs.planned({'o': ('new.csv', ())}, watcher=console.journal)
    with outputs.writing() as parts:
        parts['o'].write_text('half')
        console.stage('endless')
        END
entry._command = lambda name: endless
"""


def _in_a_call(end: str, tmp_path_factory: pytest.TempPathFactory, folder: Path) -> Run:
    fault = tmp_path_factory.mktemp("fault") / "fault.py"
    fault.write_text(ENDLESS.replace("END", end), encoding="utf-8")
    return Run("simulate", "--list", cwd=folder, fault=fault).until("endless")


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_stopped_inside_a_call_that_never_returns(
    sent: signal.Signals, folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    before = state_of(folder)
    # sum() keeps the interpreter to itself and does not look at signals.
    run = _in_a_call("sum(itertools.repeat(1))", tmp_path_factory, folder).send(sent)
    assert run.end() == LINES[sent]
    assert state_of(folder) == before


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("os.kill(os.getpid(), 11)", "a library crashed (SIGSEGV); nothing was written"),
        ("os.write(2, b'so sad\\n'), os._exit(3)", "a library ended the run: so sad; nothing"),
        ("os.write(2, b'std::bad_alloc\\n'), os.abort()", "out of memory; nothing was written"),
        ("os.kill(os.getpid(), 9)", "killed, as the system does where memory runs out; nothing"),
    ],
)
def test_a_library_that_ends_the_process(
    end: str, words: str, folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    before = state_of(folder)
    status, line = _in_a_call(f"import os; {end}", tmp_path_factory, folder).end()
    assert status == 1
    assert line.startswith(f"geounfold: error: {words}")
    assert line.count("\n") == 1
    assert state_of(folder) == before


def test_signals_that_the_caller_ignores_stay_ignored(folder: Path) -> None:
    def ignore() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    argv = ("map", "given.npz", "p.csv", "-o", "new.csv")
    run = Run(*argv, cwd=folder, preexec_fn=ignore).until("reading").send(signal.SIGINT)
    assert run.end()[0] == 0
    assert (folder / "new.csv").exists()


def test_stderr_that_takes_nothing_is_no_failure(folder: Path) -> None:
    with Path("/dev/full").open("w") as stream:
        done = subprocess.run(
            [sys.executable, "-m", "geounfold", "map", "given.npz", "p.csv", "-o", "new.csv"],
            cwd=folder,
            stderr=stream,
            check=False,
        )
    assert done.returncode == 0


def test_full_stdout_is_one_line(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as stream:
        done = subprocess.run(
            [sys.executable, "-m", "geounfold", "simulate", "--list"],
            stdout=stream,
            stderr=subprocess.PIPE,
            check=False,
            text=True,
        )
    line = "geounfold: error: cannot write to stdout: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, line)


def test_account_of_a_journal_cut_anywhere() -> None:
    reading, writing = os.pipe()
    journal = Journal(writing)
    journal.part(Path("/a/b"))
    with stoppable(), journal.committing():  # stops are ignored after a commit, but not for ever
        pass
    journal.ended(0)
    whole = os.read(reading, 1000)
    os.close(reading)
    os.close(writing)
    assert Account.of(whole) == Account((Path("/a/b"),), False, True, 0)
    for cut in range(len(whole)):
        account = Account.of(whole[:cut])
        assert account.status is None
        assert account.parts in ((), (Path("/a/b"),))
