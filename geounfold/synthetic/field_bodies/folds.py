"""Field bodies folded hard: classes 1B, 1C, 2 and 3, overturned, recumbent, hairpins, domes."""

from __future__ import annotations

from functools import partial

import numpy as np

from geounfold.synthetic.field_bodies.blocks import UTM, FieldBlocks, FieldBody, Space, folded
from geounfold.synthetic.fold_spec import FoldSpec
from geounfold.synthetic.profile import Bend, Profile, Sinusoid


def _similar(
    rng: np.random.Generator,
    slope: float,
    power: float,
    thick: float,
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    bearing: float = 0.0,
    length: float = 260.0,
) -> FieldBlocks:
    """Return a sinusoidal fold whose thickness along the axial plane varies with the dip.

    Parameters
    ----------
    slope : float
        Tangent of the steepest limb's angle to the axial plane's normal.
    power : float
        Thickness across the layer is ``thick cos(dip) ** power``: 0 class 1B, between 0 and 1
        class 1C, 1 class 2 (similar), above 1 class 3.
    turn : (float, float, float)
        Bearing, plunge and tilt of the fold, degrees.
    """
    slope *= rng.uniform(0.92, 1.05)
    amplitude = slope * length / (2 * np.pi)
    extra = thick * (1 + slope**2) ** ((1 - power) / 2)  # the longest section along the axial plane
    space = Space(
        (-200, -80, -amplitude - 2),
        (200, 80, amplitude + max(thick, extra) + 2),
        turn=turn,
        bearing=bearing,
        offset=UTM if bearing else (0.0, 0.0, 0.0),
    )
    phase = 2 * np.pi * space.x / length + rng.uniform(0, 2 * np.pi)
    dip = np.arctan(slope * np.cos(phase))
    tall = thick * np.cos(dip) ** (power - 1)
    level = (space.z - amplitude * np.sin(phase)) / tall
    return space.body(((level > 0) & (level < 1), level))


def _hairpin(
    rng: np.random.Generator,
    radius: float,
    thick: float,
    limb: float,
    turn: tuple[float, float, float],
    half: float = 70.0,
) -> FieldBlocks:
    """Return two parallel limbs joined by half a circle; ``radius`` is that of the mid surface."""
    out = radius + thick / 2 + 5
    a, b, c = turn
    turn = (a + float(rng.uniform(-8, 8)), b, c + float(rng.uniform(-5, 5)))
    space = Space((-limb, -half, -out), (out, half, out), turn=turn)
    x, z = space.x, space.z
    # The second limb is shorter, as one cut by a surface is.
    short = limb * rng.uniform(0.7, 0.9)
    t = np.where(x < 0, np.abs(z), np.hypot(np.maximum(x, 0), z)) - radius
    inside = (np.abs(t) < thick / 2) & ((z > 0) | (x > -short))
    return space.body((inside, t / thick + 0.5))


def _parallel(rng: np.random.Generator, kind: str) -> FieldBlocks:
    """Return a fold by flexural slip (class 1B)."""
    azimuth, vary = float(rng.uniform(-30, 30)), float(rng.uniform(0.95, 1.05))
    specs = {
        "upright": FoldSpec(
            description=kind,
            profile=Profile(elements=(Sinusoid(amplitude=50 * vary, wavelength=360 / vary),)),
            length=540, width=160, thickness=30, steps=(5, 5, 5), azimuth=azimuth,
            lattice_bearing=azimuth,
        ),
        "plunging": FoldSpec(
            description=kind,
            profile=Profile(elements=(Sinusoid(amplitude=70 * vary, wavelength=440),)),
            length=500, width=170, thickness=40, steps=(6, 6, 4), azimuth=azimuth,
            plunge=float(rng.uniform(15, 35)), lattice_bearing=20, offset=UTM,
        ),
        "overturned": FoldSpec(
            description=kind,
            profile=Profile(start=40, elements=(
                Bend(at=200, change=-120 * vary, radius=45), Bend(at=440, change=110, radius=50),
            )),
            length=620, width=130, thickness=30, steps=(5, 5, 5), azimuth=azimuth,
            plunge=float(rng.uniform(5, 20)), tilt=float(rng.uniform(10, 25)),
        ),
        "small": FoldSpec(
            description=kind,
            profile=Profile(start=50, elements=(
                Bend(at=90, change=-122 * vary, radius=30 * vary),
            )),
            length=200, width=110, thickness=25, steps=(5, 5, 5), azimuth=azimuth,
            tilt=float(rng.uniform(15, 30)),
        ),
        "small_plunging": FoldSpec(
            description=kind,
            profile=Profile(start=60, elements=(
                Bend(at=100, change=-128 * vary, radius=36 * vary),
            )),
            length=210, width=120, thickness=30, steps=(6, 6, 4), azimuth=azimuth,
            plunge=float(rng.uniform(20, 40)), tilt=float(rng.uniform(15, 30)), lattice_bearing=35,
        ),
    }  # fmt: skip
    return folded(specs[kind])


def _dome(rng: np.random.Generator) -> FieldBlocks:
    """Return a layer draped over a dome."""
    space = Space((-200, -150, -10), (200, 150, 100))
    a, b = rng.uniform(80, 100), rng.uniform(70, 90)
    t = space.z - rng.uniform(40, 55) * np.exp(-((space.x / a) ** 2) - (space.y / b) ** 2)
    return space.body(((t > 0) & (t < 25), t / 25))


def _body(name: str, family: str, builder: partial[FieldBlocks], about: str) -> FieldBody:
    return FieldBody(name=name, family=family, builder=builder, about=about)


BODIES = (
    _body("parallel", "fold", partial(_parallel, kind="upright"), "class 1B, upright"),
    _body("parallel_plunging", "fold", partial(_parallel, kind="plunging"),
          "class 1B, plunging, blocks 6 x 6 x 4, national grid"),
    _body("parallel_overturned", "fold", partial(_parallel, kind="overturned"),
          "class 1B, overturned limb"),
    _body("class_1c", "fold",
          partial(_similar, slope=1.2, power=0.5, thick=35.0, turn=(20.0, 20.0, 0.0)),
          "class 1C, plunging 20"),
    _body("similar", "fold", partial(_similar, slope=1.4, power=1.0, thick=45.0),
          "class 2, upright, hinges 45 m, limbs 26 m"),
    _body("similar_plunging", "fold",
          partial(_similar, slope=1.8, power=1.0, thick=50.0, turn=(15.0, 30.0, 0.0)),
          "class 2, plunging 30, hinges twice as thick as limbs"),
    _body("similar_overturned", "fold",
          partial(_similar, slope=1.6, power=1.0, thick=45.0, turn=(10.0, 0.0, 45.0), bearing=25.0),
          "class 2, overturned, national grid"),
    _body("isoclinal", "fold",
          partial(_similar, slope=3.2, power=1.0, thick=70.0, turn=(0.0, 20.0, 15.0), length=300.0),
          "class 2, isoclinal, plunging 20"),
    _body("class_3", "fold", partial(_similar, slope=1.1, power=2.0, thick=50.0),
          "class 3, thick hinges"),
    _body("thick_hinges", "fold", partial(_similar, slope=1.0, power=1.0, thick=80.0),
          "class 2, thicker than its waves are high"),
    _body("dome", "fold", partial(_dome), "draped over a dome"),
    _body("recumbent", "recumbent",
          partial(_hairpin, radius=45.0, thick=60.0, limb=200.0, turn=(0.0, 0.0, 0.0)),
          "recumbent, twelve blocks thick"),
    _body("recumbent_turned", "recumbent",
          partial(_hairpin, radius=40.0, thick=65.0, limb=180.0, turn=(25.0, 15.0, 10.0)),
          "recumbent, plunging, thirteen blocks thick"),
    _body("hairpin", "hairpin",
          partial(_hairpin, radius=25.0, thick=30.0, limb=260.0, turn=(0.0, 0.0, 90.0)),
          "upright, limbs four blocks apart"),
    _body("hairpin_tight", "hairpin",
          partial(_hairpin, radius=20.0, thick=27.0, limb=220.0, turn=(15.0, 10.0, 60.0)),
          "inclined, limbs 2.6 blocks apart"),
    _body("small_overturned", "small", partial(_parallel, kind="small"),
          "4,500 blocks, overturned"),
    _body("small_plunging", "small", partial(_parallel, kind="small_plunging"),
          "5,000 blocks, overturned, plunging"),
)  # fmt: skip
