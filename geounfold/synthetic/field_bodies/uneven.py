"""Field bodies of uneven thickness: bulges, feather edges, channels and troughs, strips, rims."""

from __future__ import annotations

from functools import partial

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.synthetic.field_bodies.blocks import (
    UTM,
    FieldBlocks,
    FieldBody,
    Space,
    relief,
    waves,
)

_REACH = 50.0  # ten blocks of 5 m: length over which thickness changes


def _smooth(x: Floats) -> Floats:
    """Return a step from 0 to 1 between 0 and 1 with level ends."""
    a = np.clip(x, 0, 1)
    out: Floats = a * a * (3 - 2 * a)
    return out


def _grown(rng: np.random.Generator, space: Space, kind: str) -> Floats:
    """Return growth of the thickness, from 0 to 1, over x and y."""
    x, y = space.x, space.y
    if kind == "step":
        return _smooth((x + 10 * np.sin(y / 50) - rng.uniform(-40, 10)) / _REACH)
    if kind == "bulge":
        r = np.hypot(x - rng.uniform(-50, 50), y - rng.uniform(-20, 20))
        return _smooth((1.5 * _REACH - r) / _REACH)
    if kind == "boudins":
        return 0.5 + 0.5 * np.sin(x * np.pi / _REACH + rng.uniform(0, 2 * np.pi))
    return np.clip(0.4 + 0.5 * waves(rng, x, y, 4 * _REACH), 0, 1)


def _uneven(
    rng: np.random.Generator,
    kind: str,
    factor: float,
    thin: float = 15.0,
    base: float = 0.5,
    bearing: float = 0.0,
) -> FieldBlocks:
    """Return a sheet whose thickness grows by ``factor`` within ten blocks.

    ``base`` is the share of the growth on the lower side: 0 gives a level bottom.
    """
    most = thin * factor
    space = Space(
        (-200, -90, -30 - base * most),
        (200, 90, 30 + thin + (1 - base) * most),
        (6.0, 6.0, 4.0) if bearing else (5.0, 5.0, 5.0),
        bearing=bearing,
        offset=UTM if bearing else (0.0, 0.0, 0.0),
    )
    thick = thin * (1 + (factor - 1) * _grown(rng, space, kind))
    t = space.z - relief(rng, space.x, space.y, 0.12) + base * (thick - thin)
    return space.body(((t > 0) & (t < thick), t / thick))


def _feather(rng: np.random.Generator, sides: int) -> FieldBlocks:
    """Return a sheet that thins to nothing on one side of x, or all round."""
    space = Space((-200, -120, -60), (200, 120, 75), (5.0, 5.0, 2.5))
    x, y = space.x, space.y
    if sides == 1:
        thick = 40 * np.clip((x + rng.uniform(185, 195)) / 380, 0, 1)
    else:
        a, b = rng.uniform(180, 195), rng.uniform(100, 115)
        thick = 45 * np.sqrt(np.clip(1 - (x / a) ** 2 - (y / b) ** 2, 0, 1))
    t = space.z - relief(rng, x, y, 0.15) + thick / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        level = t / thick
    return space.body(((t > 0) & (t < thick), level))


def _channel(rng: np.random.Generator, width: float, depth: float) -> FieldBlocks:
    """Return a layer under a level unconformity, with a channel cut into its base."""
    space = Space((-200, -100, -40 - depth), (200, 100, 0))
    bend = rng.uniform(20, 40) * np.sin(space.y / 70 + rng.uniform(0, 6))
    thick = 20 + depth * np.exp(-(((space.x - bend) / width) ** 2))
    t = space.z + thick
    return space.body(((t > 0) & (space.z < 0), t / thick))


def _trough(rng: np.random.Generator, slope: float, cut: float) -> FieldBlocks:
    """Return a layer between a folded base and a level top, ``cut`` amplitudes above the middle."""
    length = rng.uniform(340, 400)
    amplitude = slope * length / (2 * np.pi)
    space = Space((-220, -80, -amplitude - 5), (220, 80, amplitude + 10))
    base = -amplitude * np.cos(2 * np.pi * space.x / length + rng.uniform(-0.4, 0.4))
    top = cut * amplitude
    with np.errstate(divide="ignore", invalid="ignore"):
        level = (space.z - base) / (top - base)
    return space.body(((space.z > base) & (space.z < top), level))


def _strip(rng: np.random.Generator, breadth: float) -> FieldBlocks:
    """Return a long sheet, ``breadth`` times as broad as thick."""
    half = 15.0 * breadth
    turn = (float(rng.uniform(-40, 40)), float(rng.uniform(-30, 30)), float(rng.uniform(-60, 60)))
    space = Space((-300, -half, -60), (300, half, 90), turn=turn)
    t = space.z - relief(rng, space.x, 0 * space.y, 0.3)
    return space.body(((t > 0) & (t < 30), t / 30))


def _skew(rng: np.random.Generator, angles: tuple[float, float, float, float]) -> FieldBlocks:
    """Return a sheet whose four ends are cut at angles, degrees; above 90 the top overhangs."""
    space = Space((-230, -130, -60), (230, 130, 100), turn=(float(rng.uniform(10, 35)), 0.0, 0.0))
    t = space.z - relief(rng, space.x, space.y, 0.25)
    cut = 1 / np.tan(np.radians(np.array(angles) + rng.uniform(-4, 4, 4)))
    inside = (t > 0) & (t < 35)
    inside &= (space.x > -180 + cut[0] * (t - 17)) & (space.x < 180 - cut[1] * (t - 17))
    inside &= (space.y > -90 + cut[2] * (t - 17)) & (space.y < 90 - cut[3] * (t - 17))
    return space.body((inside, t / 35))


def _body(
    name: str, family: str, builder: partial[FieldBlocks], about: str, expects: str = "right"
) -> FieldBody:
    return FieldBody(name=name, family=family, builder=builder, expects=expects, about=about)


BODIES = (
    _body("step_x3", "uneven", partial(_uneven, kind="step", factor=3), "x3 along a line"),
    _body("bulge_x3", "uneven", partial(_uneven, kind="bulge", factor=3, bearing=35.0),
          "bulge x3, national grid"),
    _body("bulge_x5", "uneven", partial(_uneven, kind="bulge", factor=5), "bulge x5"),
    _body("bulge_x5_top", "uneven", partial(_uneven, kind="bulge", factor=5, base=0.0),
          "bulge x5, level bottom"),
    _body("bulge_x8", "uneven", partial(_uneven, kind="bulge", factor=8), "bulge x8"),
    _body("swells_x4", "uneven", partial(_uneven, kind="waves", factor=4), "random swells, x4"),
    _body("boudins_x4", "uneven", partial(_uneven, kind="boudins", factor=4),
          "pinch and swell, x4"),
    _body("feather_one", "uneven", partial(_feather, sides=1), "thins to nothing on one side"),
    _body("feather_all", "uneven", partial(_feather, sides=4), "thins to nothing all round"),
    _body("channel_wide", "unconformity", partial(_channel, width=90.0, depth=30.0),
          "channel 90 m wide, 30 m deep"),
    _body("channel_narrow", "unconformity", partial(_channel, width=45.0, depth=30.0),
          "channel 45 m wide, 30 m deep"),
    _body("trough_open", "unconformity", partial(_trough, slope=0.4, cut=1.3),
          "folded base, level top"),
    _body("trough_closed", "unconformity", partial(_trough, slope=0.5, cut=0.7),
          "syncline's fill, feather edges"),
    _body("strip_2", "strip", partial(_strip, breadth=2.0), "twice as broad as thick", "told"),
    _body("strip_3", "strip", partial(_strip, breadth=3.0), "three times as broad as thick"),
    _body("strip_5", "strip", partial(_strip, breadth=5.0), "five times as broad as thick"),
    _body("skew_parallel", "rim", partial(_skew, angles=(135.0, 45.0, 90.0, 90.0)),
          "two ends cut at 45 degrees, parallel"),
    _body("skew_opposed", "rim", partial(_skew, angles=(45.0, 45.0, 90.0, 90.0)),
          "two ends cut at 45 degrees, facing"),
    _body("skew_all", "rim", partial(_skew, angles=(125.0, 55.0, 60.0, 60.0)),
          "four ends cut at 55 and 60 degrees"),
)  # fmt: skip
