"""The documentation: its examples run, and what it says of formats is what is so."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

from geounfold.cli.parser import build_parser
from geounfold.io.formats import FORMATS, find_format
from geounfold.io.tables import TABLE_ENDINGS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


@pytest.mark.parametrize(
    "page", [p for p in PAGES if ">>> " in p.read_text()], ids=lambda p: p.stem
)
def test_examples_run(page: Path) -> None:
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
    """Return what the program does with files of an ending, as the table says it."""
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
    # Texts become codes where only numbers can be held, of points that can be written.
    assert ("texts as codes" in again) == (found.numbers_only and "write" in points)


def test_every_page_is_in_the_navigation() -> None:
    named = set(re.findall(r"[\w/-]+\.md", (ROOT / "mkdocs.yml").read_text()))
    assert named == {str(p.relative_to(DOCS)) for p in PAGES}


def test_every_command_in_the_pages_exists() -> None:
    parser = build_parser()
    known = next(a.choices for a in parser._actions if isinstance(a.choices, dict))
    used = {
        word
        for page in (*PAGES, ROOT / "README.md")
        for word in re.findall(r"\$ geounfold (\w+)", page.read_text())
    }
    assert used
    assert used <= set(known)
