"""The folders that hold OMF files of every version."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.io.formats.omf.files import DATA, MAKE


@pytest.fixture(scope="module", params=["at hand", "in data"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return folders of files: of both libraries from the data, of the installed one new."""
    if request.param == "in data":
        return DATA
    pytest.importorskip("omf", reason="omf (extra formats) is not installed")
    made: Path = tmp_path_factory.mktemp("omf")
    MAKE["write"](made)
    return made
