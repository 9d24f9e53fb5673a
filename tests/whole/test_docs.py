"""The documentation: its examples run, and its tables of formats are true."""

from __future__ import annotations

import doctest
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.cli.arguments.parser import build_parser
from geounfold.io import write_surface
from geounfold.io.formats import FORMATS, find_format
from geounfold.io.paths import TABLE_ENDINGS
from geounfold.synthetic import GradeField, drill
from tests.cli.domains import four_domains
from tests.places import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
README = ROOT / "README.md"
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def _name(page: Path) -> str:
    """Return a page's name as the tests show it."""
    return str(page.relative_to(ROOT).with_suffix(""))


@pytest.mark.parametrize(
    "page", [p for p in (README, *PAGES) if ">>> " in p.read_text()], ids=_name
)
def test_examples_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    failed, tried = doctest.testfile(str(page), module_relative=False, optionflags=FLAGS)
    assert tried > 0
    assert failed == 0


def _format_rows() -> dict[str, list[str]]:
    """Return the table of formats: cells by ending."""
    rows = {}
    for line in (DOCS / "how-to" / "formats.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if found := re.fullmatch(r"`(\.[a-z0-9.]+)`", cells[0]):
            rows[found[1]] = cells[1:]
    return rows


ROWS = _format_rows()


def _verbs(ending: str, what: str) -> str:
    """Return what the program does with files of an ending, in the table's words."""
    if ending in TABLE_ENDINGS:
        return "-" if (what, ending) == ("surface", ".csv.gz") else "read, write"
    ways = [
        verb
        for verb, can in (("read", f"reads_{what}"), ("write", f"writes_{what}"))
        if find_format(ending, can) is not None
    ]
    return ", ".join(ways) or "-"


def test_the_table_has_every_format() -> None:
    known = {e for f in FORMATS for e in (*f.reads_points, *f.reads_surface)}
    assert set(ROWS) == known | set(TABLE_ENDINGS)


@pytest.mark.parametrize("ending", sorted(ROWS))
def test_the_table_says_what_is_read_and_written(ending: str) -> None:
    name, points, surfaces, again, library = ROWS[ending]
    assert points == _verbs(ending, "points")
    assert surfaces == _verbs(ending, "surface")
    writes = "write" in points or "write" in surfaces
    assert (again == "-") == (not writes)  # how exactly: test_formats, by the same endings
    if ending in TABLE_ENDINGS:
        return
    found = next(f for f in FORMATS if ending in (*f.reads_points, *f.reads_surface))
    assert name == found.name
    assert library.startswith(found.library or library)
    # Texts become codes if only numbers can be held, for points that can be written.
    assert ("texts as codes" in again) == (found.numbers_only and "write" in points)


def test_every_page_is_in_the_navigation() -> None:
    named = set(re.findall(r"[\w/-]+\.md", (ROOT / "mkdocs.yml").read_text()))
    assert named == {str(p.relative_to(DOCS)) for p in PAGES}


def _anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as code hosts and the site make them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.M)
    return {re.sub(r"[^\w -]", "", h).strip().lower().replace(" ", "-") for h in headings}


def test_the_links_of_the_readme_lead_somewhere() -> None:  # those of the pages: mkdocs, strictly
    links = re.findall(r"\]\((?!http)([^)#]*)(?:#([^)]*))?\)", README.read_text())
    assert links
    for path, anchor in links:
        assert (ROOT / path).is_file(), path
        assert not anchor or anchor in _anchors(ROOT / path), (path, anchor)


def test_files_and_targets_that_the_pages_name_exist() -> None:
    text = "\n".join(page.read_text() for page in (README, *PAGES))
    paths = set(re.findall(r"\b(?:data|geounfold|notebooks|tests)/[\w./]*\w", text))
    targets = set(re.findall(r"(?:`|\$ )make ([\w-]+)", text))
    made = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert len(paths) > 1
    assert [path for path in sorted(paths) if not (ROOT / path).exists()] == []
    assert targets
    assert targets <= made


def commands(page: Path) -> list[list[str]]:
    """Return the arguments of a page's runs of geounfold, in order."""
    text = "\n".join(re.findall(r"```console\n(.*?)```", page.read_text(), re.S))
    lines = re.findall(r"^ *\$ (.*)$", text.replace("\\\n", " "), re.M)
    runs = [shlex.split(run, comments=True) for line in lines for run in line.split("&&")]
    return [
        run[1 : run.index(">") if ">" in run else None] for run in runs if run[0] == "geounfold"
    ]


WITH_COMMANDS = [page for page in (README, *PAGES) if commands(page)]


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=_name)
def test_commands_have_the_options_that_the_pages_give_them(page: Path) -> None:
    for arguments in commands(page):
        build_parser().parse_args(arguments)  # raises SystemExit if one is unknown


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the pages' commands read, made of one small body."""
    folder = tmp_path_factory.mktemp("scene")
    body = gu.simulate("plunging", blocks=3000)
    blocks = pd.DataFrame(body.folded, columns=["XC", "YC", "ZC"])
    blocks[["XINC", "YINC", "ZINC"]] = body.steps
    blocks[["true_x", "true_y", "true_z"]] = body.truth
    blocks["au"], blocks["cu"] = 1.0, 2.0
    blocks.to_csv(folder / "blocks.csv", index=False)
    (folder / "regional").mkdir()
    for name in ("model.parquet", "regional.parquet", "regional/part-00000.parquet"):
        blocks.to_parquet(folder / name, index=False)
    field = GradeField("spherical", (150.0, 150.0, 25.0), seed=1, mean=2.0, deviation=0.5)
    drilled = drill(body, field, spacing=50.0, seed=1)
    drilled.collar.to_csv(folder / "collar.csv", index=False)
    drilled.survey.to_csv(folder / "survey.csv", index=False)
    drilled.assay.rename(columns={"grade": "CU"}).to_csv(folder / "assay.csv", index=False)
    (folder / "lode").mkdir()
    lode = drill(gu.simulate("sim_case_1"), field, spacing=80.0, seed=1, waste=True)
    for name, table in zip(("collar", "survey", "lith"), lode, strict=True):
        table.to_csv(folder / "lode" / f"{name}.csv", index=False)
    u = gu.unfold(body.folded)
    u.save(folder / "m.npz")
    samples = gu.read_drillholes(*drilled).samples(2.0).rename(columns={"grade": "CU"})
    samples.to_csv(folder / "holes.csv", index=False)
    wireframe = pd.DataFrame(body.folded[::7], columns=["x", "y", "z"])
    wireframe.to_csv(folder / "wireframe.csv", index=False)
    u.hull_mesh.to_pyvista().save(folder / "wireframe.ply")
    surfaces = {"solid.dxf": u.hull_mesh, "roof.ts": u.top.folded, "floor.ts": u.bottom.folded}
    for name, mesh in surfaces.items():
        write_surface(folder / name, mesh)
    grid = gu.regular_grid(u.points, (10.0, 10.0, 5.0))
    estimated = pd.DataFrame(grid.centroids, columns=["x", "y", "z"])
    estimated[["dx", "dy", "dz"]] = grid.sizes
    estimated.assign(au=1.0, cu=2.0).to_csv(folder / "grid_estimated.csv", index=False)
    model = four_domains()
    model["ROCK"] = np.where(model["DOMAIN"] == "LODE 1", "ORE", "OTHER")
    model.to_csv(folder / "model.csv", index=False)
    return folder


def _small(arguments: list[str]) -> list[str]:
    """Return a command that replaces outputs, makes a small body and needs no cluster's host."""
    command, *rest = arguments
    if "--scheduler" in rest:
        at = rest.index("--scheduler")
        rest[at : at + 2] = []
    if command == "simulate" and "--list" not in rest:
        rest += ["--blocks", "3000"]
    return [command, "--overwrite", *rest]


LIBRARIES = {"estimate": "gstlearn", "dask": "distributed", "completion": "shtab"}  # of extras
# Long ones, whose commands are those of the README and a few dear ones more.
LONG = ("reference/command-line", "how-to/report", "tutorials/simulated")
RUNS = [
    pytest.param(page, marks=[pytest.mark.slow] if _name(page).endswith(LONG) else [])
    for page in WITH_COMMANDS
]


@pytest.mark.parametrize("page", RUNS, ids=_name)
def test_commands_of_the_pages_run(
    page: Path, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = {word for arguments in commands(page) for word in arguments}
    for word, library in LIBRARIES.items():
        if word in words:
            pytest.importorskip(library)
    shutil.copytree(scene, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    for arguments in commands(page):
        assert main(_small(arguments)) == 0, arguments
