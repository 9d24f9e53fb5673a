"""Large tables in batches: what comes out is what comes out of reading them whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import InputError
from geounfold.io import read_points
from geounfold.io.tables import large
from geounfold.io.tables.large import PointStream, open_points
from geounfold.io.tables.points import PointTable

ROWS = 950  # in batches of 100: nine whole ones and a half


@pytest.fixture(autouse=True)
def _small_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large, "BATCH", 100)
    monkeypatch.setattr(large, "LARGE", 0)


def made(_: pd.DataFrame, points: np.ndarray, __: slice) -> dict[str, object]:
    """Results that depend on the points alone; one replaces a column of the input."""
    return {"flat": points.sum(axis=1), "note": np.where(points[:, 0] > 0, "a", "b,c")}


def text_file(path: Path) -> Path:
    """A CSV whose columns show their types late: blanks, zeros, quotes and long numbers."""
    rng = np.random.default_rng(0)
    lines = ['\ufeffid,x,"y",z,code,late,long,blank,note']
    for row in range(ROWS):
        x, y, z = (rng.normal(size=3) * 1e3).tolist()
        late = "" if row < 300 else ("7" if row < 700 else "7.25")
        long = "123456789012345678" if row < 200 else "1.5"
        quoted = '"a, ""b"""' if row % 7 == 0 else "plain"
        lines.append(f"{row},{x!r},{y!r},{z:.3f},00{row % 9},{late},{long},,{quoted}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def typed_file(path: Path) -> Path:
    rng = np.random.default_rng(0)
    columns = {
        "x": rng.normal(size=ROWS),
        "y": rng.normal(size=ROWS).astype(np.float32),
        "z": pa.array(np.arange(ROWS), pa.int32()),
        "flag": pa.array([None if k % 3 == 0 else k % 2 == 0 for k in range(ROWS)]),
        "rock": pa.array([f"r{k % 4}" for k in range(ROWS)]).dictionary_encode(),
        "when": pa.array(range(ROWS), pa.timestamp("us", "UTC")),
        "parts": pa.array([[k, k + 1] for k in range(ROWS)]),
        "big": pa.array([2**63 + k for k in range(ROWS)], pa.uint64()),
        "note": pa.array(["old"] * ROWS),
    }
    pq.write_table(pa.table(columns), path, row_group_size=333)
    return path


def both(path: Path, out: str, **how: object) -> tuple[Path, Path]:
    """Write the file's points with results in batches and whole; return where."""
    stream = open_points(path, **how)
    assert isinstance(stream, PointStream)
    how.pop("keep", None)
    table = read_points(path, **how)
    paths = path.with_name(f"streamed{out}"), path.with_name(f"whole{out}")
    stream.write_parts(paths[0], made)
    table.write_parts(paths[1], made)
    assert len(stream) == len(table)
    assert stream.columns == table.columns
    assert np.array_equal(stream.dropped, table.dropped)
    if stream.kept is not None:
        assert np.array_equal(stream.points, table.points)
        assert stream.facts() == table.facts()
    return paths


@pytest.mark.parametrize("name", ["in.csv", "in.csv.gz"])
@pytest.mark.parametrize("out", [".csv", ".csv.gz", ".parquet"])
@pytest.mark.parametrize("keep", [True, False])
def test_text_comes_out_as_from_a_table_read_whole(tmp_path, name, out, keep):
    path = text_file(tmp_path / "in.csv")
    if name.endswith(".gz"):
        packed = pd.io.common.get_handle(tmp_path / name, "wb", compression="gzip", is_text=False)
        with packed as handle:
            handle.handle.write(path.read_bytes())
    a, b = both(tmp_path / name, out, keep=keep)
    if out == ".csv":
        assert a.read_bytes() == b.read_bytes()
    elif out == ".csv.gz":
        assert pd.read_csv(a, dtype=str).equals(pd.read_csv(b, dtype=str))
    else:
        one, two = pq.read_table(a), pq.read_table(b)
        assert one.schema.equals(two.schema)
        assert one.equals(two)
        # By hand: late is blank, then whole, then not; a long number beside 1.5 stays text.
        kinds = {name: str(one.schema.field(name).type) for name in ("id", "code", "late", "long")}
        assert kinds["id"] == "int64"
        assert kinds["late"] == "double"
        assert "string" in kinds["code"]
        assert "string" in kinds["long"]


@pytest.mark.parametrize("out", [".csv", ".parquet"])
def test_typed_columns_come_out_bit_for_bit(tmp_path, out):
    path = typed_file(tmp_path / "in.parquet")
    a, b = both(path, out)
    if out == ".csv":
        assert a.read_bytes() == b.read_bytes()
        return
    one = pq.read_table(a)
    assert one.equals(pq.read_table(b))
    given = pq.read_table(path)
    for name in ("x", "y", "z", "flag", "when", "parts", "big"):
        assert one[name].type == given[name].type
        assert one[name].combine_chunks().equals(given[name].combine_chunks())
    assert one["rock"].to_pylist() == given["rock"].to_pylist()


@pytest.mark.parametrize("keep", [True, False])
def test_rows_without_coordinates_are_dropped_in_every_batch(tmp_path, keep):
    path = text_file(tmp_path / "in.csv")
    lines = path.read_text(encoding="utf-8").split("\n")
    for row in [1, 150, *range(201, 301), 950]:  # one batch whole
        fields = lines[row].split(",")
        fields[2] = ""
        lines[row] = ",".join(fields)
    path.write_text("\n".join(lines), encoding="utf-8")
    a, b = both(path, ".csv", drop_invalid=True, keep=keep)
    assert a.read_bytes() == b.read_bytes()
    assert len(a.read_text().splitlines()) == ROWS - 103 + 1


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (640, "640,abc,1,2,,,,,"),  # no number
        (777, "777,,1,2,,,,,"),  # none
        (30, "30,1e300,1,2,,,,,"),  # too large
        (333, "1,2,3,4,5,6,7,8,9,10,11"),  # too many values
    ],
)
def test_what_is_wrong_late_in_a_file_is_said_as_by_reading_it_whole(tmp_path, row, text):
    path = text_file(tmp_path / "in.csv")
    lines = path.read_text(encoding="utf-8").split("\n")
    lines[row] = text
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError) as whole:
        read_points(path)
    with pytest.raises(InputError) as streamed:
        open_points(path)
    assert str(streamed.value) == str(whole.value)


def test_small_files_and_other_formats_are_read_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(large, "LARGE", 1 << 24)
    assert isinstance(open_points(text_file(tmp_path / "in.csv")), PointTable)
    twice = pa.Table.from_arrays([pa.array(np.arange(500.0))] * 4, names=["x", "y", "z", "z2"])
    pq.write_table(twice.rename_columns(["x", "y", "z", "x"]), tmp_path / "twice.parquet")
    with pytest.raises(InputError, match="ambiguous"):
        open_points(tmp_path / "twice.parquet")
    with pytest.raises(InputError, match="no such file"):
        open_points(tmp_path / "absent.parquet")
    (tmp_path / "cut.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match="not a Parquet table"):
        open_points(tmp_path / "cut.parquet")


def test_a_file_that_changes_meanwhile_is_an_error(tmp_path):
    path = text_file(tmp_path / "in.csv")
    kept, counted = open_points(path), open_points(path, keep=False)
    lines = path.read_text(encoding="utf-8").split("\n")
    path.write_text("\n".join(lines[:500] + lines[501:]), encoding="utf-8")
    for stream in (kept, counted):
        with pytest.raises(InputError, match="changed"):
            stream.write_parts(tmp_path / "out.csv", made)


def test_results_never_replace_the_coordinates_read(tmp_path):
    stream = open_points(text_file(tmp_path / "in.csv"))
    with pytest.raises(InputError, match="would replace the coordinates"):
        stream.write_parts(tmp_path / "out.csv", lambda _, points, __: {"x": points[:, 0]})


def test_the_command_line_writes_the_same_in_batches(tmp_path, monkeypatch):
    body = gu.simulate("plunging", width=150.0)
    frame = body.frame(4).iloc[:, :3].assign(rock="ore", code="007")
    frame.to_csv(tmp_path / "a.csv", index=False)
    frame.to_parquet(tmp_path / "a.parquet", index=False)
    monkeypatch.chdir(tmp_path)
    outs = {}
    for limit in (0, 1 << 40):
        monkeypatch.setattr(large, "LARGE", limit)
        monkeypatch.setattr(large, "BATCH", 1000 if not limit else 1 << 30)
        for kind in ("csv", "parquet"):
            out = f"flat_{limit}.{kind}"
            assert main(["unfold", f"a.{kind}", "-o", out, "--map", f"{limit}{kind}.npz"]) == 0
            back = f"back_{limit}.{kind}"
            words = ["map", f"{limit}{kind}.npz", out, "--inverse", "-o", back]
            assert main(words) == 0
            read = pd.read_csv if kind == "csv" else pd.read_parquet
            outs[limit, kind] = read(out), read(back)
    for kind in ("csv", "parquet"):
        for streamed, whole in zip(outs[0, kind], outs[1 << 40, kind], strict=True):
            pd.testing.assert_frame_equal(streamed, whole, check_exact=True)


def test_an_interrupted_batch_leaves_nothing(tmp_path, monkeypatch):
    path = text_file(tmp_path / "in.csv")
    body = gu.simulate("plunging", width=150.0)
    gu.unfold(body.folded).save(tmp_path / "m.npz")
    calls = []

    def failing(self, *args, **kwargs):
        calls.append(1)
        if len(calls) == 3:
            raise InputError("the third batch")
        return {"flat": np.zeros(100)}

    monkeypatch.setattr("geounfold.cli.commands.map.result_columns", lambda *a: failing(None))
    monkeypatch.setattr("geounfold.cli.commands.map.place_counts", lambda *a: {"carried": 1})
    before = sorted(p.name for p in tmp_path.iterdir())
    assert main(["map", str(tmp_path / "m.npz"), str(path), "-o", str(tmp_path / "o.csv")]) == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == before
    assert len(calls) == 3


def test_memory_does_not_grow_with_the_rows(tmp_path):
    """A child that maps a file four times as long takes little more memory."""
    body = gu.simulate("plunging", width=150.0)
    gu.unfold(body.folded).save(tmp_path / "m.npz")
    peaks = []
    for count in (300_000, 1_200_000):
        rng = np.random.default_rng(0)
        pick = body.folded[rng.integers(len(body.folded), size=count)]
        path = tmp_path / f"{count}.parquet"
        pd.DataFrame(pick, columns=["x", "y", "z"]).to_parquet(path, index=False)
        code = (
            "import sys; from geounfold.cli import main; status = main(sys.argv[1:]);"
            "from geounfold.backends.system.memory import peak_memory_mb;"
            "print(peak_memory_mb()); sys.exit(status)"
        )
        words = ["map", "m.npz", path.name, "-o", f"out_{count}.parquet", "--quiet"]
        done = subprocess.run(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        peaks.append(float(done.stdout))
    # 900,000 more points are 22 MB of coordinates in and as much out, and 9 columns in all:
    # read whole they took 250 MB more; in batches 10.
    assert peaks[1] - peaks[0] < 80, peaks
