"""A fitted map on a Dask cluster: the same answer, each row once, whatever becomes of workers."""

from __future__ import annotations

import os
import pickle
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import InputError, MissingDependencyError, OutputError
from geounfold.io.outputs import whole_folder
from geounfold.io.tables import parts as parts_module
from geounfold.io.tables.parts import parts_of

dd = pytest.importorskip("dask.dataframe", reason="dask (extra dask) is not installed")
distributed = pytest.importorskip("distributed", reason="distributed is not installed")
psutil = pytest.importorskip("psutil")  # which distributed needs


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """An unfolding, its map's file, and points in and around the body."""
    body = gu.simulate("plunging", width=150.0)
    u = gu.unfold(body.folded)
    path = tmp_path_factory.mktemp("map") / "m.npz"
    u.save(path)
    points = np.concatenate([body.folded, body.folded[::9] + 12.0])
    frame = pd.DataFrame(points, columns=["x", "y", "z"]).assign(
        rock=lambda t: [f"r{k % 3}, a" for k in range(len(t))], number=np.arange(len(points))
    )
    return u, path, frame


def _cluster(**settings):
    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50, **settings
    )


def test_a_map_travels_as_plain_arrays(fitted):
    u, _, frame = fitted
    P = frame[["x", "y", "z"]].to_numpy()
    u.map.carry(P)  # which makes tables that must not travel
    content = pickle.dumps(u.map)
    assert len(content) < 1.5 * sum(a.nbytes for a in u.map._arrays().values())
    again = pickle.loads(content)
    for name in ("points", "element", "distance"):
        expected = getattr(u.map.carry(P), name)
        np.testing.assert_array_equal(getattr(again.carry(P), name), expected)


def test_partitions_are_carried_where_they_are(fitted):
    u, path, frame = fitted
    expected = u.transform(frame)
    for carried in (
        u.map_partitions(dd.from_pandas(frame, npartitions=5)),
        gu.map_partitions(gu.load(path), dd.from_pandas(frame, npartitions=5)),
    ):
        assert carried.npartitions == 5
        got = carried.compute(scheduler="threads")
        assert list(carried._meta.columns) == list(got.columns)
        pd.testing.assert_frame_equal(got, expected, check_exact=True, check_dtype=False)
    there = dd.from_pandas(expected[expected["location"] != "outside"], npartitions=3)
    back = gu.map_partitions(u.map, there, inverse=True).compute(scheduler="threads")
    # The round trip, in coordinates of some 1e6 m.
    assert np.abs(back["folded_x"] - back["x"]).max() < 1e-6


def test_partitions_without_coordinates_are_an_error(fitted):
    u, _, frame = fitted
    with pytest.raises(InputError, match="no coordinate columns"):
        u.map_partitions(dd.from_pandas(frame[["rock", "number"]], npartitions=2))


def read(folder: Path) -> pd.DataFrame:
    """The parts of a folder, one below the other."""
    how = pd.read_parquet if folder.suffix == ".parquet" else pd.read_csv
    return pd.concat([how(part) for part in sorted(folder.iterdir())], ignore_index=True)


def test_files_on_a_given_cluster_come_out_as_without_one(fitted, tmp_path, monkeypatch, capsys):
    u, path, frame = fitted
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(parts_module, "BYTES", 1 << 15)
    monkeypatch.setattr(parts_module, "BATCH", 1000)
    Path("in").mkdir()
    half = len(frame) // 2
    frame[:half].to_parquet("in/a.parquet", index=False, row_group_size=500)
    frame[half:].to_parquet("in/b.parquet", index=False, row_group_size=700)
    frame.to_csv("in.csv", index=False)
    own = gu.ModelFrame.turned((100.0, -50.0, 7.0), bearing=30.0).to_own(frame[["x", "y", "z"]])
    frame.assign(x=own[:, 0], y=own[:, 1], z=own[:, 2]).to_csv("own.csv", index=False)
    expected = u.transform(frame)
    with _cluster() as cluster:
        common = ["--engine", "dask", "--scheduler", cluster.scheduler_address]
        assert main(["map", str(path), "in", "-o", "out.parquet", *common]) == 0
        assert main(["map", str(path), "in.csv", "-o", "out.csv", *common]) == 0
        assert main(["map", str(path), "in.csv", "-o", "typed.parquet", *common]) == 0
        turned = ["--origin", "100,-50,7", "--rotation", "30,0,0"]
        assert main(["map", str(path), "own.csv", "-o", "own.parquet", *turned, *common]) == 0
        words = ["map", str(path), "out.parquet", "-o", "back.parquet", "--inverse"]
        named = ["--columns", "unfolded_x,unfolded_y,unfolded_z"]
        assert main([*words, *named, *common]) == 0
        Path("gap.csv").write_text("x,y,z\n1,2,3\n4,5,6\n7,,9\n")  # the error is a worker's
        assert main(["map", str(path), "gap.csv", "-o", "gap_out.csv", *common]) == 2
        assert "data row 3 has a missing" in capsys.readouterr().err
        assert not Path("gap_out.csv").exists()
        assert main(["map", str(path), "in.csv", "-o", "out.csv", *common]) == 2  # is there
        assert main(["map", str(path), "in.csv", "-o", "out.csv", "--overwrite", *common]) == 0
    for name in ("out.parquet", "out.csv", "typed.parquet"):
        assert len(list(Path(name).iterdir())) > 3
        pd.testing.assert_frame_equal(
            read(Path(name)), expected, check_exact=True, check_dtype=False
        )
    placed = read(Path("own.parquet"))
    for names in (["unfolded_x", "unfolded_y", "unfolded_z"], ["world_x", "world_y", "world_z"]):
        given = expected[[n.replace("world_", "") for n in names]]
        # Turned there and back, in coordinates of some 1e6 m.
        np.testing.assert_allclose(placed[names], given, rtol=0, atol=1e-6)
    back = read(Path("back.parquet"))[["folded_x", "folded_y", "folded_z"]].to_numpy()
    assert np.abs(back - u.to_folded(u.to_flat(frame[["x", "y", "z"]].to_numpy()))).max() == 0
    assert not [p.name for p in tmp_path.iterdir() if p.name.startswith(".")]


@pytest.mark.slow
def test_a_worker_killed_midway_loses_nothing_and_doubles_nothing(fitted, tmp_path):
    from geounfold.unfolding.dask_map import Carrying, carry_parts

    u, _, frame = fitted
    many = pd.concat([frame] * 120, ignore_index=True).assign(number=lambda t: np.arange(len(t)))
    many.to_parquet(tmp_path / "in.parquet", index=False, row_group_size=20_000)
    file = pq.ParquetFile(tmp_path / "in.parquet")
    names = tuple(many.columns)
    parts = [
        parts_module.Part(str(tmp_path / "in.parquet"), names, k, k + 1, 20_000 * k)
        for k in range(file.num_row_groups)
    ]
    out = tmp_path / "out.parquet"
    out.mkdir()
    how = Carrying(None, False, False, ".parquet")
    with _cluster() as cluster, distributed.Client(cluster) as client:
        pids = client.run(os.getpid)
        result: dict[str, int] = {}
        run = threading.Thread(
            target=lambda: result.update(carry_parts(client, u.map, parts, out, how))
        )
        run.start()
        deadline = time.monotonic() + 60
        while len(list(out.glob("part-*"))) < 3 and time.monotonic() < deadline:
            time.sleep(0.005)
        psutil.Process(next(iter(pids.values()))).kill()
        done = len(list(out.glob("part-*")))
        run.join(timeout=120)
    assert 3 <= done < len(parts)  # midway
    assert result["carried"] == len(many)
    got = read(out)
    assert np.array_equal(got["number"], np.arange(len(many)))  # each row once, in order
    expected = u.transform(many)
    pd.testing.assert_frame_equal(got, expected, check_exact=True, check_dtype=False)
    assert not list(out.glob(".*"))


def test_without_dask_one_line_says_what_to_install(fitted, tmp_path, monkeypatch, capsys):
    u, path, frame = fitted
    frame.to_csv(tmp_path / "in.csv", index=False)
    for name in ("dask", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingDependencyError, match=r"geounfold\[dask\]"):
        u.map_partitions(frame)
    words = ["map", str(path), str(tmp_path / "in.csv"), "-o", str(tmp_path / "o.csv")]
    assert main([*words, "--engine", "dask"]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert "geounfold[dask]" in said[0]
    assert not (tmp_path / "o.csv").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["in.csv", "-o", "o.vtp", "--engine", "dask"], "ends in .csv or .parquet"),
        (["in.csv", "-o", "o.csv", "--scheduler", "tcp://h:1"], "needs --engine dask"),
        (["in.csv", "-o", "in.csv", "--engine", "dask"], "also an input"),
        (["in.csv", "-o", "held", "--engine", "dask"], "ends in .csv or .parquet"),
        (["in.csv", "-o", "file.csv", "--engine", "dask"], "is not a folder"),
        (["absent.csv", "-o", "o.csv", "--engine", "dask"], "no such file"),
        (["in.vtp", "-o", "o.csv", "--engine", "dask"], "cannot be read in parts"),
        (["empty", "-o", "o.csv", "--engine", "dask"], "must hold .parquet or .csv"),
        (["mixed", "-o", "o.csv", "--engine", "dask"], "other columns"),
        (["in.csv", "-o", "o.csv", "--columns", "p,q,r", "--engine", "dask"], "no column 'p'"),
        (
            ["in.csv", "-o", "o.csv", "--engine", "dask", "--scheduler", "tcp://127.0.0.1:9"],
            "no Dask scheduler answers",
        ),
    ],
)
def test_bad_input_is_one_line_and_status_2(fitted, tmp_path, monkeypatch, capsys, words, said):
    _, path, _ = fitted
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("geounfold.unfolding.dask_map._WAIT", 1)
    Path("in.csv").write_text("x,y,z\n1,2,3\n4,5,6\n")
    Path("in.vtp").write_text("x")
    Path("file.csv").write_text("x")
    Path("empty").mkdir()
    Path("mixed").mkdir()
    Path("mixed/a.csv").write_text("x,y,z\n1,2,3\n")
    Path("mixed/b.csv").write_text("x,y,w\n1,2,3\n")
    before = sorted(p.name for p in tmp_path.iterdir())
    assert main(["map", str(path), *words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert said in lines[-1]
    assert sum(line.startswith("geounfold: error") for line in lines) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_parts_of_a_csv_keep_rows_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(parts_module, "BYTES", 50)
    monkeypatch.setattr(parts_module, "_READ", 37)
    path = tmp_path / "a.csv"
    rows = [f'{k},{k / 7!r},"a ""quoted"",\nline {k}",0' for k in range(60)]
    path.write_bytes(("\ufeff\n\n" + "x,y,note,z\n" + "\n".join(rows)).encode())
    parts = parts_of(path)
    assert len(parts) > 10
    whole = pd.concat([part.frame() for part in parts], ignore_index=True)
    from geounfold.io import read_table

    pd.testing.assert_frame_equal(whole, read_table(path).frame, check_column_type=False)
    counted = np.cumsum([0, *(len(part.frame()) for part in parts)])
    assert [part.row for part in parts] == counted[:-1].tolist()


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    target = tmp_path / "out.csv"
    with whole_folder(target) as folder:
        (folder / "a").write_text("1")
    with pytest.raises(OutputError, match="--overwrite"), whole_folder(target):
        pass
    with pytest.raises(OutputError), whole_folder(target, overwrite=True) as folder:
        (folder / "no such folder" / "a").write_text("2")
    assert (target / "a").read_text() == "1"
    with whole_folder(target, overwrite=True) as folder:
        (folder / "b").write_text("3")
    assert [p.name for p in target.iterdir()] == ["b"]
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]
