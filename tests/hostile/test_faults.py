"""Faults from outside: killed, disk full, files gone, no memory: nothing half done, nothing lost.

Stages are hit by reading the progress that a run shows on a terminal, which is a pseudo-terminal
here, and acting as soon as a stage's name appears.
"""

from __future__ import annotations

import os
import pty
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import geounfold as gu
from geounfold.cli.process.journal import Account, Journal
from geounfold.errors import OutputError
from geounfold.io import Outputs, write_table

LONG = 120.0  # seconds after which a test gives up on a process; nothing is timed
LINES = {
    signal.SIGINT: (130, "geounfold: error: interrupted; nothing was written\n"),
    signal.SIGTERM: (143, "geounfold: error: terminated; nothing was written\n"),
    signal.SIGHUP: (129, "geounfold: error: hung up; nothing was written\n"),
}
MEMORY = "geounfold: error: out of memory; nothing was written\n"
UNFOLD = ("unfold", "p.csv", "-o", "out.csv", "--summary", "s.json", "--map", "m.npz")
SAMPLES = ("--samples", "p.csv", "--samples-out", "q.csv")
# Stages as pipeline.py, fitting.py, comparison.py and cli/commands name them.
SHEET = ("reading", "frame", "hull", "split", "sheet", "map", "quality", "writing")
THESIS = ("reading", "frame", "hull", "split", "thesis", "map", "quality", "writing")


def heed_stops() -> None:
    """Undo what the tests' own caller may have set, and a run would heed.

    ``nohup`` ignores hang-ups, and a shell interruptions of what it runs in the background.
    """
    for stop in (signal.SIGHUP, signal.SIGINT):
        signal.signal(stop, signal.SIG_DFL)


class Run:
    """A command in a process whose stderr is a terminal."""

    def __init__(self, *argv: str, cwd: Path, script: str = "", **settings: object) -> None:
        self._master, slave = pty.openpty()
        settings.setdefault("preexec_fn", heed_stops)
        how = ["-c", script] if script else ["-m", "geounfold"]
        self.process = subprocess.Popen(
            [sys.executable, *how, *argv],
            cwd=cwd,
            stdout=subprocess.PIPE,
            stderr=slave,
            **settings,  # type: ignore[call-overload]
        )
        os.close(slave)
        self._text = ""

    def until(self, stage: str) -> Run:
        """Wait for a stage's name on the terminal."""
        end = time.monotonic() + LONG
        while f"] {stage}" not in self._text:
            assert time.monotonic() < end, f"no stage {stage}: {self._text!r}"
            assert self._more(), f"over before stage {stage}: {self._text!r}"
        return self

    def send(self, number: int) -> Run:
        self.process.send_signal(number)
        return self

    def workers(self) -> list[int]:
        """Return the processes that this one has started."""
        pid = self.process.pid
        return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]

    def end(self) -> tuple[int, str]:
        """Return the exit status and what stays on the terminal."""
        while self._more():
            pass
        os.close(self._master)
        self.process.communicate(timeout=LONG)
        lines = self._text.replace("\r\n", "\n").split("\n")
        # What a carriage return goes back over, and an escape clears, does not stay.
        left = [line.rpartition("\r\x1b[K")[2] for line in lines]
        return self.process.returncode, "\n".join(left)

    def _more(self) -> bool:
        ready, _, _ = select.select([self._master], [], [], LONG)
        assert ready, f"silent for {LONG} s: {self._text!r}"
        try:
            read = os.read(self._master, 1 << 16)
        except OSError:  # a terminal that all others have left
            return False
        self._text += read.decode()
        return bool(read)


def _state(folder: Path) -> dict[str, bytes | None]:
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None
        for p in folder.rglob("*")
    }


def _shown(state: dict[str, bytes | None]) -> dict[str, bytes | None]:
    """Return the state without what SIGKILL may leave behind."""
    return {name: content for name, content in state.items() if not name.startswith(".geounfold-")}


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small anticline and its map."""
    folder = tmp_path_factory.mktemp("body")
    points = gu.simulate("sim_case_1", blocks=4000)
    write_table(folder / "p.csv", points.frame(4))
    gu.unfold(points.folded).save(folder / "given.npz")
    return folder


@pytest.fixture
def folder(body: Path, tmp_path: Path) -> Path:
    """The body, and an earlier output where the next ones are to be."""
    for path in body.iterdir():
        shutil.copy(path, tmp_path / path.name)
    for name in ("out.csv", "s.json", "m.npz", "q.csv"):
        (tmp_path / name).write_text(f"precious {name}")
    return tmp_path


def _gone(pid: int) -> bool:
    """Return whether a process has ended, reaped or not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


# ------------------------------------------------------------------------------------- signals


def _stopped(argv: tuple[str, ...], stage: str, sent: signal.Signals, folder: Path) -> None:
    before = _state(folder)
    status, line = Run(*argv, "--overwrite", cwd=folder).until(stage).send(sent).end()
    if status == 0 and stage == "writing":  # the signal came too late: all was in place
        after = _state(folder)
        assert {*after} == {*before}
        assert all(
            after[argv[k + 1]] != before[argv[k + 1]] for k, w in enumerate(argv) if w == "-o"
        )
        return
    assert (status, line) == LINES[sent]
    assert _state(folder) == before


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
    before = _state(folder)
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
    after = _shown(_state(folder))
    if stage == "writing":  # moves may have begun: each output is the old one or a whole new one
        assert {*after} == {*before}
    else:
        assert after == before
    left = _state(folder)
    status, _ = Run(*argv, "--overwrite", cwd=folder).end()
    assert status == 0
    assert {*_state(folder)} == {*left}  # no output besides, leftovers not taken for any
    assert _state(folder)["out.csv"] != before["out.csv"]


@pytest.mark.parametrize("stage", ["quality"])
def test_killed(stage: str, folder: Path) -> None:
    _killed(UNFOLD, stage, folder)


@pytest.mark.slow
@pytest.mark.parametrize(("argv", "stage"), EVERY, ids=lambda v: v if isinstance(v, str) else v[0])
def test_killed_everywhere(argv: tuple[str, ...], stage: str, folder: Path) -> None:
    (folder / "r.html").write_text("precious report")
    _killed(argv, stage, folder)


def test_a_run_that_cannot_react_is_left_at_once(folder: Path) -> None:
    # A stopped process stands for one that is inside a library's call: it reacts to nothing.
    before = _state(folder)
    run = Run(*UNFOLD, "--overwrite", cwd=folder).until("writing")
    for worker in run.workers():
        os.kill(worker, signal.SIGSTOP)
    status, line = run.send(signal.SIGINT).end()
    if status == 130 and "all outputs" not in line:
        assert (status, line) == LINES[signal.SIGINT]
        assert _state(folder) == before
    else:  # it was stopped when all was in place
        assert {*_state(folder)} == {*before}
        assert _state(folder)["out.csv"] != before["out.csv"]


ENDLESS = """
import itertools, sys
import geounfold.cli.entry as entry
from geounfold.io import Outputs
def endless(args, console):
    outputs = Outputs.planned({'o': ('new.csv', ())}, watcher=console.journal)
    with outputs.writing() as parts:
        parts['o'].write_text('half')
        console.stage('endless')
        END
entry._command = lambda name: endless
sys.argv = ['geounfold', 'simulate', '--list']
sys.exit(entry.main())
"""


def _in_a_call(end: str, folder: Path) -> Run:
    return Run(cwd=folder, script=ENDLESS.replace("END", end)).until("endless")


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_stopped_inside_a_call_that_never_returns(sent: signal.Signals, folder: Path) -> None:
    before = _state(folder)
    # sum() keeps the interpreter to itself and does not look at signals.
    run = _in_a_call("sum(itertools.repeat(1))", folder).send(sent)
    assert run.end() == LINES[sent]
    assert _state(folder) == before


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ("os.kill(os.getpid(), 11)", "a library crashed (SIGSEGV); nothing was written"),
        ("os.write(2, b'so sad\\n'), os._exit(3)", "a library ended the run: so sad; nothing"),
        ("os.write(2, b'std::bad_alloc\\n'), os.abort()", "out of memory; nothing was written"),
        ("os.kill(os.getpid(), 9)", "killed, as the system does where memory runs out; nothing"),
    ],
)
def test_a_library_that_ends_the_process(end: str, words: str, folder: Path) -> None:
    before = _state(folder)
    status, line = _in_a_call(f"import os; {end}", folder).end()
    assert status == 1
    assert line.startswith(f"geounfold: error: {words}")
    assert line.count("\n") == 1
    assert _state(folder) == before


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
    with journal.committing():
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


# -------------------------------------------------------------------------------------- disks


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Mount a small disk with the given options."""
    mounted: list[Path] = []

    def mount(options: str) -> Path:
        place = tmp_path / f"disk{len(mounted)}"
        place.mkdir()
        done = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            place.rmdir()
            pytest.skip(f"no disk can be mounted here: {done.stderr.strip()}")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", str(place)], check=True)


def _map(folder: Path, *argv: str, **settings: object) -> tuple[int, str]:
    return Run("map", "given.npz", "p.csv", "-o", *argv, cwd=folder, **settings).end()


@pytest.mark.parametrize(
    "name",
    [
        "out.csv",
        pytest.param("out.csv.gz", marks=pytest.mark.slow),
        pytest.param("out.parquet", marks=pytest.mark.slow),
    ],
)
def test_full_disk(name: str, folder: Path, disk: Callable[[str], Path]) -> None:
    # The output takes 30 kB and more, in any of the formats.
    place = disk("size=16k")
    (place / name).write_text("precious")
    status, line = _map(folder, f"{place.name}/{name}", "--overwrite")
    assert status == 2
    assert line.startswith("geounfold: error: cannot write ")
    assert "No space left on device" in line
    assert line.count("\n") == 1
    assert _state(place) == {name: b"precious"}


def test_full_disk_for_the_last_of_several_outputs(
    folder: Path, disk: Callable[[str], Path]
) -> None:
    place = disk("size=4k")
    before = _state(folder)
    argv = [*UNFOLD[:-1], f"{place.name}/m.npz", "--overwrite"]
    status, line = Run(*argv, cwd=folder).end()
    assert (status, line.count("\n")) == (2, 1)
    assert "No space left on device" in line
    assert _state(folder) == before


def test_limit_on_the_size_of_files(folder: Path) -> None:
    before = _state(folder)
    limit = 16 << 10  # bytes; the output takes more

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    status, line = _map(folder, "out.csv", "--overwrite", preexec_fn=limited)
    assert (status, line.count("\n")) == (2, 1)
    assert "File too large" in line
    assert _state(folder) == before


def test_read_only_disk(folder: Path, disk: Callable[[str], Path]) -> None:
    place = disk("ro")
    status, line = _map(folder, f"{place.name}/out.csv")
    assert status == 2
    assert "the folder cannot be written: Read-only file system" in line
    assert line.count("\n") == 1


# ---------------------------------------------------------------------- files changed meanwhile


def _carried_meanwhile(folder: Path, change: Callable[[], object], *argv: str) -> tuple[int, str]:
    """Carry points into new/out.csv, and do something to the disk while they are read."""
    (folder / "new").mkdir()
    run = Run("map", "given.npz", "p.csv", "-o", "new/out.csv", *argv, cwd=folder).until("reading")
    for worker in run.workers():
        os.kill(worker, signal.SIGSTOP)
    change()
    for worker in run.workers():
        os.kill(worker, signal.SIGCONT)
    return run.end()


def test_output_that_appears_meanwhile_is_kept(folder: Path) -> None:
    out = folder / "new" / "out.csv"
    status, line = _carried_meanwhile(folder, lambda: out.write_text("theirs"))
    assert status == 2
    assert "the file has appeared meanwhile; --overwrite replaces it" in line
    assert _state(out.parent) == {"out.csv": b"theirs"}


@pytest.mark.parametrize("argv", [(), ("--overwrite",)], ids=["new", "overwrite"])
def test_output_that_becomes_a_folder_meanwhile_is_kept(
    argv: tuple[str, ...], folder: Path
) -> None:
    out = folder / "new" / "out.csv"
    status, line = _carried_meanwhile(folder, lambda: (out / "theirs").mkdir(parents=True), *argv)
    assert (status, line.count("\n")) == (2, 1)
    assert _state(out.parent) == {"out.csv": None, "out.csv/theirs": None}


def test_folder_removed_meanwhile(folder: Path) -> None:
    before = _state(folder)
    status, line = _carried_meanwhile(folder, (folder / "new").rmdir)
    assert (status, line.count("\n")) == (2, 1)
    assert "new/out.csv: No such file or directory; nothing was changed" in line
    assert _state(folder) == before


def test_input_removed_meanwhile_is_no_loss(folder: Path) -> None:
    # It is either read already or missed; in both cases no other file changes.
    before = _state(folder)
    status, _ = _carried_meanwhile(folder, (folder / "p.csv").unlink)
    after = _state(folder)
    assert status in (0, 2)
    assert ("new/out.csv" in after) == (status == 0)
    assert all(after[name] == before[name] for name in before if name != "p.csv")


@pytest.mark.parametrize("links", [True, False], ids=["hard links", "no hard links"])
def test_replaced_outputs_come_back_where_a_later_one_fails(
    links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    if not links:
        monkeypatch.setattr(os, "link", refuse)
    for name in ("a", "c"):
        (tmp_path / name).write_text(f"old {name}")
    wanted = {name: (tmp_path / name, ()) for name in "abc"}
    outputs = Outputs.planned(wanted, overwrite=True)

    def run() -> None:
        with outputs.writing() as parts:
            for part in parts.values():
                part.write_text("new")
            (tmp_path / "c").unlink()
            (tmp_path / "c").mkdir()

    with pytest.raises(OutputError, match="not a regular file"):
        run()
    assert _state(tmp_path) == {"a": b"old a", "c": None}


# ------------------------------------------------------------------------------------- memory


def _with_memory(megabytes: int, argv: tuple[str, ...], folder: Path) -> int:
    """Run under a limit; return the status after checking what else is left of the run."""

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    before = _state(folder)
    status, line = Run(*argv, "--overwrite", cwd=folder, preexec_fn=limited).end()
    if status == 0:
        assert {*_state(folder)} == {*before}
    else:
        assert (status, line) == (1, MEMORY)
        assert _state(folder) == before
    return status


@pytest.mark.parametrize("megabytes", [100, 350, 600])
def test_memory_limit(megabytes: int, folder: Path) -> None:
    # 100 MB do not hold numpy, 350 not the threads of its BLAS; loading the libraries takes 800 MB
    # of addresses, so none suffices.
    assert _with_memory(megabytes, UNFOLD, folder) == 1


@pytest.mark.slow
@pytest.mark.parametrize("megabytes", [*range(50, 1200, 75), 1600, 4000])
@pytest.mark.parametrize(
    "argv",
    [
        UNFOLD,
        ("map", "given.npz", "p.csv", "-o", "out.csv"),
        ("compare", "p.csv", "-o", "out.csv"),
        ("simulate", "sim_case_2", "-o", "out.csv"),
    ],
    ids=lambda argv: argv[0],
)
def test_memory_limits(argv: tuple[str, ...], megabytes: int, folder: Path) -> None:
    status = _with_memory(megabytes, argv, folder)
    assert status == 0 or megabytes < 4000
