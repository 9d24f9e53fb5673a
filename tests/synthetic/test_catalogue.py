"""The catalogue: published bodies, sizes that are asked for, recipes that are refused."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from geounfold.errors import OptionError
from geounfold.synthetic import (
    CASES,
    Bend,
    Bulge,
    Bump,
    Embayment,
    Even,
    Gap,
    Hole,
    Lens,
    Neck,
    ObliqueCut,
    Profile,
    Ragged,
    Sheet,
    Sinusoid,
    Swell,
    Wedge,
    cone,
    cylinder,
    simulate,
    spherical_cap,
)
from tests.places import ROOT, acceptance

DATA = ROOT / "data"


@pytest.mark.parametrize("blocks", [9_000, 100_000])
@pytest.mark.parametrize("name", ["large", "sim_case_1", "box"])
def test_body_of_a_wanted_size(name: str, blocks: int) -> None:
    # Whole rows and columns: half a block on either side of both extents.
    assert len(simulate(name, blocks=blocks).folded) == pytest.approx(blocks, rel=0.05)


def test_thin_wide_body_has_the_size_of_the_benchmark() -> None:
    assert len(simulate("thin_wide").folded) == 175_825


@pytest.mark.parametrize("name", ["sim_case_1", "sim_case_2"])
def test_bodies_are_those_of_the_acceptance(name: str) -> None:
    theirs, body = pd.read_csv(acceptance(name)), simulate(name)
    X = theirs[["centroid_x", "centroid_y", "centroid_z"]].to_numpy()
    assert_array_equal(theirs[["true_x", "true_y", "true_z"]].to_numpy(), body.truth)
    # Four decimals leave 5.0e-5; the rest is their linear interpolation in a table, 4.1e-6.
    assert_allclose(body.folded, X, rtol=0, atol=5.5e-5)
    assert np.mean(body.frame(4).iloc[:, :3].to_numpy() != X) < 0.02


@pytest.mark.parametrize("name", ["sim_case_1", "sim_case_2"])
def test_shipped_files_are_what_the_generator_writes(name: str) -> None:
    path = DATA / f"{name}.csv"
    assert hashlib.sha256(path.read_bytes()).hexdigest() in (DATA / "README.md").read_text()
    # Read back: another platform's sine may round a fifth decimal the other way.
    assert_allclose(pd.read_csv(path), simulate(name).frame(4), rtol=0, atol=1.01e-4)


REFUSED = {
    "unknown case": (lambda: simulate("sim_case_3"), "sim_case_1, sim_case_2"),
    "unknown option": (lambda: simulate("slab", colour="red"), "colour.*valid: blocks, desc"),
    "blocks": (lambda: simulate("slab", blocks=0), "blocks must be a positive number"),
    "length": (lambda: simulate("slab", length=-1), "length must be a positive"),
    "text": (lambda: simulate("slab", width="wide"), "width must be a positive"),
    "offset nan": (lambda: simulate("slab", offset=(0, 0, np.nan)), "offset must be a finite"),
    "offset pair": (lambda: simulate("slab", offset=(0, 0)), "offset must be three numbers"),
    "steps": (lambda: simulate("slab", steps=(1, 0, 1)), "steps must be a positive"),
    "grid": (lambda: simulate("slab", grid="during"), "not one of: before, after"),
    "noise": (lambda: simulate("slab", noise=-0.1), "noise must not be negative"),
    "missing": (lambda: simulate("slab", missing=1.0), "missing is a share"),
    "seed": (lambda: simulate("slab", seed=-1), "seed must be a whole number"),
    "pin": (lambda: simulate("slab", pin=np.inf), "pin must be a finite"),
    "profile": (lambda: simulate("slab", profile=None), "profile must be a Profile"),
    "refold": (lambda: simulate("slab", refold=3), "refold must be a Profile"),
    "thickness": (lambda: simulate("slab", thickness="thick"), "thickness must be a positive"),
    "outline": (lambda: simulate("slab", outline=("ellipse",)), "outline must be a tuple"),
    "no block": (lambda: simulate("slab", thickness=5.0, offset=(0, 0, 0)), "no block of slab"),
    "no body": (lambda: simulate("slab", outline=(Gap("u", -1, 1e9),), blocks=9), "leaves nothing"),
    "sub-blocks": (lambda: simulate("slab", sub_blocks=3), "not one of: 1, 2, 4, 8"),
    "sub-blocks before": (lambda: simulate("sim_case_1", sub_blocks=2), "grid 'after'"),
    "density": (lambda: simulate("scattered", density=0.5), "must be 1 or more"),
    "density of a lattice": (lambda: simulate("slab", density=2), "grid 'scattered'"),
    "open tube": (lambda: simulate("cylinder", length=900.0), "must end where it starts"),
    "closed lens": (lambda: simulate("cylinder", thickness=Lens(60)), "evenly thick"),
    "nothing to scatter": (  # a sliver on which the volume's midpoint rule has a point
        lambda: simulate(
            "scattered", length=800, outline=(Gap("u", -1, 399 - 1e-7), Gap("u", 399 + 1e-7, 801))
        ),
        "too little",
    ),
    "tight hinge": (lambda: simulate("chevron", thickness=160), "arc length 35.* radius 70"),
    "overlap": (
        lambda: Sheet(replace(CASES["hairpin"], length=1600)),
        "covers itself",
    ),
    "refold hinge": (
        lambda: simulate(
            "refolded", refold=Profile(elements=(Sinusoid(amplitude=60, wavelength=300),))
        ),
        "hinge at arc length",
    ),
    "wavelength": (lambda: Sinusoid(amplitude=1, wavelength=0), "wavelength must be"),
    "bend shape": (lambda: Bend(at=0, change=1, radius=1, shape="square"), "smooth, arc"),
    "bump": (lambda: Bump(at=0, amplitude=1, width=-1), "width must be"),
    "even": (lambda: Even(0), "thickness must be"),
    "lens": (lambda: Lens(np.nan), "thickness must be"),
    "swell": (lambda: Swell(10, 1.0), "swell amplitude"),
    "wedge": (lambda: Wedge(10, 11), "wedge tip"),
    "bulge side": (lambda: Bulge(10, 5, side="left"), "top, bottom"),
    "bulge size": (lambda: Bulge(10, 5, size=(0, 1)), "bulge size"),
    "hole": (lambda: Hole(size=(0.1, 0)), "hole size"),
    "ragged": (lambda: Ragged(0, 1), "ragged depth"),
    "embayment side": (lambda: Embayment("w0"), "u0, u1, v0, v1"),
    "embayment depth": (lambda: Embayment(depth=1.5), "embayment depth"),
    "cut": (lambda: ObliqueCut(90), "cut angle"),
    "neck": (lambda: Neck(0.2, 0), "neck breadth"),
    "gap axis": (lambda: Gap("x", 0, 1), "u, v, w"),
    "gap": (lambda: Gap("u", 1, 1), "low < high"),
    "horizon side": (lambda: simulate("slab").horizon("left", 5), "top, bottom"),
    "horizon spacing": (lambda: simulate("slab").horizon("top", 0), "spacing must be"),
    "grid of vertices": (lambda: cylinder(n=(1, 5)), "two numbers from 2 up"),
    "opening": (lambda: cylinder(angle=360), "below 360"),
    "cone": (lambda: cone(inner=5, outer=5), "inner < outer"),
    "apex": (lambda: cone(half_apex=90), "half_apex"),
    "cap": (lambda: spherical_cap(angle=130), "below 127"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_recipes_are_refused(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(OptionError, match=message):
        call()
