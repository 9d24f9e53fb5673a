"""The command line's manners: JSON, a file of options, progress, completion, the doctor."""

from __future__ import annotations

import io
import json
import re
import shlex
import subprocess
import sys
import threading
import time
from importlib import import_module, metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from geounfold.cli import main
from geounfold.cli.commands import doctor
from geounfold.cli.terminal import progress
from geounfold.cli.terminal.console import Console
from geounfold.cli.terminal.time_left import Forecast
from geounfold.errors import MissingDependencyError
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.options_toml import to_toml

SHIFT = np.array([10.0, 0.0, 0.0])


class FakeMap:
    """A map that shifts points; those with x < 0 are carried outside, with x < -5 not at all."""

    def carry(self, points: np.ndarray, *, inverse: bool = False) -> SimpleNamespace:
        words = np.where(points[:, 0] < -5, "outside", "extrapolated")
        carried = SimpleNamespace(
            points=points - SHIFT if inverse else points + SHIFT,
            stratigraphic=points[:, 2],
            location=np.where(points[:, 0] < 0, words, "inside"),
            distance=np.maximum(-points[:, 0], 0),
            unsolved=0,
        )
        carried.part = lambda rows: carried if rows == slice(0, len(points)) else None
        return carried


class FakeUnfolding(FakeMap):
    """As much of an unfolding as the command line looks at."""

    def __init__(self, points: np.ndarray) -> None:
        self.uncertainty = None
        self.map, self.carried, self.columns = self, self.carry(points), {}
        self.junctions = ()

    def summary(self) -> dict[str, Any]:
        return {"points": 3, "nmd": np.nan, "warnings": ["8 blocks lie outside"]}


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[UnfoldOptions]:
    """Replace the pipeline and saved maps; return the options of each call; write p.csv."""
    made: list[UnfoldOptions] = []

    def unfold(points: np.ndarray, options: UnfoldOptions, **_: Any) -> FakeUnfolding:
        made.append(options)
        return FakeUnfolding(points)

    for name, members in {
        "unfolding.run": {"unfold": unfold},
        "mapping.mesh_map": {"load": lambda _: FakeMap()},
    }.items():
        room, _, leaf = name.rpartition(".")
        fake = SimpleNamespace(**members)
        monkeypatch.setitem(sys.modules, f"geounfold.{name}", fake)
        monkeypatch.setattr(import_module(f"geounfold.{room}"), leaf, fake, raising=False)
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text("x,y,z\n1,2,3\n-4,5,6\n-7,8,9\n")
    Path("m.npz").write_bytes(b"map")
    return made


def _json(capsys: pytest.CaptureFixture[str], *argv: str) -> tuple[dict[str, Any], str]:
    """Run with --json; return stdout as an object, and stderr."""
    assert main([*argv, "--json"]) == 0
    out, err = capsys.readouterr()
    return json.loads(out), err


# ------------------------------------------------------------------------------------------- JSON


def test_unfold_tells_its_summary(
    calls: list[UnfoldOptions], capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["unfold", "p.csv", "-o", "out.csv", "--summary", "s.json"]
    answer, err = _json(capsys, *argv)
    assert answer == json.loads(Path("s.json").read_text())
    assert (answer["points"], answer["nmd"]) == (3, None)
    assert shlex.split(answer["command"]) == ["geounfold", *argv, "--json"]
    assert err == "geounfold: warning: 8 blocks lie outside\n"


def test_without_json_only_answers_go_to_stdout(
    calls: list[UnfoldOptions], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["unfold", "p.csv", "-o", "out.csv"]) == 0
    assert main(["map", "m.npz", "p.csv", "-o", "flat.csv"]) == 0
    assert capsys.readouterr().out == ""


def test_map_counts_what_it_carried(
    calls: list[UnfoldOptions], capsys: pytest.CaptureFixture[str]
) -> None:
    answer, err = _json(capsys, "map", "m.npz", "p.csv", "-o", "flat.csv")
    assert answer == {"points": {"carried": 3, "extrapolated": 1, "outside": 1}}
    assert err.count("warning") == 2
    answer, _ = _json(capsys, "map", "m.npz", "p.csv", "-o", "back.csv", "--inverse")
    assert answer["points"]["carried"] == 3


def test_compare_tells_its_rows(
    calls: list[UnfoldOptions],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = [
        {"surface": "top", "flattener": "spring", "flips": 0, "area_error": 0.25, "error": ""},
        {"surface": "top", "flattener": "lscm", "flips": None, "area_error": None, "error": "long"},
    ]
    frame = pd.DataFrame(rows).astype({"flips": "Int64", "area_error": float})
    fake = SimpleNamespace(compare=lambda *_, **__: frame)
    monkeypatch.setitem(sys.modules, "geounfold.comparison.flatteners", fake)
    monkeypatch.setattr(import_module("geounfold.comparison"), "flatteners", fake, raising=False)
    answer, _ = _json(capsys, "compare", "p.csv", "-o", "t.csv")
    assert answer == {"rows": rows}


def test_quality_simulate_and_init_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    listed, _ = _json(capsys, "simulate", "--list")
    assert "sim_case_1" in listed["cases"]
    made, _ = _json(capsys, "simulate", "sim_case_1", "--blocks", "500", "-o", "b.csv")
    assert made == {"case": "sim_case_1", "points": len(pd.read_csv("b.csv")), "output": "b.csv"}
    figures, _ = _json(capsys, "quality", "b.csv", "b.csv")
    assert figures["points"] == made["points"]
    assert figures["epsilon_folded"]["max"] == 0  # compared with itself
    assert _json(capsys, "init", "-o", "c.toml")[0] == {"output": "c.toml"}


def test_errors_leave_stdout_empty(
    calls: list[UnfoldOptions], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["unfold", "no.csv", "-o", "out.csv", "--json"]) == 2
    assert capsys.readouterr() == ("", "geounfold: error: no.csv: no such file\n")


# ----------------------------------------------------------------------------- a file of options


def test_words_go_before_the_file(calls: list[UnfoldOptions]) -> None:
    written = UnfoldOptions(hull="alpha", datum="top", reach=2.0, allow_uncertified=True)
    Path("c.toml").write_text("\ufeff" + to_toml(written))  # as some editors begin a file
    argv = ["unfold", "p.csv", "--config", "c.toml", "-o"]
    assert main([*argv, "a.csv"]) == 0
    assert main([*argv, "b.csv", "--datum", "mid", "--no-allow-uncertified"]) == 0
    assert calls[0] == written
    assert calls[1] == UnfoldOptions(hull="alpha", reach=2.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "c.toml: no such file"),
        (b"reach = 'far'", "c.toml: reach must be a number of 0 or more, but is 'far'"),
        (b"hull = '\xff'", "c.toml: not valid TOML: not UTF-8 text"),
        (b"\x00", "c.toml: not valid TOML"),
    ],
)
def test_files_that_cannot_be_used(
    content: bytes | None,
    words: str,
    calls: list[UnfoldOptions],
    capsys: pytest.CaptureFixture[str],
) -> None:
    if content is not None:
        Path("c.toml").write_bytes(content)
    assert main(["unfold", "p.csv", "-o", "out.csv", "--config", "c.toml"]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
    assert not Path("out.csv").exists()


def test_the_file_is_an_input_and_for_bodies_only(
    calls: list[UnfoldOptions], capsys: pytest.CaptureFixture[str]
) -> None:
    Path("c.json").write_text("")
    Path("t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    argv = ["unfold", "p.csv", "-o", "out.csv", "--config", "c.json", "--overwrite"]
    assert main([*argv, "--summary", "c.json"]) == 2
    assert Path("c.json").read_text() == ""
    assert main(["compare", "t.obj", "-o", "t.csv", "--config", "c.json"]) == 2
    assert "--config needs a table of points; t.obj is one surface" in capsys.readouterr().err


# -------------------------------------------------------------------------------------- progress


def test_time_left_follows_the_share_that_is_told() -> None:
    now = [100.0]
    forecast = Forecast(lambda: now[0])
    forecast.tell(None)  # reading is no part of the run
    now[0] += 5.0
    forecast.tell(0.0)
    assert (forecast.done, forecast.left) == (None, None)
    now[0] += 2.0
    forecast.tell(0.1)
    # A tenth took 2 s, so the whole takes 20 s, 18 s of which are left.
    assert forecast.left == pytest.approx(18.0)
    assert forecast.done == pytest.approx(0.10)
    now[0] += 0.5  # the bar runs on between two shares that are told
    assert forecast.done == pytest.approx(0.125)
    now[0] += 100.0  # far longer than foreseen: the bar stands 0.05 ahead
    assert forecast.done == pytest.approx(0.15)
    forecast.tell(0.2)  # at this pace, 0.2 in 102.5 s, four times as long is left
    assert forecast.left == pytest.approx(410.0)
    forecast.tell(None)
    assert (forecast.done, forecast.left) == (None, None)
    assert forecast.elapsed == pytest.approx(107.5)


def test_a_share_that_falls_begins_another_run() -> None:
    now = [0.0]
    forecast = Forecast(lambda: now[0])
    for share in (0.0, 0.5, 1.0, 0.0):
        forecast.tell(share)
        now[0] += 1.0
    assert forecast.left is None
    forecast.tell(0.25)  # a fourth in a second
    assert forecast.left == pytest.approx(3.0)


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_line_that_lives_goes_without_a_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    terminal = _Terminal()
    console = Console(stream=terminal)
    console.stage("hull [bold]\x1b[31m")
    console.warn("odd")
    console.stage("sheet")
    console.done("done")
    text = terminal.getvalue()
    assert "hull [bold]?[31m" in text  # neither markup nor escapes of a file's name
    assert "sheet" in text
    assert "\x1b[?25l" not in text  # the cursor stays
    # What stays: each drawing begins by clearing the line, and none of them breaks it.
    left = [line.rpartition("\r\x1b[K")[2] for line in text.split("\n")]
    assert left[0] == "geounfold: warning: odd"
    assert re.fullmatch(r"done \(\d+\.\d s\)", left[1])
    assert left[2:] == [""]


def test_the_line_ticks_and_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "_TICK", 0.01)
    before = threading.active_count()
    terminal = _Terminal()
    shown = progress.RichProgress(terminal, Forecast())
    shown.stage("hull")
    while terminal.getvalue().count("hull") < 3:
        time.sleep(0.01)
    shown.clear()
    assert terminal.getvalue().endswith("\r\x1b[K")
    assert threading.active_count() == before


@pytest.mark.parametrize(("term", "verbose"), [("dumb", False), ("xterm", True)])
def test_plain_progress(term: str, verbose: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", term)
    terminal = _Terminal()
    console = Console(stream=terminal, plain=verbose)
    console.stage("hull")
    assert re.fullmatch(r"\r\x1b\[K\[ +0\.\d s\] hull \.\.\.", terminal.getvalue())


def test_progress_is_not_loaded_in_a_pipe() -> None:
    code = (
        "import sys\n"
        "from geounfold.cli import main\n"
        "assert main(['init', '--help']) == 0\n"
        "assert main(['simulate', '--list']) == 0\n"
        "print(sorted({'rich', 'shtab', 'packaging', 'tomllib'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


# ---------------------------------------------------------------------------------------- doctor


@pytest.fixture
def declared(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Declare libraries and replace the checks; return these."""
    lines = [
        "numpy>=1",
        "no-such-library>=2",
        "pandas<1",
        "ezdxf>=1; extra == 'formats'",
        "geoh5py; python_version < '3' and extra == 'formats'",
        "ruff; extra == 'dev'",
    ]
    monkeypatch.setattr(metadata, "requires", lambda _: lines)
    checks: dict[str, Any] = {"drawing": lambda: None}
    monkeypatch.setattr(doctor, "CHECKS", checks)
    return checks


def test_doctor_finds_what_is_missing_old_or_broken(
    declared: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> None:
        raise MissingDependencyError("libGL is missing")

    declared["MeshLab"] = broken
    assert main(["doctor", "--json"]) == 1
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert err == "geounfold: error: not in order: no-such-library, pandas, MeshLab\n"
    assert found["libraries"]["numpy"] == {"version": np.__version__, "needed": ">=1", "ok": True}
    assert found["libraries"]["no-such-library"]["version"] is None
    assert list(found["extras"]) == ["formats"]
    assert list(found["extras"]["formats"]) == ["ezdxf"]  # the other is not for this Python
    assert found["checks"] == {
        "drawing": {"ok": True},
        "MeshLab": {"ok": False, "message": "libGL is missing"},
    }
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert re.search(r"no-such-library +missing\n", out)
    assert re.search(rf"pandas +{re.escape(pd.__version__)}  \(geounfold needs <1\)\n", out)
    assert re.search(r"MeshLab +libGL is missing\n", out)
    assert "pip install 'geounfold[formats]'" in out


def test_doctor_is_content(declared: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "requires", lambda _: ["numpy>=1", "x>1; extra == 'formats'"])
    assert main(["doctor"]) == 0  # an extra may be missing


def test_libraries_are_tried() -> None:
    for name in ("libigl", "MeshLab"):
        doctor.CHECKS[name]()


# ------------------------------------------------------------------------------------- completion


def test_completion_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["completion", "bash"]) == 1
    assert "pip install 'geounfold[completion]'" in capsys.readouterr().err
    assert main(["completion", "fish"]) == 2
    assert "bash" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("geounfold unf", {"unfold"}),
        ("geounfold unfold --hu", {"--hull"}),
        ("geounfold unfold p.csv --datum pro", {"proportional"}),
        ("geounfold simulate sim_case", {"sim_case_1", "sim_case_2"}),
        ("geounfold unfold blo", {"blocks.csv"}),
        ("geounfold unfold blocks.csv --config opt", {"options.toml"}),
        ("geounfold completion z", {"zsh"}),
    ],
)
def test_bash_completes(words: str, expected: set[str], completer: Path) -> None:
    line = shlex.split(words)
    code = (
        f"source {completer.name}\nCOMP_WORDS=({words})\nCOMP_CWORD={len(line) - 1}\n"
        "function=$(complete -p geounfold | sed 's/.*-F \\([^ ]*\\) .*/\\1/')\n"
        f'"$function" geounfold {line[-1]} {line[-2]}\n'
        "printf '%s\\n' \"${COMPREPLY[@]}\"\n"
    )
    done = subprocess.run(
        ["bash", "--norc", "-c", code], cwd=completer.parent, capture_output=True, text=True
    )
    assert {word.strip() for word in done.stdout.splitlines()} == expected, done.stderr


@pytest.fixture(scope="module")
def completer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("shtab", reason="the extra `completion` is not installed")
    from geounfold.cli.commands.completion import script

    path = tmp_path_factory.mktemp("shell") / "geounfold.bash"
    path.write_text(script("bash"))
    for name in ("blocks.csv", "options.toml"):
        (path.parent / name).touch()
    for shell in ("zsh", "tcsh"):
        assert "geounfold" in script(shell)
    return path
