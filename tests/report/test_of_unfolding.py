"""The report from the library, of estimates, and the columns that `view` lists."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import MissingDependencyError
from geounfold.report.plots.rendering import check_rendering


@pytest.fixture(scope="module")
def unfolded() -> Any:
    try:
        check_rendering()
    except MissingDependencyError as error:
        pytest.skip(str(error))
    return gu.unfold(gu.simulate("sim_case_1", blocks=2000).frame())


def test_an_unfolding_reports_itself(unfolded: Any, tmp_path: Path) -> None:
    samples = pd.DataFrame(unfolded.folded[:40], columns=["x", "y", "z"]).assign(hole="A", cu=1.0)
    unfolded.report(tmp_path / "one.html", samples=samples, unit="ft")
    gu.report(unfolded, tmp_path / "two.html", samples=samples, unit="ft")  # type: ignore[operator]
    one, two = ((tmp_path / f"{name}.html").read_text() for name in ("one", "two"))
    assert '"unit":"ft"' in one.replace(" ", "")
    assert one.index('id="viewer"') < one.index('class="verdict')  # pictures first, then text
    assert '"horizons":{"top"' in one.replace(" ", "")
    assert len(one) == pytest.approx(len(two), rel=0.01)  # but for the seconds


def test_reports_are_not_replaced_and_end_in_html(unfolded: Any, tmp_path: Path) -> None:
    (tmp_path / "r.html").write_text("mine")
    with pytest.raises(gu.OptionError, match="exists; give overwrite=True"):
        unfolded.report(tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text() == "mine"
    with pytest.raises(gu.OptionError, match="ends in"):
        unfolded.report(tmp_path / "r.pdf")


def test_estimates_have_a_report(
    unfolded: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("gstlearn")
    monkeypatch.chdir(tmp_path)
    unfolded.save("m.npz")
    unfolded.table.iloc[:, :3].to_csv("b.csv", index=False)
    samples = unfolded.table.iloc[::20, :3].assign(cu=np.arange(98.0), hole="DH1")
    samples.to_csv("s.csv", index=False)
    words = "estimate m.npz s.csv b.csv --grade cu -o e.csv --method inverse_distance"
    assert main([*words.split(), "--report", "e.html"]) == 0
    page = Path("e.html").read_text()
    assert "<h1>cu estimated on b.csv</h1>" in page
    assert '"start":"cu_estimate"' in page.replace(" ", "")
    assert "DH1" in page
    assert "not known whether the map" not in page


def test_view_lists_columns_of_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    table = pd.DataFrame(np.eye(3), columns=["x", "y", "z"]).assign(shear=1.0, rock="ore")
    table.to_csv("p.csv", index=False)
    assert main(["view", "p.csv", "--colour"]) == 0
    assert capsys.readouterr().out.split() == ["x", "y", "z", "shear"]
    assert main(["view", "p.csv", "-o", "p.png", "--colour", "shaer"]) == 2
    said = capsys.readouterr().err
    assert "no column 'shaer' (did you mean 'shear'?); columns of numbers: x, y, z, shear" in said
    assert main(["view", "p.csv"]) == 2
    assert "view needs -o PICTURE, or --colour alone" in capsys.readouterr().err
