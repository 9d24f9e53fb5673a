"""Bodies with waste lenses, holes and bridges: right and told; crude shells: refused at once."""

import json

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import HullError, NoSheetError
from geounfold.geometry.measures import unique_edges
from tests.places import shared


def layer(pierced=True):
    """Return a bent layer of blocks of 5, with three lenses of waste and a hole or without."""
    i, j, k = np.meshgrid(np.arange(60), np.arange(40), np.arange(30), indexing="ij")
    height = k - 15 - 5 * np.sin(i / 60 * np.pi * 2)
    full = np.abs(height) <= 5
    for a, b in ((12, 10), (30, 25), (45, 14)) if pierced else ():
        full &= ~((np.hypot(i - a, j - b) < 5) & (np.abs(height) < 1.6))
    if pierced:
        full &= ~((np.abs(i - 20) < 1.5) & (np.abs(j - 30) < 1.5))
    return np.argwhere(full) * 5.0


@pytest.fixture(scope="module")
def unfolded():
    return gu.unfold(layer())


def test_waste_makes_no_difference(unfolded):
    assert unfolded.certificate.injective
    whole = gu.unfold(layer(pierced=False))
    row = {tuple(p): k for k, p in enumerate(whole.folded)}
    same = whole.stratigraphic[[row[tuple(p)] for p in unfolded.folded]]
    # The blocks lie where they lie in the layer without waste, to a few tenths of one of its
    # eleven blocks; measured 0.035 at most.
    assert np.abs(unfolded.stratigraphic - same).max() < 0.05


def test_hull_of_a_mended_body_is_a_sphere(unfolded):
    mesh = unfolded.hull.mesh
    assert len(mesh.V) - len(unique_edges(mesh.F)) + len(mesh.F) == 2


def test_summary_and_warning_tell_what_was_mended(unfolded):
    mended = unfolded.summary()["mended"]
    assert mended["filled"] > 300
    assert (mended["handles_closed"], mended["handles_left"]) == (1, 0)
    assert sum(place["cells"] for place in mended["places"]) == mended["filled"]
    told = [w for w in unfolded.summary()["warnings"] if "filled for the hull" in w]
    assert len(told) == 1
    assert told[0].startswith(f"{mended['filled']} cells inside the body")
    assert set(unfolded.mended) == {""}


def test_column_on_request(tmp_path):
    spike = np.array([[150.0, 100.0, z] for z in range(75, 90, 5)])
    table = pd.DataFrame(np.concatenate([layer(), spike]), columns=["x", "y", "z"])
    table.drop_duplicates().to_csv(tmp_path / "p.csv", index=False)
    argv = ["unfold", str(tmp_path / "p.csv"), "-o", str(tmp_path / "o.csv"), "--quiet"]
    argv += ["--mended-column", "--summary", str(tmp_path / "s.json")]
    assert main(argv) == 0
    out = pd.read_csv(tmp_path / "o.csv", keep_default_na=False)
    summary = json.loads((tmp_path / "s.json").read_text())
    assert (out.mended == "cut").sum() == summary["mended"]["cut"]
    assert summary["mended"]["filled"] > 0


@pytest.mark.parametrize(
    ("name", "error"),
    # Measured 0.0325 and 0.0104; both were refused as closing on themselves.
    [("false_tube_fold", 0.035), ("waste_lenses", 0.012)],
)
def test_field_bodies_that_were_refused_wrongly(name, error):
    table = pd.read_csv(shared("field", "bodies", name, "blocks.csv.gz"))
    u = gu.unfold(table)
    assert u.certificate.injective
    assert np.abs(u.stratigraphic - table.strat).mean() < error


def test_crude_indicator_is_refused_in_one_sentence():
    table = pd.read_csv(shared("field", "bodies", "crude_indicator", "blocks.csv.gz"))
    with pytest.raises(NoSheetError, match=r"^crude shell: \d+ handles left .* loose bits$") as e:
        gu.unfold(table)
    assert e.value.exit_status == 2


def test_errors_of_a_crude_body_name_what_was_mended(monkeypatch):
    def fails(*_):
        raise HullError("no hull is suitable")

    monkeypatch.setattr("geounfold.unfolding.fit_body._fit_at", fails)
    with pytest.raises(HullError, match=r"^no hull is suitable"):
        gu.unfold(layer())
    monkeypatch.setattr("geounfold.body.mending.record.CRUDE", 0)
    with pytest.raises(NoSheetError, match=r"crude shell: 0 handles .*fails: no hull is suitable"):
        gu.unfold(layer())
