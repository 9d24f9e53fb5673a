"""The report: complete, self-contained, and plain about what is wrong."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from geounfold.errors import InputError, MissingDependencyError
from geounfold.report import report_html, verdict, write_report
from geounfold.report.plots.rendering import check_rendering
from geounfold.report.plots.style import ViewOptions
from geounfold.report.sections import figures_section

try:
    check_rendering()
    CANNOT = ""
except MissingDependencyError as error:
    CANNOT = str(error)
needs_rendering = pytest.mark.skipif(bool(CANNOT), reason=CANNOT or "nothing is missing")

SMALL = ViewOptions(size=(80, 60))
GRID = np.stack(np.meshgrid(*[np.arange(float(n)) for n in (6, 5, 4)], indexing="ij"), -1)
SLAB = GRID.reshape(-1, 3)
COLUMNS = {"stratigraphic": SLAB[:, 2] / 3, "shear": SLAB[:, 0] / 5, "location": ["inside"] * 120}
PROVED = {"injective": True, "tetrahedra": 6, "boundary_faces": 12}
SOUND = {"inverted_folded": 0, "inverted_unfolded": 0, "injective": True, "outside_share": 0.0}
SUMMARY = SOUND | {
    "version": "9.8.7",
    "options": {"method": "sheet", "hull": {"sigma": 0.8}},
    "seconds": {"hull": 0.25, "map": 0.5},
    "round_trip_max": 1e-12,
    "nmd": {"mean": 0.0123, "std": 0.01, "p95": 0.04, "max": 0.3},
    "top": {"faces": 10, "area": 5.0},
    "flattening": {"top": {"stop": "converged", "iterations": 7, "flips": 0}},
    "hull": {"method": "density", "reason": "closed, manifold"},
    "input": {"file": "/home/someone/secret/blocks.csv", "rows": 120},
    "warnings": ["3 points <b>repeat</b> others"],
}


class Page(HTMLParser):
    """Every tag that opens is closed, and nothing is loaded from elsewhere."""

    VOID = frozenset({"meta", "img", "link", "br", "input"})

    def __init__(self, page):
        super().__init__()
        self.open, self.images, self.words = [], [], []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attributes:
            assert name not in ("href", "srcset", "onload")
            if name == "src":
                self.images.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@needs_rendering
def test_the_page_is_whole_and_loads_nothing(tmp_path):
    path = tmp_path / "r.html"
    write_report(path, SUMMARY, SLAB, SLAB + 1.0, COLUMNS, view=SMALL)
    text = path.read_text(encoding="utf-8")
    page, words = Page(text), " ".join(Page(text).words)
    assert len(page.images) == 4  # stills of layers, neighbour distances, epsilon, shear
    assert text.count('<figure class="chart">') == 2 * 3  # epsilon and shear, thrice each
    for source in page.images:
        head, data = source.split(",", 1)
        assert head == "data:image/png;base64"
        assert base64.b64decode(data, validate=True).startswith(b"\x89PNG")
    assert not re.search(r"https?://|url\(|@import", text)
    assert "secret" not in text  # folders stay private
    assert "Unfolding of blocks.csv" in words
    assert "why this hull" in words
    for expected in ("120 blocks", "9.8.7", "hull.sigma", "0.8", "converged", "Sound", "1.23%"):
        assert expected in words
    assert "3 points <b>repeat</b> others" in words  # escaped: read as text, not as a tag


@needs_rendering
def test_a_small_share_keeps_its_digits_in_the_figures():
    page = figures_section({"volume_change": {"mean": 1.185e-05}, "nmd": {"mean": 0.123456}})
    assert "<b>0.001185%</b>change of volume, mean" in page
    assert "<b>12.35%</b>change of neighbour distances, mean" in page


def test_a_summary_without_anything_still_gives_a_page():
    page = Page(report_html({}, SLAB[:8], SLAB[:8], {}, view=SMALL))
    assert not page.images  # nothing to colour by, too few blocks for 26 neighbours
    words = " ".join(page.words)
    assert "It is not known whether the map folds over itself." in words
    assert "Unfolding of 8 blocks" in words
    assert "None." in words  # warnings


@pytest.mark.parametrize(
    ("change", "level", "said"),
    [
        ({}, "good", "proved"),
        ({"injective": False}, "bad", "not proved"),  # looked at, and at fault
        ({"injective": None}, "care", "not proved"),
        # The tetrahedra are proved, other coordinates are used between their corners.
        (
            {"injective": False, "certificate": PROVED, "coordinates": {"name": "mvc"}},
            "care",
            "not",
        ),
        ({"outside_share": 0.02}, "care", "2.00% of the blocks"),
        ({"inverted_unfolded": 1}, "bad", "folds over itself"),
        ({"inverted_folded": 5, "outside_share": 0.5}, "bad", "folds over itself"),
        ({"inverted_folded": None}, "care", "not known"),
    ],
)
def test_the_verdict_follows_the_worst_thing_known(change, level, said):
    given = verdict(SOUND | change)
    assert given.level == level
    assert said in given.headline


def test_other_coordinates_are_told_from_what_is_proved():
    facts = {"injective": False, "certificate": PROVED, "coordinates": {"name": "mvc"}}
    reasons = verdict(SOUND | facts).reasons
    assert any(r.startswith("Proved: no two places become one. All 6 cells") for r in reasons)
    assert any(r.startswith("Not proved: inside the cells") and "mvc" in r for r in reasons)


@needs_rendering
def test_elements_at_fault_are_listed_with_their_places():
    flaw = {"element": 4711, "blocks": 8, "folded": [1.5, 2.5, -3.5], "unfolded": [9.25, 8.0, 7.0]}
    certificate = {
        "injective": False,
        "crossing_folded": 2,
        "crossing_unfolded": 0,
        "blocks_in_faulty_elements": 8,
        "flaws": [flaw],
    }
    summary = SOUND | {"injective": False, "certificate": certificate}
    words = " ".join(Page(report_html(summary, SLAB[:8], SLAB[:8], {}, view=SMALL)).words)
    for expected in ("Tetrahedra at fault", "4711", "1.5, 2.5, -3.5", "9.25", "8 blocks lie in"):
        assert expected in words


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"torn": 3}, "3 blocks torn from a block that it touched"),
        ({"torn": 1}, "1 block torn"),
        (
            {"outside": {"extrapolated": 7, "largest_distance": 12.5}},
            "7 blocks marked extrapolated",
        ),
        ({"outside": {"empty": 2}}, "2 blocks without an image"),
        ({"nmd": {"mean": 0.05, "p95": 0.2, "max": 0.41}}, "(at most 41%)"),
        ({"volume_change": {"p95": 0.06}}, "weight by volume_ratio"),
        ({"flattening": {"mid": {"edge_strain": [0.02]}}}, "change by 2.0%"),
        ({"flattening": {"top": {"flips": 4, "overlaps": 1}}}, "4 flips and 1 overlaps"),
        ({"flattening": {"mid": {"stop": "max_iter"}}}, "before it converged (max_iter)"),
        ({"method": {"rung": "capped"}}, "The map reaches less far out where the fold is tighter"),
        ({"method": {"rung": "new"}}, "repaired ('new')"),
        ({"bodies": 2}, "2 bodies were unfolded one by one"),
        ({"input": {"dropped_invalid": 5}}, "5 rows of the input left out"),
        ({"certificate": {"blocks_in_faulty_elements": 8}}, "8 blocks in cells at fault"),
        (
            {"drillholes": {"samples": {"points": 9, "extrapolated": 4, "outside": 1}}},
            "Of 9 points of the drill-holes' samples, 4 lie outside",
        ),
        (
            {"drillholes": {"findings": [{"severity": "warning", "count": 6}]}},
            "6 rows of the drill-hole tables",
        ),
    ],
)
def test_the_verdict_names_what_to_distrust_and_nothing_else(change, said):
    plain = verdict(SOUND).distrust
    assert len(plain) == 1  # what no proof can tell
    certificate = {"crossing_folded": 0, "crossing_unfolded": 0} | change.get("certificate", {})
    change = change | ({"certificate": certificate} if "certificate" in change else {})
    given = verdict(SOUND | change).distrust
    assert len(given) == 2
    assert said in given[0]
    assert given[1:] == plain


def test_torn_blocks_are_no_sound_map():
    assert verdict(SOUND | {"torn": 2}).level == "care"


@needs_rendering
def test_a_cross_check_of_meshes_is_told_where_there_was_one():
    meshes = [
        {"mesh": "prism", "volume_difference": 0.0, "error": ""},
        {"mesh": "tetwild", "volume_difference": None, "error": "took longer than 600 s"},
    ]
    places = [{"mesh": "prism", "interior": "harmonic", "rms": 0.0625, "worst": [1, 2, 3]}]
    summary = SOUND | {"crosscheck": {"meshes": meshes, "places": places}}
    words = " ".join(Page(report_html(summary, SLAB[:8], SLAB[:8], {}, view=SMALL)).words)
    for expected in ("Cross-check of meshes", "took longer than 600 s", "harmonic", "0.0625"):
        assert expected in words
    without = " ".join(Page(report_html(SOUND, SLAB[:8], SLAB[:8], {}, view=SMALL)).words)
    assert "Cross-check of meshes" not in without


def test_the_verdict_says_what_the_measure_hides():
    assert any("the folded body itself scores 0" in reason for reason in verdict(SUMMARY).reasons)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (({}, SLAB, SLAB[1:], {}), "must both be"),
        (({}, SLAB, SLAB, {"shear": SLAB[:5, 0]}), r"column shear has shape \(5,\)"),
        (
            ({}, SLAB, SLAB, {"shear": SLAB[:, 0] * np.nan}),
            "column shear: 120 values are not finite",
        ),
    ],
)
def test_bad_input_is_refused_with_its_reason(arguments, message):
    with pytest.raises(InputError, match=message):
        report_html(*arguments)
