"""The recipe, the citation, the workflows and the pages agree with pyproject.toml."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from geounfold import __version__
from tests.places import ROOT

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
EXTRAS = PROJECT["optional-dependencies"]
NOT_FOR_USERS = {"all", "dev", "docs", "notebooks"}
CONDA = {"libigl": "igl", "matplotlib": "matplotlib-base", "dask[dataframe]": "dask"}
"""Names on conda-forge that differ."""

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def _pins(requirements: list[str]) -> dict[str, str]:
    """Return version specifiers by name on conda-forge."""
    pins = {}
    for requirement in requirements:
        text = requirement.partition(";")[0].strip()
        found = re.fullmatch(r"([\w\-\[\]]+)(.*)", text)
        assert found, requirement
        pins[CONDA.get(found[1], found[1])] = found[2]
    return pins


def _recipe() -> dict[str, Any]:
    text = (ROOT / "recipe" / "meta.yaml").read_text(encoding="utf-8")
    version = re.search(r'set version = "(.*)"', text)
    assert version
    plain = re.sub(r"{%.*%}\n", "", text).replace("{{ version }}", version[1])
    recipe: dict[str, Any] = yaml.safe_load(plain.replace("{{ PYTHON }}", "python"))
    return recipe


def _conda_pins(requirements: list[str]) -> dict[str, str]:
    return {name: pin for name, _, pin in (text.partition(" ") for text in requirements)}


def test_the_recipe_has_the_pins() -> None:
    run = _conda_pins(_recipe()["requirements"]["run"])
    assert run.pop("python") == PROJECT["requires-python"]
    assert run == _pins(PROJECT["dependencies"])
    optional = {
        name: pin
        for extra, texts in EXTRAS.items()
        if extra not in NOT_FOR_USERS
        for name, pin in _pins(texts).items()
    }
    assert _conda_pins(_recipe()["requirements"]["run_constrained"]) == optional
    host = _conda_pins(_recipe()["requirements"]["host"])
    assert f"hatchling{host['hatchling']}" in PYPROJECT["build-system"]["requires"]


def test_versions_agree() -> None:
    assert _recipe()["package"]["version"] == __version__
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["license"] == _recipe()["about"]["license"]


def test_the_workflows_try_the_systems_and_pythons_that_are_promised() -> None:
    flow = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8"))
    matrix = flow["jobs"]["tests"]["strategy"]["matrix"]
    promised = {c.rpartition(" :: ")[2] for c in PROJECT["classifiers"] if ":: 3." in c}
    assert {*matrix["python"]} == promised == {"3.11", "3.12", "3.13", "3.14"}
    assert {name.partition("-")[0] for name in matrix["os"]} == {"ubuntu", "windows", "macos"}
    runs = [step.get("run", "") for step in flow["jobs"]["tests"]["steps"]]
    assert "python -m pip install .[dev]" in runs
    assert any(run.startswith('python -m pytest -m "not slow"') for run in runs)


@pytest.mark.parametrize("name", ["tests", "release"])
def test_the_workflows_name_files_that_exist(name: str) -> None:
    text = (ROOT / f".github/workflows/{name}.yml").read_text(encoding="utf-8")
    named = set(re.findall(r"\b(?:tools|tests|geounfold)/[\w./]*\w", text))
    assert named
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_release_publishes_without_a_password() -> None:
    text = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
    assert "id-token: write" in text
    assert "secrets." not in text


def test_the_constraints_allow_what_is_required() -> None:
    from packaging.requirements import Requirement

    pinned = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        name, _, version = line.partition(";")[0].strip().partition("==")
        pinned[name.lower().replace("_", "-")] = version
    every = [*PROJECT["dependencies"], *(text for texts in EXTRAS.values() for text in texts)]
    for requirement in map(Requirement, every):
        if requirement.name != PROJECT["name"]:
            assert requirement.specifier.contains(pinned[requirement.name.lower()]), requirement


def _paragraphs(page: Path) -> list[str]:
    return page.read_text(encoding="utf-8").split("\n\n")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_installing_by_name_says_from_where(page: Path) -> None:
    # It is in no index yet: what is installed is the clone, by `.` or `.[extra]`.
    for paragraph in _paragraphs(page):
        for words in re.findall(r"pip install[^`\n]*", paragraph):
            if "geounfold" in words:
                assert "clone" in paragraph, paragraph


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_extras_on_the_pages_exist(page: Path) -> None:
    for names in re.findall(r"(?:geounfold|'?\.)\[([\w,]+)\]", page.read_text(encoding="utf-8")):
        assert {*names.split(",")} <= {*EXTRAS}, names


def test_both_ways_to_run_the_tests_are_the_same() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    script = (ROOT / "tools" / "run.py").read_text(encoding="utf-8")
    for words in ("-n auto --dist loadfile", "not slow"):
        assert words in makefile
        assert all(word in script for word in words.split())
