"""A body unfolded in batches of its rows: the answer of the run in memory, and clear refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import geounfold as gu
from geounfold.body import merged_blocks
from geounfold.body import streamed as streamed_body
from geounfold.cli import main
from geounfold.cli.inputs import engine
from geounfold.io.tables import large
from geounfold.io.tables.streamed import ParquetFolder, StreamedPoints
from geounfold.quality.blocks import block_quality
from geounfold.quality.by_cells import CellNumbers
from geounfold.quality.statistics import RunningStatistics, Statistics
from tests.body.test_occupancy import built

SOON = "[sheet_options]\nmerge_above = 2_000\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder as the working one, with small batches."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(large, "BATCH", 3000)
    return tmp_path


def table(**more):
    """Blocks with a text and a number."""
    folded = gu.simulate("large", blocks=22_000).folded
    frame = pd.DataFrame(folded, columns=["x", "y", "z"])
    return frame.assign(au=np.arange(len(frame)) % 7 / 2, note="a", **more)


def said(capsys):
    """The one line of an error."""
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert line.startswith("geounfold: error: ")
    return line


def test_cells_have_numbers_in_their_order():
    cells = np.unique(np.random.default_rng(2).integers(-9, 60, (3000, 3)), axis=0)
    assert (CellNumbers(built(cells)).of(cells) == np.arange(len(cells))).all()


def test_statistics_of_batches_are_those_of_all():
    values = np.random.default_rng(5).gamma(2.0, 0.05, 30_000)
    found = RunningStatistics()
    for part in np.split(values, 10):
        found.add(np.append(part, np.nan))
    expected = Statistics.of(values)
    assert found.count == len(values)
    for name in ("mean", "std", "max"):
        assert getattr(found.made(), name) == pytest.approx(getattr(expected, name), rel=1e-12)
    assert found.made().p95 == pytest.approx(expected.p95, rel=1e-3)  # classes of 0.1 %
    counts = np.array([4, 0, 3, 9])
    weighted = Statistics.weighted(np.array([2.0, 99.0, 5.0, 1.0]), counts)
    all_of_them = Statistics.of(np.repeat([2.0, 99.0, 5.0, 1.0], counts))
    assert weighted.mean == pytest.approx(all_of_them.mean)
    assert weighted.std == pytest.approx(all_of_them.std)
    assert weighted.p95 == weighted.max == 5.0


def test_a_folder_is_one_table_and_its_sample_is_of_all_of_it(here):
    frame = pd.DataFrame(np.arange(600.0).reshape(200, 3), columns=["x", "y", "z"])
    Path("in").mkdir()
    frame[:150].to_parquet("in/a.parquet", row_group_size=40, index=False)
    frame[150:].to_parquet("in/b.parquet", index=False)
    points = StreamedPoints("in")
    np.testing.assert_array_equal(np.concatenate(list(points.batches())), frame.to_numpy())
    assert {0.0, 597.0} <= set(points.sample()[:, 0])
    assert len(points.table(0)) == 200
    assert ParquetFolder(Path("in")).files == 2


WRONG = (
    (["b.csv", "--engine", "batches"], ("--engine batches reads a Parquet file", "'b.csv'")),
    (["folder", "--engine", "memory"], ("folder is a folder", "leave the option")),
    (["b.parquet", "--engine", "batches", "--where", "x>0"], ("go without --where",)),
    (["b.parquet", "--engine", "batches", "--method", "ufo"], ("method ufo",)),
    (["b.parquet", "--engine", "batches", "-o", "o.vtp"], ("OUT must end in", "o.vtp")),
    (["folder", "-o", "folder/a.parquet", "--overwrite"], ("--output is also an input",)),
    (["mixed"], ("other columns than",)),
    (["texts"], ("a.csv: is no Parquet file",)),
)


@pytest.mark.parametrize(("words", "told"), WRONG, ids=lambda v: " ".join(map(str, v)))
def test_what_does_not_go_with_batches_is_told(here, capsys, words, told):
    frame = pd.DataFrame(np.eye(3), columns=["x", "y", "z"])
    frame.to_csv("b.csv", index=False)
    frame.to_parquet("b.parquet", index=False)
    for name, parts in {"folder": "ab", "mixed": "ab", "texts": "a"}.items():
        Path(name).mkdir()
        for part in parts:
            frame.to_parquet(f"{name}/{part}.parquet", index=False)
    frame.rename(columns={"z": "w"}).to_parquet("mixed/b.parquet", index=False)
    Path("texts/a.parquet").rename("texts/a.csv")
    out = [] if "-o" in words else ["-o", "o.parquet"]
    assert main(["unfold", *words, *out]) == 2
    line = said(capsys)
    assert all(word in line for word in told), line


def test_a_row_without_a_place_is_told_or_left_out(here, capsys):
    frame = table()
    frame.loc[4321, "y"] = np.nan
    frame.to_parquet("b.parquet", index=False)
    words = ["unfold", "b.parquet", "-o", "o.parquet", "--engine", "batches"]
    assert main(words) == 2
    assert "data row 4322 has a missing or infinite coordinate" in said(capsys)
    points = StreamedPoints("b.parquet", drop_invalid=True)
    assert sum(map(len, points.batches())) == len(frame) - 1
    assert points.table(0).dropped.tolist() == [4322]


@pytest.mark.slow
def test_the_answer_is_that_of_the_run_in_memory(here, capsys, monkeypatch):
    """Files in any order of rows, a folder, samples, sides: to 1e-9 of what memory gives."""
    monkeypatch.setattr(merged_blocks, "LEAST_SURFACE", 1000.0)
    monkeypatch.setattr(streamed_body, "HELD", 0)
    Path("c.toml").write_text(SOON)
    rock = np.where(np.arange(len(table())) % 3, "ore", "")
    frame = table(dx=9.0, dy=9.0, dz=9.0, rock=rock).sample(
        frac=1, random_state=1, ignore_index=True
    )
    frame.to_parquet("b.parquet", index=False, row_group_size=5000)
    frame[::50].to_csv("s.csv", index=False)
    Path("in").mkdir()
    frame[:9000].to_parquet("in/a.parquet", index=False)
    frame[9000:].to_parquet("in/b.parquet", index=False, row_group_size=2000)
    more = ["--config", "c.toml", "--samples", "s.csv", "--samples-out", "q.csv", "--overwrite"]
    words = ["unfold", "b.parquet", "-o", "m.parquet", "--summary", "m.json", *more]
    assert main(words) == 0
    expected, facts = pd.read_parquet("m.parquet"), json.loads(Path("m.json").read_text())
    assert facts["method"]["merged"] > 1
    capsys.readouterr()
    monkeypatch.setattr(engine, "BATCHES_FROM", 1000)
    for source in ("b.parquet", "in"):
        words = ["unfold", source, "-o", "o.parquet", "--summary", "o.json", "--map", "o.npz"]
        assert main([*words, *more]) == 0
        assert "are unfolded in batches" in capsys.readouterr().err
        found, own = pd.read_parquet("o.parquet"), json.loads(Path("o.json").read_text())
        # The rows lie on their lattice to rounding; epsilon is kept in single precision.
        pd.testing.assert_frame_equal(found, expected, rtol=1e-7, atol=1e-7, check_dtype=True)
        assert own["streamed"]
        assert [w.removeprefix(f"{source}: ") for w in own["warnings"]] == [
            w.removeprefix("b.parquet: ") for w in facts["warnings"]
        ]
        for name in ("points", "injective", "outside_share", "torn", "lattice"):
            assert own[name] == facts[name], name
        assert [r["blocks"] for r in own["trust"]["reasons"]] == [
            r["blocks"] for r in facts["trust"]["reasons"]
        ]
        assert own["body_volume"] == pytest.approx(facts["body_volume"])
        assert own["block_volumes"] == pytest.approx(facts["block_volumes"])
        for name in ("nmd", "shear", "volume_change"):  # p95 in classes of 0.1 %
            assert own[name] == pytest.approx(facts[name], rel=2e-3), name
        assert own["flat_size"] == pytest.approx(facts["flat_size"])
        assert own["round_trip_max"] < 1e-9
        carried = gu.load("o.npz").carry(frame[["x", "y", "z"]].to_numpy())
        np.testing.assert_array_equal(carried.points[:, 2], found["unfolded_z"])


def test_a_damaged_file_is_told(here, capsys):
    table().to_parquet("b.parquet", index=False)
    content = bytearray(Path("b.parquet").read_bytes())
    content[1000:3000] = bytes(2000)
    Path("b.parquet").write_bytes(content)
    assert main(["unfold", "b.parquet", "-o", "o.parquet", "--engine", "batches"]) == 2
    assert "b.parquet: is no Parquet file, or a damaged one" in said(capsys)
    assert not Path("o.parquet").exists()


@pytest.mark.slow
def test_few_blocks_are_fitted_one_by_one(here):
    frame = table()
    frame.to_parquet("b.parquet", index=False)
    assert main(["unfold", "b.parquet", "-o", "o.parquet", "--engine", "batches"]) == 0
    assert main(["unfold", "b.parquet", "-o", "m.parquet"]) == 0
    found, expected = pd.read_parquet("o.parquet"), pd.read_parquet("m.parquet")
    pd.testing.assert_frame_equal(found, expected, rtol=1e-7, atol=1e-7)  # single precision


@pytest.mark.slow
def test_more_blocks_are_fitted_as_cells_of_two_a_side(here, monkeypatch):
    """Every row is carried and proved, and lies within half a block of the truth."""
    monkeypatch.setattr(streamed_body, "HELD", 0)
    monkeypatch.setattr(streamed_body, "MOST_FITTED", 400_000)
    body = gu.simulate("large", steps=(7.5, 7.5, 7.5))
    body.frame().to_parquet("b.parquet", index=False)
    words = ["unfold", "b.parquet", "--engine", "batches"]
    assert main([*words, "-o", "o.parquet", "--summary", "s.json"]) == 0
    facts = json.loads(Path("s.json").read_text())
    assert facts["injective"]
    assert facts["outside"]["empty"] == 0
    assert facts["outside_share"] < 1e-4
    found = pd.read_parquet("o.parquet")[["unfolded_x", "unfolded_y", "unfolded_z"]].to_numpy()
    # Ten million blocks fitted so come out 0.35 blocks from the truth, fitted one by one 0.17.
    assert gu.aligned_rms(found, body.truth) < 0.5 * 7.5


@pytest.mark.slow
def test_a_body_that_needs_its_rows_is_unfolded_in_memory_and_that_is_told(
    here, capsys, monkeypatch
):
    """Two bodies; without --body the run in memory names them."""
    frame = table()
    pd.concat([frame, frame.assign(z=frame["z"] + 5000)]).to_parquet("b.parquet", index=False)
    words = ["unfold", "b.parquet", "-o", "o.parquet"]
    assert main([*words, "--engine", "batches"]) == 2
    assert "2 separate bodies; --engine memory" in said(capsys)
    monkeypatch.setattr(engine, "BATCHES_FROM", 1000)
    assert main(words) == 2
    told = capsys.readouterr().err
    assert "unfolded in memory instead, because its blocks form 2 separate bodies" in told
    assert "choose one with --body" in told


@pytest.mark.slow
def test_neighbours_are_counted_slab_by_slab(monkeypatch):
    """Slabs of some layers give the epsilon of all blocks at once."""
    from geounfold.body.streamed import prepare_streamed
    from geounfold.quality import by_cells

    folded = gu.simulate("large", blocks=22_000).folded
    u = gu.unfold(folded)
    monkeypatch.setattr(by_cells, "_SLAB", 1500)
    body = prepare_streamed(lambda: [folded], folded, parts=False)
    found = by_cells.measure_cells(body.given, body.frame, u.map, 26)
    cells = body.cells_of(folded)
    steps = u.frame.steps
    carried = u.map.carry(folded)
    whole = block_quality(
        u.map.whole, carried.element, folded, carried.points, 26, None, (cells, steps)
    )
    error = found.error[CellNumbers(body.given).of(cells)]
    np.testing.assert_allclose(error, whole.nmd_error, rtol=1e-6, atol=1e-7)  # single precision
    assert found.held.sum() == len(folded)
    assert not len(found.torn)
    assert not len(found.empty)
