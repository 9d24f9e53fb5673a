"""Field bodies of several sheets: branches, ladders, split seams and thrust repeats."""

from __future__ import annotations

from functools import partial

import numpy as np

from geounfold.geometry.mesh import Bools, Floats
from geounfold.synthetic.field_bodies.blocks import UTM, FieldBlocks, FieldBody, Space, relief

_HALF = 15.0  # of a main sheet's thickness


def _main(rng: np.random.Generator, space: Space) -> tuple[Floats, Bools, Floats]:
    """Return height above a gently folded mid surface, and the main sheet's mask and level."""
    t = space.z - relief(rng, space.x, space.y)
    return t, np.abs(t) < _HALF, (t + _HALF) / (2 * _HALF)


def _branch(space: Space, t: Floats, at: float, angle: float, half: float) -> tuple[Bools, Floats]:
    """Return mask and level of a sheet that crosses the main one's mid surface at x = ``at``.

    It rises towards +x at ``angle`` degrees to the main sheet; negative angles fall.
    """
    a = np.radians(angle)
    u = (space.x - at) * np.sin(a) - t * np.cos(a)
    return np.abs(u) < half, (u + half) / (2 * half)


def _y(
    rng: np.random.Generator, angle: float, half: float = 9.0, steep: bool = False
) -> FieldBlocks:
    """Return a main sheet and one branch on its upper side."""
    turn = (float(rng.uniform(-20, 20)), 0.0, float(rng.uniform(60, 75))) if steep else (0.0,) * 3
    space = Space((-210, -80, -70), (210, 80, 170), turn=turn, bearing=25.0 * steep)
    t, main, level = _main(rng, space)
    mask, own = _branch(space, t, float(rng.uniform(-40, 40)), angle + rng.uniform(-4, 4), half)
    thin = 2 * half / space.steps[0]
    return space.body((main, level), (mask & (t > 0), own), thinnest=thin if thin < 5 else np.inf)


def _y_fine(rng: np.random.Generator) -> FieldBlocks:
    """Return a Y branch on unequal blocks in a national grid, lattice and body turned."""
    space = Space((-210, -110, -70), (210, 110, 150), (8.0, 8.0, 4.0), (30.0, 0.0, 0.0), 17.0, UTM)
    t, main, level = _main(rng, space)
    mask, own = _branch(space, t, float(rng.uniform(-40, 20)), rng.uniform(40, 55), 10.0)
    return space.body((main, level), (mask & (t > 0), own))


def _x(rng: np.random.Generator) -> FieldBlocks:
    """Return a main sheet that another one crosses."""
    space = Space((-200, -75, -140), (200, 75, 140))
    t, main, level = _main(rng, space)
    mask, own = _branch(space, t, float(rng.uniform(-30, 30)), rng.uniform(50, 70), 10.0)
    return space.body((main, level), (mask, own))


def _two_branches(rng: np.random.Generator) -> FieldBlocks:
    """Return a main sheet with a branch on either side."""
    space = Space((-260, -75, -140), (260, 75, 140))
    t, main, level = _main(rng, space)
    up, up_level = _branch(space, t, float(rng.uniform(60, 120)), rng.uniform(50, 70), 10.0)
    down, down_level = _branch(space, t, float(-rng.uniform(60, 120)), -rng.uniform(50, 70), 10.0)
    return space.body((main, level), (up & (t > 0), up_level), (down & (t < 0), down_level))


def _ladder(rng: np.random.Generator, pillars: int) -> FieldBlocks:
    """Return two sheets 25 m thick, 25 m apart, joined by pillars of waste rock logged as ore."""
    space = Space((-220, -90, -60), (220, 90, 120))
    t = space.z - relief(rng, space.x, space.y)
    joined = np.zeros(t.shape, bool)
    for _ in range(pillars):
        a, b = rng.uniform(-190, 190), rng.uniform(-70, 70)
        joined |= (space.x - a) ** 2 + (space.y - b) ** 2 < rng.uniform(9, 14) ** 2
    joined &= (t >= 25) & (t <= 50)
    return space.body(
        ((t > 0) & (t < 25), t / 25), ((t > 50) & (t < 75), (t - 50) / 25), beside=joined
    )


def _split(
    rng: np.random.Generator, lower: float, upper: float, opening: float, parting: float
) -> FieldBlocks:
    """Return a seam that a parting splits into two plies; lengths in blocks of 4 m.

    Levels as right as each ply's own: the parting taken out of the whole seam, and the whole seam
    as far as it is not split.
    """
    h = 4.0
    reach = 200.0
    space = Space((-reach, -70, -50), (reach, 70, 60 + h * (lower + upper + parting)), (h, h, h))
    t = space.z - relief(rng, space.x, space.y, 0.12)
    start = rng.uniform(-60, 0) + 10 * np.sin(space.y / 40)
    gap = np.clip((space.x - start) * opening, 0, parting * h)
    a, b = lower * h, upper * h
    under, over = (t > 0) & (t < a), (t > a + gap) & (t < a + gap + b)
    lower_level, upper_level = t / a, (t - a - gap) / b
    out = np.where(under, t, t - gap) / (a + b)
    mixed = np.where(gap < h / 2, out, np.where(under, lower_level, upper_level))
    return space.body(
        (under, lower_level),
        (over, upper_level),
        thinnest=min(lower, upper) if min(lower, upper) < 5 else np.inf,
        others=(out, mixed),
    )


def _thrust(
    rng: np.random.Generator, thick: float, overlap: float, slope: float, turn: float = 0.0
) -> FieldBlocks:
    """Return a sheet thrust over itself; the repeated halves touch along a ramp and a flat."""
    space = Space(
        (-230, -75, -60), (230, 75, 60 + 2 * thick), turn=(turn, 0.0, 0.0), bearing=turn / 2
    )
    x = space.x
    t = space.z - relief(rng, x, space.y, slope)
    ramp = overlap * rng.uniform(0.4, 0.6)
    lift = thick * np.clip((overlap / 2 + ramp - x) / ramp, 0, 1)
    upper = (t > lift) & (t < lift + thick) & (x > -overlap / 2)
    lower = (t > 0) & (t < thick) & (x < overlap / 2)
    blocks = thick / float(space.steps[2])
    thinnest = blocks if blocks < 5 else np.inf
    return space.body((upper, (t - lift) / thick), (lower, t / thick), thinnest=thinnest)


def _body(name: str, family: str, builder: partial[FieldBlocks], about: str) -> FieldBody:
    return FieldBody(name=name, family=family, builder=builder, expects="told", about=about)


BODIES = (
    _body("y_30", "branch", partial(_y, angle=30), "branch at 30 degrees"),
    _body("y_45_steep", "branch", partial(_y, angle=45, steep=True), "steep vein, branch at 45"),
    _body("y_65", "branch", partial(_y, angle=65), "branch at 65 degrees"),
    _body("y_thin", "branch", partial(_y, angle=50, half=7.0), "branch three blocks thick"),
    _body("y_utm", "branch", partial(_y_fine), "blocks 8 x 8 x 4, turned, national grid"),
    _body("x_crossing", "branch", partial(_x), "two sheets cross"),
    _body("two_branches", "branch", partial(_two_branches), "branches on both sides"),
    _body("ladder", "branch", partial(_ladder, pillars=6), "two sheets, six pillars"),
    _body("split_thin", "split", partial(_split, lower=6, upper=6, opening=0.05, parting=2.2),
          "plies of 6 and 6 blocks, parting of two"),
    _body("split_thick", "split", partial(_split, lower=6, upper=8, opening=0.25, parting=10),
          "plies of 6 and 8 blocks, parting of ten"),
    _body("split_slow", "split", partial(_split, lower=5, upper=5, opening=0.04, parting=5),
          "the parting opens by 2 degrees"),
    _body("split_2_9", "split", partial(_split, lower=2, upper=9, opening=0.15, parting=6),
          "plies of 2 and 9 blocks"),
    _body("split_3_4", "split", partial(_split, lower=3, upper=4, opening=0.1, parting=5),
          "plies of 3 and 4 blocks"),
    _body("split_12_12", "split", partial(_split, lower=12, upper=12, opening=0.2, parting=8),
          "plies of 12 and 12 blocks"),
    _body("thrust_thin", "repeat", partial(_thrust, thick=20.0, overlap=110, slope=0.1),
          "sheet of 4 blocks repeated"),
    _body("thrust_thick", "repeat", partial(_thrust, thick=40.0, overlap=150, slope=0.05),
          "sheet of 8 blocks repeated"),
    _body("thrust_folded", "repeat", partial(_thrust, thick=30.0, overlap=130, slope=0.3),
          "repeated, then folded"),
    _body("thrust_turned", "repeat",
          partial(_thrust, thick=25.0, overlap=120, slope=0.15, turn=30.0),
          "strike oblique to the lattice"),
)  # fmt: skip
