"""A small body, its map, and a folder in which a run would overwrite earlier outputs."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path

import pytest

import geounfold as gu
from geounfold.io import write_table

# These need terminals, signals and limits that Windows does not have; test_guard.py does not.
collect_ignore = (
    []
    if find_spec("pty")
    else ["processes.py", "test_signals.py", "test_memory.py", "test_disks.py"]
)


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
    """The body, and an earlier output in the place of the next ones."""
    for path in body.iterdir():
        shutil.copy(path, tmp_path / path.name)
    for name in ("out.csv", "s.json", "m.npz", "q.csv"):
        (tmp_path / name).write_text(f"precious {name}")
    return tmp_path
