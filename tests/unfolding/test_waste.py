"""Domains that are the rest of a model: named before they are unfolded."""

from __future__ import annotations

import numpy as np
import pytest

from geounfold.unfolding.waste import waste_domains, waste_told
from tests.cli.domains import four_domains
from tests.shapes import grid_cells

MODEL = four_domains()
POINTS = MODEL[["x", "y", "z"]].to_numpy()
LODES = ["LODE 1", "LODE 2", "SEAM"]


def domains(rest: str, points: np.ndarray = POINTS) -> dict[str, str]:
    names = [*LODES, rest]
    codes = MODEL["DOMAIN"].replace("WASTE", rest).map(names.index).to_numpy()
    return waste_domains(codes, names, points)


@pytest.mark.parametrize("name", ["waste", "0", "-99", "Host Rock", "esteril"])
def test_names_that_mean_waste(name: str) -> None:
    # Where the blocks lie plays no part.
    codes = np.repeat([0, 1], [5, 5])
    assert waste_domains(codes, ["LODE", name], grid_cells(10, 1, 1)) == {
        name: "its name means waste"
    }


@pytest.mark.parametrize("turn", [0, 35])
def test_the_rest_of_a_model_is_known_by_its_corners(turn: float) -> None:
    a = np.radians(turn)
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    why = {"KV7": "it fills all corners of the model around the others"}
    assert domains("KV7", POINTS @ R.T + 5e5) == why


def test_bodies_are_no_waste() -> None:
    ore = (MODEL["DOMAIN"] != "WASTE").to_numpy()
    codes = MODEL["DOMAIN"][ore].map(LODES.index).to_numpy()
    assert waste_domains(codes, LODES, POINTS[ore]) == {}
    # A flat seam over another: each has four corners of the box.
    seam = grid_cells(12, 9, 6)
    assert waste_domains((seam[:, 2] > 2).astype(int), ["A", "B"], seam * 10.0) == {}
    east_west = np.repeat([0, 1], [5, 5])
    assert waste_domains(east_west, ["E", "W"], grid_cells(10, 1, 1)) == {}
    # One domain that fills the box alone: there is nothing to leave out.
    assert waste_domains(np.zeros(len(seam), int), ["A"], seam * 10.0) == {}


def test_the_warning_has_the_expression_that_leaves_them_out() -> None:
    found = {"HOST ROCK": "its name means waste", "0": "its name means waste"}
    assert waste_told("ZONE", found, {"HOST ROCK": 9, "0": 1}) == (
        "ZONE HOST ROCK (9 blocks; its name means waste) and 0 (1 block; its name means waste) are "
        "unfolded as bodies too: leave them out by --where \"ZONE not in ('HOST ROCK', 0)\""
    )
    one = waste_told("ZONE", {"AIR": "its name means waste"}, {"AIR": 2})
    assert one.endswith('is unfolded as a body too: leave it out by --where "ZONE!=AIR"')
