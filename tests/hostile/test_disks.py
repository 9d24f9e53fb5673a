"""Disks that are full or read-only, and files that change during a run."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from geounfold.errors import OutputError
from geounfold.io import Outputs
from tests.hostile.environment import state_of
from tests.hostile.processes import UNFOLD, Run


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
    assert state_of(place) == {name: b"precious"}


def test_full_disk_for_the_last_of_several_outputs(
    folder: Path, disk: Callable[[str], Path]
) -> None:
    place = disk("size=4k")
    before = state_of(folder)
    argv = [*UNFOLD[:-1], f"{place.name}/m.npz", "--overwrite"]
    status, line = Run(*argv, cwd=folder).end()
    assert (status, line.count("\n")) == (2, 1)
    assert "No space left on device" in line
    assert state_of(folder) == before


def test_limit_on_the_size_of_files(folder: Path) -> None:
    before = state_of(folder)
    limit = 16 << 10  # bytes; the output takes more

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    status, line = _map(folder, "out.csv", "--overwrite", preexec_fn=limited)
    assert (status, line.count("\n")) == (2, 1)
    assert "File too large" in line
    assert state_of(folder) == before


def test_read_only_disk(folder: Path, disk: Callable[[str], Path]) -> None:
    place = disk("ro")
    status, line = _map(folder, f"{place.name}/out.csv")
    assert status == 2
    assert "the folder cannot be written: Read-only file system" in line
    assert line.count("\n") == 1


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
    assert state_of(out.parent) == {"out.csv": b"theirs"}


@pytest.mark.parametrize("argv", [(), ("--overwrite",)], ids=["new", "overwrite"])
def test_output_that_becomes_a_folder_meanwhile_is_kept(
    argv: tuple[str, ...], folder: Path
) -> None:
    out = folder / "new" / "out.csv"
    status, line = _carried_meanwhile(folder, lambda: (out / "theirs").mkdir(parents=True), *argv)
    assert (status, line.count("\n")) == (2, 1)
    assert state_of(out.parent) == {"out.csv": None, "out.csv/theirs": None}


def test_folder_removed_meanwhile(folder: Path) -> None:
    before = state_of(folder)
    status, line = _carried_meanwhile(folder, (folder / "new").rmdir)
    assert (status, line.count("\n")) == (2, 1)
    assert "new/out.csv: No such file or directory; nothing was changed" in line
    assert state_of(folder) == before


def test_input_removed_meanwhile_is_no_loss(folder: Path) -> None:
    # It is either read already or missed; in both cases no other file changes.
    before = state_of(folder)
    status, _ = _carried_meanwhile(folder, (folder / "p.csv").unlink)
    after = state_of(folder)
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
    assert state_of(tmp_path) == {"a": b"old a", "c": None}
