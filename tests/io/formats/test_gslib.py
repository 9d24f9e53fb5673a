"""GSLIB files."""

from __future__ import annotations

from pathlib import Path

import pytest

from geounfold.errors import InputError
from geounfold.io import read_points, read_table


def test_gslib_as_in_the_book(tmp_path: Path) -> None:
    # The layout of Deutsch and Journel's cluster.dat, with the spacing that Fortran writes.
    (tmp_path / "cluster.dat").write_text(
        "Clustered 140 primary and secondary data\n4\nXlocation\nYlocation\nprimary\nsecondary\n"
        "   39.5    18.5        .06      .22\n    5.5     1.5        .06     -999.0\n"
    )
    with pytest.raises(InputError, match=r"no coordinate columns.*Xlocation"):
        read_points(tmp_path / "cluster.dat")
    table = read_table(tmp_path / "cluster.dat")
    # Such a file does not declare -999 as missing.
    assert table.frame["secondary"].tolist() == [0.22, -999.0]
    named = read_points(tmp_path / "cluster.dat", ("Xlocation", "Ylocation", "primary"))
    assert named.points.tolist() == [[39.5, 18.5, 0.06], [5.5, 1.5, 0.06]]
