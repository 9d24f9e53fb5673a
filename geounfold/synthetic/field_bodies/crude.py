"""Field bodies as rough models give them: shells, indicators, waste, strays, pipes."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from geounfold.geometry.mesh import Bools, Floats
from geounfold.synthetic.field_bodies.blocks import (
    UTM,
    FieldBlocks,
    FieldBody,
    Space,
    largest,
    relief,
)


def _shell(
    rng: np.random.Generator,
    cells: tuple[int, int, int],
    reach: tuple[float, float, float],
    share: float,
    bits: bool = False,
) -> FieldBlocks:
    """Return the cells of a box in which a smooth random field is highest; no level is true.

    Parameters
    ----------
    cells : (int, int, int)
        The box's cells along each axis.
    reach : (float, float, float)
        Smoothing of the field, in blocks.
    share : float
        Share of the cells that the body and its bits hold.
    bits : bool
        Whether components beside the largest stay.
    """
    steps = (10.0, 10.0, 5.0)
    half = [n * h / 2 for n, h in zip(cells, steps, strict=True)]
    a, b, c = half
    space = Space((-a, -b, -c), (a, b, c), steps)
    value = space.noise(rng, reach)
    return space.body((value > np.quantile(value, 1 - share), np.nan), loose=bits)


def _own_level(t: Floats, kept: Bools) -> Floats:
    """Return the level between the lowest and the highest cell of each column of a body.

    The true level is that of the smooth layer behind the noise. An answer that follows the noisy
    surfaces instead is as right.
    """
    half = np.abs(np.diff(t, axis=2)).mean() / 2
    low = np.where(kept, t, np.inf).min(axis=2, keepdims=True) - half
    high = np.where(kept, t, -np.inf).max(axis=2, keepdims=True) + half
    with np.errstate(invalid="ignore"):
        out: Floats = (t - low) / (high - low)
    return out


def _lens_shell(rng: np.random.Generator, noise: float, bits: bool = False) -> FieldBlocks:
    """Return a grade shell of a folded lens: a noisy grade falls off from its mid surface."""
    space = Space((-300, -220, -70), (300, 220, 70), (10.0, 10.0, 5.0))
    x, y = space.x, space.y
    half = 25 * np.sqrt(np.clip(1 - (x / 280) ** 2 - (y / 200) ** 2, 0.01, 1))
    t = space.z - relief(rng, x, y, 0.15)
    grade = 1 - np.abs(t) / half + noise * space.noise(rng, (2.0, 2.0, 1.5))
    level = np.where(np.abs(t) < half, 0.5 + t / (2 * half), np.nan)
    kept = (grade > 0) & space.inside
    return space.body((kept, level), loose=bits, others=(_own_level(t, kept),))


def _indicator(
    rng: np.random.Generator,
    noise: float,
    size: float = 1.0,
    correlation: float = 1.5,
    bits: bool = False,
    turned: bool = False,
) -> FieldBlocks:
    """Return the blocks whose noisy indicator of a folded layer 40 m thick is above a half.

    Parameters
    ----------
    noise : float
        Standard deviation of the noise, in half thicknesses.
    size : float
        Factor on the layer's extent.
    correlation : float
        Smoothing of the noise, in blocks.
    bits : bool
        Whether components beside the largest stay.
    turned : bool
        Whether the lattice is turned, in a national grid.
    """
    a, b = 220 * size, 150 * size
    space = Space(
        (-a, -b, -60), (a, b, 100), bearing=28.0 * turned, offset=UTM if turned else (0.0, 0.0, 0.0)
    )
    t = space.z - relief(rng, space.x, space.y, 0.3)
    value = 1 - np.abs(t - 20) / 20 + noise * space.noise(rng, (correlation,) * 3)
    level = np.where((t > 0) & (t < 40), t / 40, np.nan)
    kept = (value > 0) & (t > -40) & (t < 80) & space.inside
    kept = kept if bits else largest(kept)
    return space.body((kept, level), loose=bits, others=(_own_level(t, kept),))


def _polygons(rng: np.random.Generator) -> FieldBlocks:
    """Return a layer whose columns take top and bottom from the nearest hole."""
    space = Space((-240, -160, -60), (240, 160, 110))
    x, y = space.x, space.y
    holes = rng.uniform((-260, -180), (260, 180), (90, 2))
    at = np.concatenate([holes, np.stack([x, y], axis=-1).reshape(-1, 2)])
    height = relief(rng, at[:, 0], at[:, 1], 0.15)
    surface, layer = height[: len(holes)], height[len(holes) :].reshape(x.shape)
    low, high = rng.normal(0, 2.5, (2, len(holes))) + np.array([surface, surface + 35])
    near = cKDTree(holes).query(np.stack([x, y], axis=-1))[1]
    level = (space.z - low[near]) / (high - low)[near]
    smooth = np.clip((space.z - layer) / 35, 0, 1)
    return space.body(((level > 0) & (level < 1), level), others=(smooth,))


def _layer(rng: np.random.Generator, thick: float = 40.0) -> tuple[Space, Floats, Bools]:
    """Return a lattice, height above the bottom of a folded layer on it, and the layer's mask."""
    space = Space((-200, -120, -50), (200, 120, 50 + thick))
    t = space.z - relief(rng, space.x, space.y, 0.2)
    return space, t, (t > 0) & (t < thick)


def _swiss(rng: np.random.Generator, lenses: int) -> FieldBlocks:
    """Return a layer with lenses of waste inside it."""
    space, t, inside = _layer(rng)
    without = space.waste(rng, t, (200.0, 120.0, 40.0), lenses)
    return space.body((inside, t / 40), without=without)


def _pits(rng: np.random.Generator, count: int, up: bool) -> FieldBlocks:
    """Return a layer with pits one or two blocks deep, or with spikes two or three blocks high."""
    space, t, inside = _layer(rng, 30.0)
    top = np.where(inside.any(axis=2), inside.shape[2] - inside[:, :, ::-1].argmax(axis=2), -1)
    changed = np.zeros(inside.shape, bool)
    columns = np.argwhere(top > 0)
    for i, j in columns[rng.choice(len(columns), count, replace=False)]:
        k, deep = int(top[i, j]), int(rng.integers(1, 3))
        changed[i, j, k : k + deep + 1] = up
        changed[i, j, k - deep : k] = not up
    if up:
        return space.body((inside, t / 30), beside=changed)
    return space.body((inside, t / 30), without=changed)


def _bridged(rng: np.random.Generator, count: int) -> FieldBlocks:
    """Return a hairpin with limbs four blocks apart that bridges one or two blocks broad join."""
    space = Space((-250, -70, -60), (60, 70, 60))
    x, z = space.x, space.z
    radius, thick = 22.5, 25.0
    t = np.where(x < 0, np.abs(z), np.hypot(np.maximum(x, 0), z)) - radius
    across = np.zeros(x.shape, bool)
    for _ in range(count):
        a, b = rng.uniform(-230, -60), rng.uniform(-60, 60)
        across |= (np.abs(x - a) < 4) & (np.abs(space.y - b) < 5)
    return space.body(
        (np.abs(t) < thick / 2, t / thick + 0.5), beside=across & (np.abs(z) < radius)
    )


def _strays(rng: np.random.Generator, count: int) -> FieldBlocks:
    """Return a layer, and single blocks three to twelve blocks away from it."""
    space, t, inside = _layer(rng, 35.0)
    away = (t > 35 + 15) & (t < 35 + 60) | (t < -15) & (t > -60)
    found = np.argwhere(away & space.inside)
    loose = np.zeros(inside.shape, bool)
    loose[tuple(found[rng.choice(len(found), count, replace=False)].T)] = True
    return space.body((inside, t / 35), loose=loose)


def _holes(rng: np.random.Generator, share: float) -> FieldBlocks:
    """Return a layer of which single blocks are missing at random."""
    space, t, inside = _layer(rng)
    return space.body((inside, t / 40), without=rng.random(inside.shape) < share)


def _pipe(rng: np.random.Generator, radius: float, slope: float) -> FieldBlocks:
    """Return a folded sheet through which a pipe of ore goes, upright to the lattice."""
    space = Space((-190, -130, -110), (190, 130, 140))
    t = space.z - relief(rng, space.x, space.y, slope)
    a, b = rng.uniform(-80, 80), rng.uniform(-40, 40)
    pipe = (space.x - a) ** 2 + (space.y - b) ** 2 < radius**2
    sheet = (t > 0) & (t < 30)
    return space.body((sheet & ~pipe, t / 30), beside=pipe & (t > -85) & (t < 115))


def _on_neck(rng: np.random.Generator, count: int) -> FieldBlocks:
    """Return lenses above each other on a common neck."""
    space = Space((-200, -130, -40), (200, 130, 40 + 75 * (count - 1)))
    lenses = []
    for k in range(count):
        a, b = rng.uniform(-35, 35), rng.uniform(-20, 20)
        round_ = 1 - ((space.x - a) / 160) ** 2 - ((space.y - b) / 105) ** 2
        half = 20 * np.sqrt(np.clip(round_, 1e-9, None))
        w = space.z - 75 * k
        lenses.append(((np.abs(w) < half) & (round_ > 0), w / (2 * half) + 0.5))
    neck = (space.x**2 + space.y**2 < 22**2) & (space.z > 0) & (space.z < 75 * (count - 1))
    return space.body(*lenses, beside=neck)


def _bits_around(rng: np.random.Generator) -> FieldBlocks:
    """Return a layer with detached bits of 5 to 40 blocks around it, in a turned lattice."""
    space = Space((-220, -120, -80), (220, 120, 130), turn=(20.0, 0.0, 10.0), bearing=40.0)
    t = space.z - relief(rng, space.x, space.y, 0.2)
    inside = (t > 0) & (t < 40)
    bits = space.noise(rng, (1.5,) * 3) > 3.3
    bits &= ((t > 50) | (t < -10)) & space.inside
    return space.body((inside, t / 40), loose=bits & ~largest(inside | bits))


def _body(
    name: str, family: str, builder: partial[FieldBlocks], about: str, expects: str = "right"
) -> FieldBody:
    return FieldBody(name=name, family=family, builder=builder, expects=expects, about=about)


BODIES = (
    _body("shell_20k", "shell",
          partial(_shell, cells=(50, 50, 24), reach=(8.0, 8.0, 3.0), share=0.35),
          "random field, largest component", "told"),
    _body("shell_bits", "shell",
          partial(_shell, cells=(60, 50, 24), reach=(5.0, 5.0, 2.0), share=0.3, bits=True),
          "random field, all components", "told"),
    _body("shell_150k", "shell",
          partial(_shell, cells=(120, 90, 36), reach=(9.0, 9.0, 3.0), share=0.36),
          "random field, 150,000 blocks", "told"),
    _body("lens_shell", "shell", partial(_lens_shell, noise=0.2), "grade shell of a lens"),
    _body("lens_shell_rough", "shell", partial(_lens_shell, noise=0.6, bits=True),
          "grade shell of a lens, rough, with bits", "told"),
    _body("indicator_02", "indicator", partial(_indicator, noise=0.2), "noise 0.2"),
    _body("indicator_04", "indicator", partial(_indicator, noise=0.4, turned=True),
          "noise 0.4, turned, national grid"),
    _body("indicator_07", "indicator", partial(_indicator, noise=0.7, bits=True),
          "noise 0.7, with bits", "told"),
    _body("indicator_white", "indicator", partial(_indicator, noise=0.35, correlation=0.4),
          "noise without correlation"),
    _body("indicator_110k", "indicator",
          partial(_indicator, noise=0.3, size=1.75, correlation=2.5), "noise 0.3, 110,000 blocks"),
    _body("polygons", "indicator", partial(_polygons), "nearest hole's top and bottom"),
    _body("waste_1", "waste", partial(_swiss, lenses=1), "one lens of waste inside"),
    _body("waste_5", "waste", partial(_swiss, lenses=5), "five lenses of waste inside"),
    _body("waste_30", "waste", partial(_swiss, lenses=30), "thirty lenses of waste inside"),
    _body("pits", "waste", partial(_pits, count=60, up=False), "60 pits in the top"),
    _body("spikes", "waste", partial(_pits, count=60, up=True), "60 spikes on the top"),
    _body("bridges", "waste", partial(_bridged, count=3), "hairpin, three bridges"),
    _body("missing", "waste", partial(_holes, share=0.03), "3 % of the blocks missing"),
    _body("pipe", "pipe", partial(_pipe, radius=22.0, slope=0.1), "pipe through a sheet"),
    _body("pipe_fold", "pipe", partial(_pipe, radius=30.0, slope=0.4), "pipe through a fold"),
    _body("neck_2", "pipe", partial(_on_neck, count=2), "two lenses on a neck", "told"),
    _body("neck_3", "pipe", partial(_on_neck, count=3), "three lenses on a neck", "told"),
    _body("stray_1", "stray", partial(_strays, count=1), "one block out of reach"),
    _body("stray_12", "stray", partial(_strays, count=12), "twelve blocks out of reach"),
    _body("bits", "stray", partial(_bits_around), "bits of some blocks out of reach"),
)  # fmt: skip
