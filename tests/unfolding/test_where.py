"""Rows chosen in the library: the body is the rows chosen, the table has all."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import geounfold as gu


def test_waste_around_a_body_changes_nothing() -> None:
    body = gu.simulate("sim_case_1").folded
    alone = gu.unfold(body)
    # The waste lies far off, so that it would be a body of its own.
    waste = body + np.ptp(body, axis=0) * 3
    frame = pd.DataFrame(np.concatenate([waste, body]), columns=list("xyz"))
    frame["ROCK"] = np.repeat(["WASTE", "ORE"], len(body))
    mixed = np.arange(2 * len(body)).reshape(2, -1).T.ravel()  # waste and ore by turns
    shuffled = frame.iloc[mixed]
    with pytest.raises(gu.InputError, match="2 "):
        gu.unfold(shuffled)
    u = gu.unfold(shuffled, where="ROCK=ORE")
    assert u.folded.shape == u.points.shape == body.shape
    table = u.table
    assert table.index.equals(shuffled.index)
    ore = table["ROCK"] == "ORE"
    assert (table.loc[~ore, "location"] == "not selected").all()
    assert table.loc[~ore, ["unfolded_x", "volume_ratio"]].isna().all(axis=None)
    found = table.loc[range(len(body), 2 * len(body)), ["unfolded_x", "unfolded_y", "unfolded_z"]]
    np.testing.assert_array_equal(found.to_numpy(), alone.points)
    assert len(u.to_pyvista().points) == len(body)


def test_arrays_have_no_columns_to_choose_by() -> None:
    with pytest.raises(gu.InputError, match="give a DataFrame"):
        gu.unfold(np.zeros((8, 3)), where="ROCK=ORE")
    frame = pd.DataFrame(np.zeros((3, 3)), columns=list("xyz")).assign(ROCK="ORE")
    with pytest.raises(gu.InputError, match=r"no row meets where 'ROCK=ORES'.*ORE \(3\)"):
        gu.unfold(frame, where="ROCK=ORES")


def test_compare_takes_the_chosen_rows() -> None:
    body = gu.simulate("slab").folded
    frame = pd.DataFrame(np.concatenate([body, body + 1e4]), columns=list("xyz"))
    frame["ROCK"] = np.repeat(["ORE", "WASTE"], len(body))
    chosen = gu.compare(frame, ["lscm"], where="ROCK=ORE")
    alone = gu.compare(body, ["lscm"])
    figures = ["surface", "vertices", "faces", "area_error"]
    assert chosen[figures].equals(alone[figures])
    with pytest.raises(gu.OptionError, match="where chooses rows by columns"):
        gu.compare(body, ["lscm"], where="ROCK=ORE")


def test_options_name_the_nearest_one() -> None:
    with pytest.raises(gu.OptionError, match=r"no option metod .did you mean 'method'"):
        gu.UnfoldOptions(metod="sheet")
