"""The simulated bodies that have names."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from geounfold.errors import OptionError, nearest
from geounfold.synthetic.body import Body
from geounfold.synthetic.fold_spec import FoldSpec
from geounfold.synthetic.outline import (
    Bulge,
    Ellipse,
    Embayment,
    Gap,
    Hole,
    Lens,
    Neck,
    ObliqueCut,
    Ragged,
    Swell,
    Wedge,
)
from geounfold.synthetic.profile import Bend, Profile, Sinusoid
from geounfold.synthetic.sampling import sample

_OPEN = Profile(elements=(Sinusoid(amplitude=48, wavelength=640),))
_LIMB70 = Profile(elements=(Sinusoid(amplitude=70, wavelength=880),))

_CASES = {
    # Two bodies with the thesis's point counts. Origin and pin are those of the first files of
    # these names, whose profile was tabulated every 45 mm from s = -150 to 750.
    "sim_case_1": FoldSpec(
        description="one open anticline, 60 x 60 x 6 blocks gridded before folding",
        profile=Profile(elements=(Sinusoid(amplitude=30, wavelength=1200, phase=90),)),
        length=600,
        width=600,
        thickness=60,
        grid="before",
        pin=0.0,
        origin=0.03,
    ),
    "sim_case_2": FoldSpec(
        description="anticline and syncline, 60 x 60 x 6 blocks gridded before folding",
        profile=Profile(elements=(Sinusoid(amplitude=50, wavelength=480),)),
        length=600,
        width=600,
        thickness=60,
        grid="before",
        pin=6.365731929,
        origin=0.03,
    ),
    "slab": FoldSpec(
        description="flat slab: unfolding must change nothing",
        profile=Profile(),
        length=500,
        width=400,
        thickness=60,
    ),
    "plunging": FoldSpec(
        description="fold that plunges 18 degrees towards 35 degrees, UTM coordinates",
        profile=_OPEN,
        length=820,
        width=380,
        thickness=100,
        azimuth=35,
        plunge=18,
        offset=(412_300.0, 6_815_750.0, 1_480.0),
    ),
    "steep": FoldSpec(
        description="limbs at 70 degrees",
        profile=_LIMB70,
        length=1100,
        width=420,
        thickness=90,
    ),
    "recumbent": FoldSpec(
        description="overturned fold, limbs at 105 degrees",
        profile=Profile(elements=(Sinusoid(amplitude=105, wavelength=1000),)),
        length=1500,
        width=300,
        thickness=90,
    ),
    "lens": FoldSpec(
        description="lens that pinches out on an elliptical outline",
        profile=_OPEN,
        length=860,
        width=560,
        thickness=Lens(120),
        outline=(Ellipse(),),
    ),
    "hole": FoldSpec(
        description="folded sheet with an elliptical hole through it",
        profile=_OPEN,
        length=820,
        width=540,
        thickness=100,
        outline=(Hole(at=(0.45, 0.5), size=(0.12, 0.18)),),
    ),
    "swelling": FoldSpec(
        description="thickness that pinches and swells by 25 percent",
        profile=_OPEN,
        length=840,
        width=440,
        thickness=Swell(94, 0.25),
    ),
    "thin": FoldSpec(
        description="sheet three blocks thick",
        profile=Profile(elements=(Sinusoid(amplitude=52, wavelength=840),)),
        length=1080,
        width=600,
        thickness=30,
    ),
    "noisy": FoldSpec(
        description="centroids disturbed by 0.12 blocks",
        profile=_OPEN,
        length=820,
        width=360,
        thickness=100,
        noise=0.12,
        seed=7,
    ),
    "flat_blocks": FoldSpec(
        description="blocks of 20 x 20 x 5",
        profile=_OPEN,
        length=820,
        width=360,
        thickness=100,
        steps=(20, 20, 5),
    ),
    "chevron": FoldSpec(
        description="chevron fold: straight limbs at 45 degrees, a hinge of radius 70",
        profile=Profile(start=45, elements=(Bend(at=350, change=-90, radius=70),)),
        length=700,
        width=400,
        thickness=80,
    ),
    "box": FoldSpec(
        description="box fold: flat crest, limbs at 75 degrees, hinges of radius 80",
        profile=Profile(
            elements=(
                Bend(at=200, change=75, radius=80),
                Bend(at=450, change=-75, radius=80),
                Bend(at=750, change=-75, radius=80),
                Bend(at=1000, change=75, radius=80),
            )
        ),
        length=1200,
        width=360,
        thickness=80,
    ),
    "tight_hinge": FoldSpec(
        description="hinge radius 48 at a half-thickness of 40",
        profile=Profile(start=55, elements=(Bend(at=350, change=-110, radius=48),)),
        length=700,
        width=360,
        thickness=80,
    ),
    "wedge": FoldSpec(
        description="wedge that thins from 120 to nothing",
        profile=_OPEN,
        length=820,
        width=420,
        thickness=Wedge(120),
    ),
    "bulge": FoldSpec(
        description="asymmetric thickness: a bulge on the top only",
        profile=_OPEN,
        length=820,
        width=460,
        thickness=Bulge(70, 40),
    ),
    "oblique_cut": FoldSpec(
        description="one end cut 60 degrees from the layers' normal",
        profile=_OPEN,
        length=820,
        width=400,
        thickness=90,
        outline=(ObliqueCut(60, "u1", setback=80),),
    ),
    "ragged": FoldSpec(
        description="ragged rim",
        profile=_OPEN,
        length=860,
        width=520,
        thickness=80,
        outline=(Ragged(70, 220, seed=3),),
    ),
    "embayment": FoldSpec(
        description="deep embayment in one side of the rim",
        profile=_OPEN,
        length=820,
        width=520,
        thickness=90,
        outline=(Embayment("v0", at=0.55, size=0.12, depth=0.6),),
    ),
    "neck": FoldSpec(
        description="two islands joined by a neck 150 wide",
        profile=_OPEN,
        length=900,
        width=480,
        thickness=70,
        outline=(Neck(0.25, 150),),
    ),
    "vertical": FoldSpec(
        description="sheet that stands on end: heading about 90 degrees",
        profile=Profile(start=90, elements=(Sinusoid(amplitude=30, wavelength=700),)),
        length=800,
        width=420,
        thickness=80,
    ),
    "hairpin": FoldSpec(
        description="folded through 200 degrees, the limbs' ends close",
        profile=Profile(start=100, elements=(Bend(at=500, change=-200, radius=90),)),
        length=1000,
        width=320,
        thickness=80,
    ),
    "refolded": FoldSpec(
        description="folded twice, about two axes: no exact flattening exists",
        profile=Profile(elements=(Sinusoid(amplitude=25, wavelength=800),)),
        refold=Profile(elements=(Sinusoid(amplitude=15, wavelength=1000),)),
        length=800,
        width=700,
        thickness=60,
    ),
    "rotated_lattice": FoldSpec(
        description="lattice turned by 27, 12 and 8 degrees, blocks of 12 x 8 x 6",
        profile=_OPEN,
        length=700,
        width=340,
        thickness=80,
        azimuth=60,
        steps=(12, 8, 6),
        lattice_bearing=27,
        lattice_plunge=12,
        lattice_dip=8,
        offset=(350_000.0, 7_400_000.0, 2_000.0),
    ),
    "incomplete": FoldSpec(
        description="five percent of the blocks and one slab of them missing",
        profile=_OPEN,
        length=820,
        width=380,
        thickness=90,
        missing=0.05,
        seed=11,
        outline=(Gap("v", 190, 200),),
    ),
    "fanned": FoldSpec(
        description="fan fold: overturned limbs that converge at 50 degrees below the crest",
        profile=Profile(
            elements=(
                Bend(at=200, change=115, radius=90),
                Bend(at=600, change=-115, radius=90),
                Bend(at=900, change=-115, radius=90),
                Bend(at=1300, change=115, radius=90),
            )
        ),
        length=1500,
        width=240,
        thickness=80,
    ),
    "refolded_tight": FoldSpec(
        description="folded twice, limbs at 40 and 25 degrees: no exact flattening exists",
        profile=Profile(elements=(Sinusoid(amplitude=40, wavelength=800),)),
        refold=Profile(elements=(Sinusoid(amplitude=25, wavelength=900),)),
        length=800,
        width=600,
        thickness=60,
    ),
    "sharp_hinge": FoldSpec(
        description="hinge radius 42 at a half-thickness of 40",
        profile=Profile(start=50, elements=(Bend(at=350, change=-100, radius=42),)),
        length=700,
        width=360,
        thickness=80,
    ),
    "touching": FoldSpec(
        description="folded through 220 degrees, the limbs' ends 1.6 blocks apart",
        profile=Profile(start=110, elements=(Bend(at=290, change=-220, radius=90),)),
        length=580,
        width=320,
        thickness=80,
    ),
    "cylinder": FoldSpec(
        description="closed tube: no flat image without a cut; truth is the tube cut open",
        profile=Profile(
            start=180,
            elements=(Bend(at=150 * np.pi, change=-360, radius=150, shape="arc"),),
        ),
        length=300 * np.pi,
        width=240,
        thickness=60,
        closed=True,
    ),
    "oblique_rims": FoldSpec(
        description="all four sides cut 30 to 55 degrees from the layers' normal",
        profile=_OPEN,
        length=900,
        width=520,
        thickness=80,
        outline=(
            ObliqueCut(50, "u0", setback=60),
            ObliqueCut(-40, "u1", setback=60),
            ObliqueCut(-55, "v0", setback=70),
            ObliqueCut(30, "v1", setback=40),
        ),
    ),
    "strip": FoldSpec(
        description="strip as wide as the layer is thick",
        profile=_OPEN,
        length=1800,
        width=80,
        thickness=80,
    ),
    "one_block": FoldSpec(
        description="sheet one block thick",
        profile=_OPEN,
        length=1300,
        width=900,
        thickness=10,
    ),
    "two_blocks": FoldSpec(
        description="sheet two blocks thick",
        profile=_OPEN,
        length=1200,
        width=800,
        thickness=20,
    ),
    "plates": FoldSpec(
        description="blocks of 40 x 40 x 4",
        profile=_OPEN,
        length=1600,
        width=1200,
        thickness=60,
        steps=(40, 40, 4),
    ),
    "slats": FoldSpec(
        description="blocks of 40 x 4 x 8, longest across the fold",
        profile=_OPEN,
        length=820,
        width=320,
        thickness=80,
        steps=(40, 4, 8),
    ),
    "rotated_plates": FoldSpec(
        description="lattice turned by 27, 12 and 8 degrees, blocks of 30 x 20 x 5",
        profile=_OPEN,
        length=1000,
        width=800,
        thickness=80,
        azimuth=60,
        steps=(30, 20, 5),
        lattice_bearing=27,
        lattice_plunge=12,
        lattice_dip=8,
    ),
    "sub_blocked": FoldSpec(
        description="parent blocks of 40 split in 2, 4 and 8 along each side near the surface",
        profile=_OPEN,
        length=820,
        width=400,
        thickness=130,
        steps=(40, 40, 40),
        sub_blocks=8,
    ),
    "scattered": FoldSpec(
        description="random points without a lattice, their density varying 5-fold",
        profile=_OPEN,
        length=820,
        width=400,
        thickness=90,
        grid="scattered",
        density=5,
        seed=5,
    ),
    "noisier": FoldSpec(
        description="centroids disturbed by 0.2 blocks",
        profile=_OPEN,
        length=820,
        width=360,
        thickness=100,
        noise=0.2,
        seed=8,
    ),
    "thin_wide": FoldSpec(
        description="wide sheet 3.3 blocks thick, 175,825 blocks",
        profile=Profile(elements=(Sinusoid(amplitude=40, wavelength=900),)),
        length=1616,
        width=3250,
        thickness=33,
    ),
    "large": FoldSpec(
        description="open folds, 300,000 blocks; blocks=N for any other size",
        profile=Profile(elements=(Sinusoid(amplitude=45, wavelength=900),)),
        length=2000,
        width=1500,
        thickness=100,
    ),
}

CASES: Mapping[str, FoldSpec] = MappingProxyType(_CASES)
"""Recipes of the named bodies, by name; read-only."""


def simulate(case: str | FoldSpec, *, blocks: int | None = None, **overrides: object) -> Body:
    """Return a simulated folded body with its exact truth.

    Parameters
    ----------
    case : str or FoldSpec
        A name in CASES, or a recipe.
    blocks : int, optional
        Number of blocks; the body is enlarged or reduced in its plane to hold about as many.
    **overrides
        Other values of FoldSpec fields, such as ``noise=0.1`` or ``steps=(5, 5, 2.5)``.

    Returns
    -------
    Body
        Equal input gives equal bodies, bit for bit.

    Raises
    ------
    OptionError
        A name is unknown (the message lists the valid ones), a value is outside its range, or the
        body is geometrically impossible or holds no block.

    Examples
    --------
    >>> body = simulate("sim_case_1")
    >>> body.folded.shape, body.truth[0].tolist()
    ((21600, 3), [5.0, 5.0, -25.0])
    """
    name = case if isinstance(case, str) else "custom"
    if isinstance(case, str) and case not in CASES:
        raise OptionError(
            f"no simulated body is named {case!r}{nearest(case, CASES)}; valid: {', '.join(CASES)}"
            "; simulate_faulted makes those with faults"
        )
    spec = CASES[case] if isinstance(case, str) else case
    spec = spec.with_options(**overrides)
    return sample(name, spec if blocks is None else spec.with_blocks(blocks))
