"""MeshLab's door: what is missing is named with its cure, what fails is named in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from geounfold.backends import meshlab
from geounfold.errors import BackendError, MissingDependencyError

V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


class Refusal(Exception):  # noqa: N818  (named by the stub only)
    """Stands for pymeshlab's PyMeshLabException."""


@pytest.fixture
def refuse(monkeypatch):
    """Return a function that makes every filter and reader end with a message."""

    def install(message):
        def fail(*_words, **_options):
            raise Refusal(message)

        meshes = SimpleNamespace(add_mesh=lambda _mesh: None, apply_filter=fail, load_new_mesh=fail)
        stub = SimpleNamespace(
            PyMeshLabException=Refusal,
            PureValue=float,
            Mesh=lambda **_parts: None,
            MeshSet=lambda verbose: meshes,
        )
        monkeypatch.setitem(sys.modules, "pymeshlab", stub)

    return install


def test_a_filter_left_out_for_want_of_opengl_names_the_package(refuse):
    # As pymeshlab 2025.7 puts it on a machine without libOpenGL.so.0.
    refuse(
        "Failed to apply filter: meshing_isotropic_explicit_remeshing\n"
        "Filter does not exists. Take a look at MeshSet.print_filter_list function."
    )
    with pytest.raises(MissingDependencyError, match=r"remeshing cannot be loaded: .*libopengl0"):
        meshlab.remesh(V, F, 0.3, 2)
    with pytest.raises(MissingDependencyError, match=r"close_holes cannot be loaded: .*libopengl0"):
        meshlab.close_holes(V, F, 5)


def test_a_reader_left_out_for_want_of_opengl_names_the_package(refuse):
    refuse("Unknown format for load: ply")
    with pytest.raises(MissingDependencyError, match=r"cannot read a\.ply: .*libopengl0"):
        meshlab.read_mesh("a.ply")


def test_a_filter_that_fails_is_told_in_one_line(refuse):
    refuse("Failed to apply filter: taubin\nDetails: too\n  few faces")
    with pytest.raises(BackendError, match=r"failed: .*Details: too few faces"):
        meshlab.taubin(V, F, 2)


def test_an_absent_pymeshlab_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingDependencyError, match="pip install pymeshlab"):
        meshlab.taubin(V, F, 2)


def test_a_surface_without_vertices_is_refused():
    with pytest.raises(BackendError, match="MeshLab cannot take the surface"):
        meshlab.taubin(np.empty((0, 3)), np.empty((0, 3), np.int64), 1)


def test_what_the_library_prints_when_loaded_stays_out_of_answers(tmp_path: Path) -> None:
    # pymeshlab names plugins that lack a system library on stdout.
    fake = (
        "import os\nos.write(1, b'Unable to load the following plugins')\nraise ImportError('x')\n"
    )
    (tmp_path / "pymeshlab.py").write_text(fake, encoding="utf-8")
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from geounfold.backends.meshlab import _pymeshlab\n"
        "try: _pymeshlab()\n"
        "except Exception as error: print(type(error).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["MissingDependencyError"]
    assert "Unable to load" in done.stderr
