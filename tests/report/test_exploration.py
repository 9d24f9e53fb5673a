"""`unfold --grade`: exploratory data analysis in the report and the summary, and how it refuses."""

from __future__ import annotations

import base64
import html
import json
import re
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.cli.inputs.grades import exploration
from geounfold.errors import InputError, MissingDependencyError
from geounfold.estimation import Variogram, explore
from geounfold.report.exploration import exploration_html
from geounfold.report.plots.rendering import check_rendering
from geounfold.synthetic import GradeField, drill

try:
    check_rendering()
    CANNOT = ""
except MissingDependencyError as error:
    CANNOT = str(error)
needs_rendering = pytest.mark.skipif(bool(CANNOT), reason=CANNOT or "nothing is missing")

IMAGE = re.compile(r'<img alt="([^"]*)" src="data:image/svg\+xml;base64,([^"]*)">')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with blocks, the tables of holes through them, and their composites."""
    folder = tmp_path_factory.mktemp("grades")
    body = gu.simulate("slab", blocks=1000)
    field = GradeField("spherical", (100, 100, 20), mean=2.0, deviation=0.5)
    collar, survey, assay = drill(body, field, 40.0)
    body.frame(4).to_csv(folder / "blocks.csv", index=False)
    assay = assay.rename(columns={"grade": "CU"}).assign(ROCK="ore", ONE=1.0)
    assay["AU"] = np.where(np.arange(len(assay)) < 5, 1.5, np.nan)
    for name, frame in (("collar", collar), ("survey", survey), ("assay", assay)):
        frame.to_csv(folder / f"{name}.csv", index=False)
    samples = gu.read_drillholes(collar, survey, assay).samples(4.0)
    samples.to_csv(folder / "samples.csv", index=False)
    return folder


@pytest.fixture(scope="module")
def carried(folder: Path) -> tuple[Any, pd.DataFrame]:
    """Return an unfolding and samples to explore."""
    blocks = pd.read_csv(folder / "blocks.csv")
    places = blocks[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    return gu.unfold(places), pd.read_csv(folder / "samples.csv")[["x", "y", "z", "CU"]]


def holes(folder: Path) -> list[str]:
    return ["--holes", *(str(folder / f"{name}.csv") for name in ("collar", "survey", "assay"))]


def unfold(folder: Path, out: Path, *more: str) -> int:
    blocks = str(folder / "blocks.csv")
    return main(["unfold", blocks, "-o", str(out / "flat.csv"), "--quiet", *more])


@needs_rendering
def test_the_report_and_the_summary_hold_the_exploration(folder: Path, tmp_path: Path) -> None:
    report, summary = tmp_path / "r.html", tmp_path / "s.json"
    more = ("--composite", "4", "--grade", "CU", "--summary", str(summary))
    assert unfold(folder, tmp_path, *holes(folder), "--report", str(report), *more) == 0
    page = report.read_text(encoding="utf-8")
    assert "<h2>Exploratory data analysis of CU</h2>" in page
    assert "img-src data:" in page  # what the page's own policy lets it show
    figures = IMAGE.findall(page)
    # Histogram, layers, variograms, swaths and contacts, each with words for it.
    assert len(figures) == 5
    for words, data in figures:
        assert "CU" in words
        assert f"<figcaption>{words}</figcaption>" in page
        assert ElementTree.fromstring(base64.b64decode(data)).tag.endswith("svg")
    # The promise for all of a page (docs/how-to/report.md) is 12 MB; five drawings of lines take a
    # tenth at most.
    assert sum(len(data) for _, data in figures) < 1.2e6
    told = json.loads(summary.read_text(encoding="utf-8"))["exploration"]
    assert told["grade"] == "CU"
    samples = pd.read_csv(folder / "samples.csv")
    assert told["samples"]["given"] == len(samples)
    used = told["samples"]["used"]
    assert sum(told["histogram"]["count"]) == used == told["statistics"]["count"]
    assert f"{told['statistics']['min']:.4g} to {told['statistics']['max']:.4g}" in figures[0][0]
    assert set(told["models"]) == set(told["variograms"]) == {"folded", "unfolded"}
    for model in told["models"].values():
        assert f"<td>{model['structures'][0]['kind']}</td>" in page
        assert f'<td class="number">{model["misfit"]:.4g}</td>' in page
    assert set(told["swaths"]) == {"x", "y", "stratigraphic"}
    assert set(told["contacts"]) == {"bottom", "top"}


def test_tables_are_plain_numbers_and_know_no_order(carried) -> None:
    u, samples = carried
    found = explore(u, samples, grade="CU")
    told = found.summary()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["layers"]["count"] == found.layers["count"].tolist()
    there = found.contacts["top"]["mean"].notna()
    assert not there.all()  # no holes beyond the slab: slices outside it are empty
    got = [value is not None for value in told["contacts"]["top"]["mean"]]
    assert got == there.tolist()
    again = explore(u, samples.sample(frac=1.0, random_state=0), grade="CU").summary()
    assert again["models"] == told["models"]
    assert again["variograms"] == told["variograms"]


def test_a_column_s_name_is_no_tag_and_no_formula(carried) -> None:
    u, samples = carried
    name = r'<b>"Cu"</b> $\nothing$ 铜'
    found = explore(u, samples.rename(columns={"CU": name}), grade=name)
    page = exploration_html(found)
    assert page == exploration_html(found)  # drawings too, to the byte
    assert "<b>" not in page
    assert len(IMAGE.findall(page)) == 5
    words, data = IMAGE.findall(page)[0]
    assert name in html.unescape(words)
    assert "铜" in base64.b64decode(data).decode("utf-8")  # as a letter, for the reader's fonts


def test_samples_left_out_and_a_pure_nugget_are_told(carried) -> None:
    u, samples = carried
    odd = samples.copy()
    odd.loc[0, "CU"] = np.nan
    odd.loc[1, "x"] += 1e6
    found = explore(u, odd, grade="CU")
    nugget = replace(found.models["folded"], model=Variogram(1.0, ()))
    page = exploration_html(replace(found, models={**found.models, "folded": nugget}))
    assert "folded: pure nugget; unfolded: range" in page
    n = len(samples)
    assert f"{n - 2:,} of {n:,} samples are used: 1 have no value of CU or no place, 1 lie" in page


def test_too_few_in_reach_is_one_clear_error(carried) -> None:
    u, samples = carried
    far = samples.copy()
    far.loc[10:, "x"] += 1e6
    with pytest.raises(InputError, match=r"--grade CU: only 10 samples: a variogram needs .* 20"):
        exploration(Namespace(grade="CU"), u, far)
    with pytest.raises(InputError, match="--grade CU: all samples have the same value"):
        exploration(Namespace(grade="CU"), u, samples.assign(CU=1.0))


@needs_rendering
@pytest.mark.parametrize(
    ("given", "more", "said"),
    [
        ("holes", ("--grade", "CU", "--samples-out", "q.csv"), "--grade needs --report"),
        ("", ("--grade", "CU", "--report", "r.html"), "--grade needs the samples"),
        ("holes", ("--grade", "ZN", "--report", "r.html"), "assay.csv: no column 'ZN'"),
        ("holes", ("--grade", "from", "--report", "r.html"), "names a place"),
        ("holes", ("--grade", "ROCK", "--report", "r.html"), "not numeric"),
        ("holes", ("--grade", "AU", "--report", "r.html"), "only 5 of"),
        ("samples", ("--grade", "ZN", "--report", "r.html"), "samples.csv: no column 'ZN'"),
        ("samples", ("--grade", "x", "--report", "r.html"), "names a coordinate"),
        ("samples", ("--grade", "ROCK", "--report", "r.html"), "holds words, such as ore"),
    ],
)
def test_what_cannot_be_is_one_line(
    folder: Path, tmp_path: Path, monkeypatch, capsys, given: str, more, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    samples = ["--samples", str(folder / "samples.csv"), "--samples-out", "q.csv"]
    inputs = {"": [], "holes": holes(folder), "samples": samples}
    assert unfold(folder, tmp_path, *inputs[given], *more) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
