"""The command line: what goes in comes out, and every way of leaving has its status."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import geounfold
from geounfold import _version
from geounfold.body.working_frame import Frame
from geounfold.cli import main
from geounfold.cli.terminal.console import Console
from geounfold.errors import HullError, InputError, MissingDependencyError
from geounfold.geometry.mesh import TetMesh
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods import METHODS
from geounfold.report import CarriedHoles, CarriedPoints

COMMANDS = ["unfold", "map", "estimate", "compare", "crosscheck", "quality", "simulate"]
COMMANDS += ["view", "grid", "transfer", "init", "doctor", "completion"]
SHIFT = np.array([1000.0, 0.0, -5.0])
PLACE = ["unfolded_x", "unfolded_y", "unfolded_z", "stratigraphic"]
RESULTS = [*PLACE, "location", "mesh_distance"]
assert METHODS  # loaded before the tests put fakes in the place of what it builds on


class FakeMap:
    """A map that shifts points; those with x < 0 lie outside."""

    def carry(self, points: np.ndarray, *, inverse: bool = False) -> SimpleNamespace:
        location = np.where(points[:, 0] < 0, "extrapolated", "inside")
        image = points - SHIFT if inverse else points + SHIFT
        carried = SimpleNamespace(
            points=image,
            stratigraphic=points[:, 2] / 10,
            location=location,
            distance=np.maximum(-points[:, 0], 0),
            unsolved=0,
        )
        carried.part = lambda rows: carried if rows == slice(0, len(points)) else None
        return carried


class Given(dict[str, Any]):
    """Options as they were given, of the default method."""

    method = "sheet"


class FakeUnfolding(FakeMap):
    """What the pipeline returns, as far as the command line looks at it."""

    def __init__(self, points: np.ndarray, warnings: tuple[str, ...] = ()) -> None:
        carried = self.carry(points)
        self.map, self.carried = self, carried
        self.points, self.location = carried.points, carried.location
        self.stratigraphic = carried.stratigraphic
        self.columns = {"volume_ratio": np.ones(len(points))}
        self.warnings = warnings

    def summary(self) -> dict[str, Any]:
        return {"points": len(self.points), "nmd": np.nan, "warnings": list(self.warnings)}

    def save(self, path: Path) -> None:
        np.savez(path, shift=SHIFT)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Replace the pipeline by a shift; return what it is called with."""
    made: list[dict[str, Any]] = []

    def unfold(points: np.ndarray, options: Any, *, progress: Any, **surfaces: Any) -> Any:
        progress("hull")
        made.append({"points": points, "options": options, **surfaces})
        return FakeUnfolding(points, ("8 blocks lie outside",))

    _replace(monkeypatch, "unfolding.run", unfold=unfold)
    _replace(monkeypatch, "unfolding.options", UnfoldOptions=Given)
    _replace(monkeypatch, "mapping.mesh_map", load=lambda _: FakeMap())
    return made


def _replace(monkeypatch: pytest.MonkeyPatch, name: str, **members: Any) -> None:
    home, _, leaf = name.rpartition(".")
    fake = SimpleNamespace(**members)
    monkeypatch.setitem(sys.modules, f"geounfold.{name}", fake)
    monkeypatch.setattr(import_module(f"geounfold.{home}".rstrip(".")), leaf, fake, raising=False)


@pytest.fixture
def points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "p.csv"
    path.write_text("id,XC,YC,ZC,location\n007,1.50,2,3,pit\n,-4,5,6,\n9,7,8,9,face\n")
    return path


def _process(*argv: str, **settings: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "geounfold", *argv],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        **settings,
    )


# ------------------------------------------------------------------------------- help, version


@pytest.mark.parametrize("argv", [["--help"], *([c, "--help"] for c in COMMANDS)], ids=" ".join)
def test_help(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == 0
    out, err = capsys.readouterr()
    assert out.startswith("usage: geounfold")
    assert "exit status" in out
    assert err == ""


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"geounfold {_version.__version__}\n"


def test_help_loads_nothing_heavy() -> None:
    # The package's own __init__ is left out: what counts here is what the command line loads.
    code = (
        "import sys, types\n"
        "bare = types.ModuleType('geounfold')\n"
        "bare.__path__ = [sys.argv[1]]\n"
        "sys.modules['geounfold'] = bare\n"
        "from geounfold.cli import main\n"
        "assert main(['unfold', '--help']) == 0\n"
        "heavy = {'igl', 'matplotlib', 'numpy', 'pandas', 'pymeshlab', 'pyvista', 'scipy'}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))\n"
    )
    folder = str(Path(_version.__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", code, folder], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"


# ---------------------------------------------------------------------------------- the commands


def test_unfold_writes_everything(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, Any] = {}

    def write_report(
        path: Path,
        summary: Any,
        folded: Any,
        unfolded: Any,
        columns: Any,
        *,
        holes: Any,
        exploration: Any,
    ) -> None:
        assert exploration is None  # without --grade
        seen.update(summary=summary, folded=folded, unfolded=unfolded, columns=columns, holes=holes)
        path.write_text("<html>")

    kinds = {"CarriedHoles": CarriedHoles, "CarriedPoints": CarriedPoints}
    _replace(monkeypatch, "report", write_report=write_report, **kinds)
    _replace(monkeypatch, "report.plots.rendering", check_rendering=lambda: None)
    (tmp_path / "q.csv").write_text("hole;x;y;z\na;1;1;1\n")
    argv = [
        "unfold",
        "p.csv",
        "-o",
        "out.csv",
        "--summary",
        "s.json",
        "--map",
        "m.npz",
        "--report",
        "r.html",
    ]
    assert main([*argv, "--samples", "q.csv", "--samples-out", "qo.csv"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {
        *("p.csv", "q.csv", "out.csv", "s.json", "m.npz", "r.html", "qo.csv")
    }
    assert (tmp_path / "out.csv").read_text().splitlines() == [
        "id,XC,YC,ZC,location,unfolded_x,unfolded_y,unfolded_z,stratigraphic,mesh_distance,volume_ratio",
        "007,1.50,2,3,inside,1001.5,2.0,-2.0,0.3,0.0,1.0",
        ",-4,5,6,extrapolated,996.0,5.0,1.0,0.6,4.0,1.0",
        "9,7,8,9,inside,1007.0,8.0,4.0,0.9,0.0,1.0",
    ]
    assert (tmp_path / "qo.csv").read_text().splitlines() == [
        "hole,x,y,z," + ",".join(RESULTS),
        "a,1,1,1,1001.0,1.0,-4.0,0.1,inside,0.0",
    ]
    summary = json.loads((tmp_path / "s.json").read_text())
    assert summary["nmd"] is None
    assert summary["input"]["columns"] == ["XC", "YC", "ZC"]
    assert summary["input"]["rows"] == 3
    assert seen["summary"]["points"] == 3
    assert list(seen["columns"])[:6] == RESULTS
    np.testing.assert_array_equal(seen["unfolded"], seen["folded"] + SHIFT)
    samples = seen["holes"].samples
    np.testing.assert_array_equal(samples.unfolded, samples.folded + SHIFT)
    assert list(samples.columns) == ["stratigraphic", "location"]
    assert list(seen["columns"]["id"]) == ["007", "", "9"]


def test_options_reach_the_pipeline(points: Path, calls: list[dict[str, Any]]) -> None:
    argv = [
        "unfold",
        "p.csv",
        "-o",
        "out.csv",
        "--method",
        "thesis",
        "--up",
        "-1,0,0.5",
        "--body",
        "2",
        "--neighbours",
        "6",
    ]
    assert main(argv) == 0
    assert calls[0]["options"] == {
        "method": "thesis",
        "up": (-1.0, 0.0, 0.5),
        "body": 2,
        "neighbours": 6,
    }
    assert calls[0]["top"] is None
    assert main(["unfold", "p.csv", "-o", "out2.csv", "--body", "all"]) == 0
    assert calls[1]["options"] == {"body": "all"}


def test_surfaces_reach_the_pipeline(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]]
) -> None:
    (tmp_path / "t.csv").write_text("x,y,z,v1,v2,v3\n0,0,1,1,2,3\n1,0,1,,,\n0,1,1,,,\n")
    (tmp_path / "b.csv").write_text("x,y,z,v1,v2,v3\n0,0,0,1,2,3\n1,0,0,,,\n0,1,0,,,\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--top", "t.csv", "--bottom", "b.csv"]) == 0
    assert calls[0]["top"].V[:, 2].tolist() == [1, 1, 1]
    assert calls[0]["bottom"].V[:, 2].tolist() == [0, 0, 0]


def test_dropped_rows_are_counted_and_said(
    tmp_path: Path,
    points: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    points.write_text("x,y,z\n1,2,3\n1,,3\n4,5,6\n4,5,6\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--summary", "s.json", "--drop-invalid"]) == 0
    facts = json.loads((tmp_path / "s.json").read_text())["input"]
    assert (facts["rows"], facts["dropped_invalid"], facts["duplicates"]) == (4, 1, 1)
    assert len(pd.read_csv(tmp_path / "out.csv")) == 3
    assert "p.csv: 1 rows without finite coordinates were left out" in capsys.readouterr().err


def test_overwrite_and_quiet(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "out.csv").write_text("old")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--overwrite"]) == 0
    assert (tmp_path / "out.csv").read_text().startswith("id,")
    # In a pipe: no progress, but what to distrust.
    assert capsys.readouterr() == ("", "geounfold: warning: 8 blocks lie outside\n")
    assert main(["unfold", "p.csv", "-o", "out.csv", "--overwrite", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_map_there_and_back(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "m.npz").write_bytes(b"map")
    assert main(["map", "m.npz", "p.csv", "-o", "flat.csv"]) == 0
    flat = pd.read_csv(tmp_path / "flat.csv", dtype=str)
    assert list(flat) == ["id", "XC", "YC", "ZC", "location", *PLACE, "mesh_distance"]
    assert "p.csv: 1 of 3 points lie outside the control mesh" in capsys.readouterr().err
    columns = "unfolded_x,unfolded_y,unfolded_z"
    assert main(f"map m.npz flat.csv --inverse --columns {columns} -o back.csv".split()) == 0
    back = pd.read_csv(tmp_path / "back.csv", dtype={"id": str})
    assert list(back) == [*flat, "folded_x", "folded_y", "folded_z"]
    folded = back[["folded_x", "folded_y", "folded_z"]].to_numpy()
    np.testing.assert_array_equal(folded, back[["XC", "YC", "ZC"]].to_numpy())
    # The unfolded columns are those meant on the way back, though XC/YC/ZC are there too.
    assert main(["map", "m.npz", "flat.csv", "--inverse", "-o", "back2.csv"]) == 0
    assert (tmp_path / "back2.csv").read_text() == (tmp_path / "back.csv").read_text()
    assert main(f"map m.npz flat.csv --columns {columns} -o no.csv".split()) == 2
    assert not (tmp_path / "no.csv").exists()


def test_compare(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked: list[Any] = []

    def compare(given: Any, flatteners: Any, **how: Any) -> pd.DataFrame:
        asked.append((type(given).__name__, flatteners, how.get("unfolding")))
        row = {"surface": "top", "flattener": "spring", "flips": 0, "error": "too, long"}
        return pd.DataFrame([row])

    _replace(monkeypatch, "comparison.flatteners", compare=compare)
    (tmp_path / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert main(["compare", "p.csv", "-o", "t.csv", "--hull", "alpha"]) == 0
    assert "spring failed on the top surface: too, long" in capsys.readouterr().err
    assert main(["compare", "t.obj", "--flatteners", "spring,arap", "-o", "t2.csv"]) == 0
    assert asked == [("ndarray", "all", {"hull": "alpha"}), ("TriMesh", ["spring", "arap"], None)]
    written = (tmp_path / "t.csv").read_text()
    assert written == 'surface,flattener,flips,error\ntop,spring,0,"too, long"\n'
    assert main(["compare", "t.obj", "--hull", "alpha", "-o", "t3.csv"]) == 2
    assert "--hull needs a table of points; t.obj is one surface" in capsys.readouterr().err


def test_quality(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    axes = np.meshgrid(np.arange(6.0), np.arange(5.0), np.arange(3.0), indexing="ij")
    truth = np.stack([a.ravel() for a in axes], axis=1)
    flat = pd.DataFrame(truth + 7.0, columns=RESULTS[:3]).assign(x=0.0, y=0.0, z=0.0)
    flat.to_csv(tmp_path / "flat.csv", index=False)
    true = pd.DataFrame(truth, columns=["true_x", "true_y", "true_z"])
    folded = pd.DataFrame(truth * [1, 1, 2], columns=list("xyz"))
    pd.concat([folded, true], axis=1).to_csv(tmp_path / "folded.csv", index=False)
    files = [str(tmp_path / "folded.csv"), str(tmp_path / "flat.csv")]
    figures = tmp_path / "f.json"
    assert main(["quality", *files, "--truth", files[0], "-o", str(figures)]) == 0
    found = json.loads(figures.read_text())
    # The answer is the truth moved by 7: both are zero but for rounding near 10.
    assert found["epsilon_truth"]["max"] < 1e-12
    assert found["rms"] < 1e-12
    assert found["rms_nothing"] > 0.5
    assert "epsilon_truth" in capsys.readouterr().out
    assert main(["quality", *files, "--neighbours", "6"]) == 0
    out = capsys.readouterr().out
    assert "neighbours" in out
    assert "epsilon_own_neighbours" in out


def test_simulate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--list"]) == 0
    cases = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert {"sim_case_1", "sim_case_2"} <= {name for name, _description in cases}
    out = tmp_path / "thin.parquet"
    pytest.importorskip("pyarrow")
    assert main(["simulate", "sim_case_1", "-o", str(out)]) == 0
    assert {"centroid_x", "true_z"} <= set(pd.read_parquet(out))
    assert main(["simulate", "no_such_case", "-o", str(tmp_path / "x.csv")]) == 2
    assert "sim_case_1" in capsys.readouterr().err
    assert main(["simulate", "--list", "-o", str(tmp_path / "x.csv")]) == 2
    assert "--list stands alone" in capsys.readouterr().err


def test_simulate_writes_four_decimals_and_about_so_many_blocks(tmp_path: Path) -> None:
    out = tmp_path / "small.csv"
    assert main(["simulate", "sim_case_1", "--blocks", "2000", "-o", str(out)]) == 0
    rows = out.read_text().splitlines()[1:]
    assert 1600 < len(rows) < 2400  # whole blocks, six layers: measured 1,944
    assert max(len(value.partition(".")[2]) for row in rows for value in row.split(",")) == 4
    assert main(["simulate", "sim_case_1", "--blocks", "0", "-o", str(tmp_path / "x.csv")]) == 2


def test_view_asks_for_numbers(
    tmp_path: Path, points: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "p.csv", "-o", "p.png", "--colour", "id"]) == 2
    assert "data row 2" in capsys.readouterr().err
    assert main(["view", "p.csv", "-o", "p.png", "--colour", "location"]) == 2
    assert "not numeric" in capsys.readouterr().err


def test_view_draws_both_spaces(
    points: Path, tmp_path: Path, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    _replace(
        monkeypatch,
        "report.plots.bodies",
        draw_body=lambda _p, _values, label: drawn.append((label,)),
        draw_bodies=lambda _p, _q, _values, label, titles: drawn.append((label, *titles)),
        draw_control=lambda control: drawn.append(control.folded.V.tolist()),
    )
    _replace(monkeypatch, "report.plots.figures", png=lambda _figure: b"picture")
    (tmp_path / "m.npz").write_bytes(b"map")
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    tet = TetMesh(corners, [[0, 1, 2, 3]])
    frame = Frame(np.array([100.0, 0, 0]), np.diag([-1.0, 1, -1]), 10.0, None)
    saved = SimpleNamespace(control=ControlMesh(tet, tet, corners[:, 2]), frame=frame)
    monkeypatch.setattr(geounfold.mapping.mesh_map, "load", lambda _: saved)
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == 0
    (tmp_path / "true.csv").write_text("x,y,z,true_x,true_y,true_z\n1,2,3,1,2,0\n4,5,6,4,5,0\n")
    unfolded = ",".join(RESULTS[:3])
    for number, words in enumerate(
        (
            ["p.csv"],
            ["out.csv"],
            ["out.csv", "--colour", "ZC"],
            ["out.csv", "--columns", unfolded],
            ["true.csv"],
        )
    ):
        assert main(["view", *words, "-o", f"{number}.png"]) == 0
    assert main(["view", "m.npz", "-o", "c.png"]) == 0
    in_world = [[100, 0, 0], [90, 0, 0], [100, 10, 0], [100, 0, -10]]
    assert drawn == [
        ("ZC",),
        ("stratigraphic", "folded", "unfolded"),
        ("ZC", "folded", "unfolded"),
        ("stratigraphic",),
        ("z", "folded", "truth"),
        in_world,
    ]
    assert (tmp_path / "c.png").read_bytes() == b"picture"


# ---------------------------------------------------------------------------- ways of leaving


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (InputError("all on\na line"), 2, "geounfold: error: all on a line\n"),
        (HullError("no hull"), 1, "geounfold: error: no hull\n"),
        (KeyboardInterrupt(), 130, "geounfold: error: interrupted; nothing was written\n"),
        (MemoryError(), 1, "geounfold: error: out of memory; nothing was written\n"),
    ],
)
def test_errors_are_one_line(
    error: BaseException,
    status: int,
    words: str,
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(geounfold.unfolding.run, "unfold", _raise(error))
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == status
    assert capsys.readouterr() == ("", words)
    assert list(tmp_path.iterdir()) == [points]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_failing_last_output_leaves_none(
    error: BaseException,
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    _replace(monkeypatch, "report", write_report=_raise(error))
    _replace(monkeypatch, "report.plots.rendering", check_rendering=lambda: None)
    assert main(["unfold", "p.csv", "-o", "out.csv", "--report", "r.html"]) in (2, 130)
    assert capsys.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [points]


def test_pictures_are_tried_before_computing(
    points: Path,
    tmp_path: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    missing = MissingDependencyError("libGL is missing: apt install libgl1")
    _replace(monkeypatch, "report.plots.rendering", check_rendering=_raise(missing))
    assert main(["unfold", "p.csv", "-o", "out.csv", "--report", "r.html"]) == 1
    assert capsys.readouterr().err == f"geounfold: error: {missing}\n"
    assert calls == []
    assert list(tmp_path.iterdir()) == [points]


def test_anything_else_is_a_traceback(
    points: Path,
    calls: list[dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(geounfold.unfolding.run, "unfold", _raise(ZeroDivisionError("oops")))
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == 1
    assert "Traceback" in capsys.readouterr().err


def _raise(error: BaseException) -> Callable[..., None]:
    def fail(*_: object, **__: object) -> None:
        raise error

    return fail


def test_process_has_the_status(tmp_path: Path) -> None:
    done = _process("unfold", "nowhere.csv", "-o", "out.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "geounfold: error: nowhere.csv: no such file\n"
    assert done.stdout == ""


def test_reader_that_leaves_early() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "geounfold", "simulate", "--list"],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.parametrize(
    ("sent", "status", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_signals_clear_what_was_begun(
    sent: signal.Signals, status: int, word: str, tmp_path: Path
) -> None:
    script = (
        "import pathlib, sys, time\n"
        "import geounfold.cli.entry as entry\n"
        "from geounfold.io import Outputs\n"
        "def slow(args, console):\n"
        "    with Outputs.planned({'o': ('out.csv', ())}).writing() as parts:\n"
        "        parts['o'].write_text('half')\n"
        "        print('begun', flush=True)\n"
        "        time.sleep(30)\n"
        "entry._command = lambda name: slow\n"
        "sys.exit(entry.main(['simulate', '--list']))\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell's background ignores interruptions, which a run would heed.
        preexec_fn=lambda: signal.signal(sent, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(0.05)
    process.send_signal(sent)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (
        status,
        f"geounfold: error: {word}; nothing was written\n",
    )
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------- console


class _Terminal:
    def __init__(self, *, live: bool) -> None:
        self.text, self._live = "", live

    def isatty(self) -> bool:
        return self._live

    def write(self, text: str) -> None:
        self.text += text

    def flush(self) -> None: ...


@pytest.mark.parametrize(("live", "quiet"), [(True, False), (False, False), (True, True)])
def test_progress_is_for_terminals(live: bool, quiet: bool) -> None:
    terminal = _Terminal(live=live)
    console = Console(quiet=quiet, stream=terminal)  # type: ignore[arg-type]
    console.stage("hull")
    console.done("all done")
    assert ("hull" in terminal.text) == (live and not quiet)
    assert ("all done" in terminal.text) == (live and not quiet)


def test_progress_gives_way_to_an_error() -> None:
    terminal = _Terminal(live=True)
    console = Console(stream=terminal)  # type: ignore[arg-type]
    console.stage("hull\x1b[31m")
    console.error("no\nhull")
    assert terminal.text.endswith("\r\x1b[Kgeounfold: error: no hull\n")
    assert "\x1b[31m" not in terminal.text
