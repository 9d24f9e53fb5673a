"""The five lines that end a run on a terminal."""

from __future__ import annotations

import io

import pytest

from geounfold.cli.answers.closing import closing_lines, names_of
from geounfold.cli.terminal.console import Console

SUMMARY = {
    "points": 54400,
    "bodies": 1,
    "lattice": {"found": True, "steps": [15.0, 15.0, 5.0]},
    "outside": {"extrapolated": 12, "empty": 0},
    "flat_size": {"length": 2699.2, "width": 1268.4, "thickness": 116.58},
    "hull": {"volume": 1.8388e8},
    "body_volume": {"folded": 54400 * 15 * 15 * 5, "unfolded": None},
    "injective": True,
    "horizons": {"top": 0.0101, "bottom": 0.006},
    "nmd": {"mean": 0.0467, "p95": 0.123},
    "trust": {"word": "fair", "reasons": [{"what": "the top steps"}, {"what": "b"}]},
    "seconds": {"frame": 1.0, "sheet": 34.31},
    "peak_memory_mb": 512.4,
}


def test_a_run_ends_in_five_lines() -> None:
    lines = closing_lines(SUMMARY, 54.31, names_of(["flat.csv", None, "r.html"]))
    assert lines == [
        "blocks   54,400 of 15 x 15 x 5 unfolded, 12 outside the mesh, extrapolated",
        "body     2699 long and 1268 wide when flat, 116.6 thick (median), volume of the blocks "
        "6.12e+07",
        "verdict  proved one-to-one; top and bottom level to 1.0% of the thickness; distances to "
        "neighbours change by 4.7%, for 95% of the blocks by less than 12%; trust fair: the top "
        "steps and 1 more",
        "time     54.3 s, of which sheet 34.3 s; 512 MB of memory",
        "files    flat.csv, r.html",
    ]


def test_what_is_not_proved_is_said_loudly() -> None:
    assert "NOT proved" in closing_lines(SUMMARY | {"injective": False}, 1.0, [])[2]
    assert len(closing_lines({}, 1.0, [])) == 5


def test_points_without_blocks_have_the_volume_of_the_hull() -> None:
    scattered = SUMMARY | {"body_volume": {"folded": None, "unfolded": None}}
    assert "volume of the hull 1.839e+08" in closing_lines(scattered, 1.0, [])[1]


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("quiet", [False, True])
def test_quiet_is_silent(quiet: bool) -> None:
    terminal = _Terminal()
    console = Console(quiet=quiet, stream=terminal)
    console.close(lambda seconds: closing_lines(SUMMARY, seconds, []))
    assert terminal.getvalue().count("\n") == (0 if quiet else 5)
    assert ("blocks   54,400" in terminal.getvalue()) != quiet
