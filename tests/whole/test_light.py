"""Without the extras: the main job runs, and what needs a library names its extra."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import geounfold as gu
from geounfold.errors import MissingDependencyError
from geounfold.extras import EXTRAS, check, install, require
from geounfold.io import write_table
from tests.hostile.environment import LONG, with_fault
from tests.places import ROOT

BLOCKED = ("pyvista", "vtk", "vtkmodules", "matplotlib", "pyarrow", "pytetwild", "rich")
BLOCK = f"import sys\nfor name in {BLOCKED!r}:\n    sys.modules[name] = None\n"

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A body, its map and a script that blocks the libraries."""
    folder = tmp_path_factory.mktemp("light")
    body = gu.simulate("sim_case_1", blocks=4000)
    write_table(folder / "p.csv", body.frame(4))
    gu.unfold(body.folded).save(folder / "m.npz")
    (folder / "block.py").write_text(BLOCK, encoding="utf-8")
    return folder


def _light(folder: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "geounfold", *argv],
        cwd=folder,
        env=with_fault(folder / "block.py"),
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        timeout=LONG,
    )


def test_the_main_job_runs_and_gives_the_same_answer(folder: Path) -> None:
    done = _light(folder, "unfold", "p.csv", "-o", "o.csv", "--summary", "s.json", "--map", "n.npz")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads((folder / "s.json").read_text(encoding="utf-8"))["injective"] is True
    done = _light(folder, "map", "n.npz", "p.csv", "-o", "again.csv")
    assert (done.returncode, done.stderr) == (0, "")
    whole = subprocess.run(
        [sys.executable, "-m", "geounfold", "unfold", "p.csv", "-o", "whole.csv"],
        cwd=folder,
        check=True,
        timeout=LONG,
    )
    assert whole.returncode == 0
    assert (folder / "whole.csv").read_bytes() == (folder / "o.csv").read_bytes()


@pytest.mark.parametrize(
    ("argv", "library"),
    [
        (("unfold", "p.csv", "-o", "x.parquet"), "pyarrow"),
        (("unfold", "p.csv", "-o", "x.csv", "--report", "r.html"), "matplotlib"),
        (("unfold", "p.csv", "-o", "x.csv", "--mesh", "c.vtu"), "pyvista"),
        (("unfold", "p.csv", "-o", "x.vtp"), "pyvista"),
        (("map", "m.npz", "given.parquet", "-o", "x.csv"), "pyarrow"),
        (("map", "m.npz", "given.vtp", "-o", "x.csv"), "pyvista"),
        (("view", "p.csv", "-o", "v.png"), "matplotlib"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else value,
)
def test_what_is_missing_is_named(argv: tuple[str, ...], library: str, folder: Path) -> None:
    (folder / "given.parquet").write_bytes(b"PAR1")
    (folder / "given.vtp").write_text("<VTKFile/>", encoding="utf-8")
    before = {*folder.iterdir()}
    done = _light(folder, *argv)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1, done.stderr
    assert library in done.stderr
    assert install(library) in done.stderr
    assert {*folder.iterdir()} == before


def test_the_cross_check_names_what_its_meshers_lack(folder: Path) -> None:
    done = _light(folder, "crosscheck", "p.csv", "-o", "k.csv", "--meshers", "tetwild")
    assert "tetwild is not installed: pip install pytetwild" in done.stderr
    assert "Traceback" not in done.stderr


def test_doctor_is_content_without_extras(folder: Path) -> None:
    done = _light(folder, "doctor", "--json")
    found = json.loads(done.stdout)
    assert found["checks"]["libigl"]["ok"]
    assert found["checks"]["off-screen rendering"]["ok"] is None
    assert "pip install 'geounfold[report]'" in found["checks"]["off-screen rendering"]["message"]
    assert done.returncode == 0


def test_every_optional_library_has_its_extra() -> None:
    named = {"vtkmodules"}  # of vtk, which pyvista brings
    extras = PROJECT["optional-dependencies"]
    for library, extra in EXTRAS.items():
        packages = [re.split(r"[\[<>=!~; ]", text)[0] for text in extras[extra]]
        assert library in packages or library in named, (library, extra)


def test_main_dependencies_are_the_six_and_packaging() -> None:
    names = {re.split(r"[<>=!~; ]", text)[0] for text in PROJECT["dependencies"]}
    six = {"libigl", "pytetwild", "pymeshlab", "numpy", "scipy", "pandas"}
    assert names == six | {"packaging"}


def test_users_extras_are_all_in_all() -> None:
    extras = PROJECT["optional-dependencies"]
    inside = extras["all"][0].partition("[")[2].rstrip("]").split(",")
    assert {*inside} == {*extras} - {"all", "dev", "docs", "notebooks", "tetgen"}


def test_optional_libraries_are_imported_through_their_door() -> None:
    # A bare import ends in a traceback where the library is absent.
    doors = {"geounfold/cli/terminal/progress.py"}  # looks for rich first
    found = []
    for path in sorted((ROOT / "geounfold").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef):
                continue
            for inner in ast.walk(node):
                modules = (
                    [a.name for a in inner.names]
                    if isinstance(inner, ast.Import)
                    else [inner.module or ""]
                    if isinstance(inner, ast.ImportFrom)
                    else []
                )
                for module in modules:
                    if module.partition(".")[0] in BLOCKED[:5] + BLOCKED[6:] and name not in doors:
                        found.append(f"{name}:{inner.lineno}")
    # Drawing has gone through `require` before it makes a Figure of its own.
    assert [f for f in found if not f.startswith("geounfold/report/plots/")] == []


def test_a_library_that_cannot_be_loaded_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: str) -> None:
        raise ImportError("libGL.so.1: cannot open shared object file")

    monkeypatch.setattr("geounfold.extras.import_module", broken)
    with pytest.raises(MissingDependencyError, match=r"cannot be loaded \(libGL.*\[view\]"):
        require("pyvista", "pictures")
    monkeypatch.setattr("geounfold.extras.find_spec", lambda _: None)
    with pytest.raises(MissingDependencyError, match=r"Parquet files need pyarrow: .*\[parquet\]"):
        check("pyarrow", "Parquet files")
