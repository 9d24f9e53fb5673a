"""Families of random bodies, and the draws of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from geounfold.synthetic.fold_spec import FoldSpec
from geounfold.synthetic.outline import (
    Bulge,
    Ellipse,
    Embayment,
    Even,
    Gap,
    Hole,
    Lens,
    Neck,
    ObliqueCut,
    Ragged,
    Region,
    Swell,
    Thickness,
    Wedge,
)
from geounfold.synthetic.profile import Bend, Bump, Profile, Sinusoid

BLOCKS = (2_000, 12_000)
"""Fewest and most blocks of a random body."""

BREADTH = 2.5  # least extent of a sheet over its greatest thickness; strips are exempt


@dataclass
class _Draft:
    """A recipe under construction. ``side`` is that of a cube with one block's volume."""

    rng: np.random.Generator
    side: float
    blocks: float
    thick: float
    length: float
    profile: Profile = field(default_factory=Profile)
    width: float | None = None
    shape: Thickness | None = None
    outline: list[Region] = field(default_factory=list)
    ratios: tuple[float, float, float] = (1.0, 1.0, 1.0)
    options: dict[str, object] = field(default_factory=dict)

    def between(self, low: float, high: float) -> float:
        """Return a uniformly drawn number, to four digits."""
        return float(f"{self.rng.uniform(low, high):.4g}")

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def sign(self) -> float:
        return 1.0 if self.chance(0.5) else -1.0

    @property
    def steps(self) -> tuple[float, float, float]:
        """Block sides of the drawn ratios, with the volume of ``side`` cubed."""
        whole = np.array(self.ratios) * self.side / np.cbrt(np.prod(self.ratios))
        a, b, c = (float(f"{x:.4g}") for x in whole)
        return a, b, c

    def across(self) -> float:
        """Return the sheet's extent along the fold axis: as wide as its blocks allow."""
        if self.width is not None:
            return self.width
        return self.blocks * self.side**3 / (self.thick * self.length)

    def spec(self, family: str, seed: int) -> FoldSpec:
        spec = FoldSpec(
            description=family,
            profile=self.profile,
            length=self.length,
            width=float(f"{self.across():.4g}"),
            thickness=self.shape or Even(self.thick),
            outline=tuple(self.outline),
            steps=self.steps,
            seed=seed,
            **self.options,  # type: ignore[arg-type]
        )
        return replace(spec, description=", ".join([family, *self.traits(spec)]))

    def traits(self, spec: FoldSpec) -> Iterator[str]:
        """Yield the parts of a recipe's description that follow its family."""
        hinges = [e.radius for e in spec.profile.elements if isinstance(e, Bend)]
        if hinges:
            yield f"hinge radius {min(hinges) / (self.thick / 2):.2f} half-thicknesses"
        yield f"{self.thick / self.side:.1f} blocks thick"
        parts = [*([self.shape] if self.shape else []), *self.outline]
        yield from sorted({type(part).__name__.lower() for part in parts})
        if len(set(spec.steps)) > 1:
            yield "blocks of " + " x ".join(f"{x:.3g}" for x in spec.steps)
        for name in ("density", "sub_blocks", "noise", "missing"):
            if getattr(spec, name) not in (0.0, 1.0):
                yield f"{name.replace('_', '-')} {getattr(spec, name):.3g}"
        if spec.azimuth or spec.plunge or spec.tilt:
            yield "fold turned"
        if spec.lattice_bearing or spec.lattice_plunge or spec.lattice_dip:
            yield "lattice turned"
        if any(spec.offset):
            yield "far from the origin"


def common_draws(rng: np.random.Generator) -> _Draft:
    """Return a draft of a common body; each unusual property is drawn with a small chance."""
    side = float(f"{10 ** rng.uniform(-0.5, 1.7):.3g}")
    blocks = rng.uniform(2_500, 11_000)
    thick = float(f"{side * rng.uniform(4, 8):.4g}")
    across = np.sqrt(blocks * side**3 / thick)  # of a square sheet
    draft = _Draft(rng, side, blocks, thick, float(f"{across * rng.uniform(0.9, 1.8):.4g}"))
    _wave(draft, 10, 55)
    if draft.chance(0.2):
        _bumps(draft)
    if draft.chance(0.2):
        rng.choice(np.array([_swell, _bulge, _wedge], object))(draft)
    if draft.chance(0.2):
        rng.choice(np.array([_hole, _embayment, _ragged, _oblique], object))(draft)
    if draft.chance(0.25):
        draft.ratios = (draft.between(0.7, 1.5), draft.between(0.7, 1.5), draft.between(0.5, 1))
    _placed(draft)
    if draft.chance(0.15):
        _noise(draft, 0.02, 0.12)
    if draft.chance(0.1):
        draft.options["missing"] = draft.between(0.005, 0.05)
    return draft


def _placed(draft: _Draft) -> None:
    """Turn the fold and the lattice, each by chance, and move both into the world."""
    options = draft.options
    if draft.chance(0.5):
        options["azimuth"] = draft.between(-180, 180)
        options["plunge"] = draft.between(-50, 50)
        options["tilt"] = draft.between(-90, 90)
    if draft.chance(0.25):
        _turned_lattice(draft)
    if draft.chance(0.5):
        options["offset"] = (
            float(np.round(draft.rng.uniform(2e5, 8e5), 1)),
            float(np.round(draft.rng.uniform(1e6, 9e6), 1)),
            float(np.round(draft.rng.uniform(-500, 4000), 1)),
        )


def _noise(draft: _Draft, low: float, high: float) -> None:
    draft.options["noise"] = draft.between(low, high)


def _wave(draft: _Draft, low: float, high: float) -> None:
    """Fold by a sinusoid whose hinges are at least 1.6 half-thicknesses round."""
    amplitude = draft.between(low, high)
    roundest = 1.6 * draft.thick / 2 * 2 * np.pi * np.radians(amplitude)
    wavelength = max(draft.between(0.6, 2) * draft.length, roundest)
    wave = Sinusoid(
        amplitude=amplitude, wavelength=float(f"{wavelength:.4g}"), phase=draft.between(0, 360)
    )
    draft.profile = Profile(elements=(wave,))


def _hinged(draft: _Draft, start: float, hinges: Sequence[tuple[float, float]]) -> None:
    """Fold by hinges (change in degrees, radius in half-thicknesses), limbs of random lengths."""
    place, bends = 0.0, []
    for change, radius in hinges:
        bend = Bend(at=0.0, change=change, radius=float(f"{radius * draft.thick / 2:.4g}"))
        place += draft.between(0.4, 2) * draft.thick + bend.extent / 2
        at = float(f"{place:.4g}")
        bends.append(Bend(at=at, change=change, radius=bend.radius))
        place = at + bend.extent / 2
    draft.profile = Profile(start=start, elements=tuple(bends))
    draft.length = float(f"{place + draft.between(0.4, 2) * draft.thick:.4g}")


def _flat(draft: _Draft) -> None:
    draft.profile = Profile(start=draft.between(-90, 90) if draft.chance(0.5) else 0.0)


def _open(draft: _Draft) -> None:
    _wave(draft, 10, 50)


def _steep(draft: _Draft) -> None:
    _wave(draft, 55, 85)


def _overturned(draft: _Draft) -> None:
    _wave(draft, 90, 112)


def _bumps(draft: _Draft) -> None:
    count = int(draft.rng.integers(2, 5))
    bumps = [
        Bump(
            at=draft.between(0, 1) * draft.length,
            amplitude=draft.between(-45, 45),
            width=draft.between(0.1, 0.3) * draft.length,
        )
        for _ in range(count)
    ]
    draft.profile = Profile(elements=tuple(bumps), start=draft.between(-20, 20))


def _vertical(draft: _Draft) -> None:
    _wave(draft, 10, 40)
    draft.profile = Profile(start=draft.between(80, 100), elements=draft.profile.elements)
    for name in ("azimuth", "plunge", "tilt"):
        draft.options.pop(name, None)


def _chevron(draft: _Draft) -> None:
    limb = draft.between(25, 65) * draft.sign()
    count = int(draft.rng.integers(1, 4))
    radius = draft.between(1.4, 2.5)
    _hinged(draft, limb, [((-1) ** (k + 1) * 2 * limb, radius) for k in range(count)])


def _box(draft: _Draft) -> None:
    dip, radius = draft.between(50, 90) * draft.sign(), draft.between(1.4, 2.2)
    _hinged(draft, 0.0, [(dip, radius), (-dip, radius), (-dip, radius), (dip, radius)])


def _fan(draft: _Draft) -> None:
    dip, radius = draft.between(95, 120) * draft.sign(), draft.between(1.5, 2.2)
    draft.thick = min(draft.thick, 5 * draft.side)
    _hinged(draft, dip, [(-dip, radius), (-dip, radius)])


def _hairpin(draft: _Draft) -> None:
    change = draft.between(185, 240) * draft.sign()
    _hinged(draft, change / 2, [(-change, draft.between(1.5, 2.6))])


def _tight_hinge(draft: _Draft) -> None:
    change, radius = draft.between(50, 130) * draft.sign(), draft.between(1.03, 1.4)
    _hinged(draft, change / 2, [(-change, radius)])
    draft.shape = None


def _refolded(draft: _Draft) -> None:
    _wave(draft, 8, 35)
    across = draft.blocks * draft.side**3 / (draft.thick * draft.length)
    wave = Sinusoid(
        amplitude=draft.between(5, 20),
        wavelength=draft.between(1.2, 2.5) * max(across, draft.length),
        phase=draft.between(0, 360),
    )
    draft.options["refold"] = Profile(elements=(wave,))


def _tube(draft: _Draft) -> None:
    radius = draft.between(1.8, 3) * draft.thick
    draft.profile = Profile(
        start=180, elements=(Bend(at=np.pi * radius, change=-360, radius=radius, shape="arc"),)
    )
    draft.length = 2 * np.pi * radius
    draft.shape, draft.outline = None, []
    draft.options["closed"] = True


def _lens(draft: _Draft) -> None:
    draft.shape = Lens(1.6 * draft.thick)
    draft.blocks *= 1.2
    draft.outline = [Ellipse()]


def _wedge(draft: _Draft) -> None:
    draft.shape = Wedge(1.4 * draft.thick, draft.between(0, 0.5) * draft.thick)


def _swell(draft: _Draft) -> None:
    cycles = (draft.between(0.5, 2), draft.between(0.5, 1.5))
    draft.shape = Swell(draft.thick, draft.between(0.1, 0.35), cycles)


def _bulge(draft: _Draft) -> None:
    draft.shape = Bulge(
        0.8 * draft.thick,
        draft.between(0.2, 0.6) * draft.thick,
        at=(draft.between(0.3, 0.7), draft.between(0.3, 0.7)),
        size=(draft.between(0.12, 0.25), draft.between(0.15, 0.3)),
        side="top" if draft.chance(0.5) else "bottom",
    )


def _ellipse(draft: _Draft) -> None:
    draft.outline = [Ellipse()]
    draft.blocks *= 1.2


def _hole(draft: _Draft) -> None:
    at = (draft.between(0.35, 0.65), draft.between(0.35, 0.65))
    draft.outline = [Hole(at=at, size=(draft.between(0.1, 0.2), draft.between(0.1, 0.2)))]


def _embayment(draft: _Draft) -> None:
    side = str(draft.rng.choice(["u0", "u1", "v0", "v1"]))
    draft.outline = [
        Embayment(
            side, draft.between(0.35, 0.65), draft.between(0.08, 0.2), draft.between(0.3, 0.65)
        )
    ]


def _ragged(draft: _Draft) -> None:
    scale = draft.between(0.3, 0.6) * draft.length
    depth = draft.between(0.1, 0.25) * min(draft.length, draft.across())
    draft.outline = [Ragged(depth, scale, seed=int(draft.rng.integers(1000)))]


def _oblique(draft: _Draft) -> None:
    sides = draft.rng.permutation(["u0", "u1", "v0", "v1"])[: draft.rng.integers(1, 5)]
    cuts = [draft.between(-60, 60) for _ in sides]
    draft.outline = [
        ObliqueCut(angle, str(side), setback=draft.thick / 2 * abs(np.tan(np.radians(angle))))
        for side, angle in zip(sides, cuts, strict=True)
    ]


def _neck(draft: _Draft) -> None:
    breadth = max(5 * draft.side, draft.between(0.25, 0.5) * draft.across())
    draft.outline = [Neck(draft.between(0.15, 0.35), breadth)]


def _regular_before(draft: _Draft) -> None:
    draft.options["grid"] = "before"


def _thin(draft: _Draft) -> None:
    draft.thick = float(draft.rng.integers(2, 4)) * draft.side
    draft.ratios = (1.0, 1.0, 1.0)
    _sheet_again(draft)


def _one_block(draft: _Draft) -> None:
    draft.thick = draft.side
    draft.ratios = (1.0, 1.0, 1.0)
    _sheet_again(draft)


def _sheet_again(draft: _Draft) -> None:
    """Give a draft with a new thickness an even sheet, as wide as its blocks allow."""
    draft.shape, draft.outline = None, []
    square = float(np.sqrt(draft.blocks * draft.side**3 / draft.thick))
    draft.length = float(f"{square * draft.between(0.9, 1.8):.4g}")
    _wave(draft, 10, 55)


def _strip(draft: _Draft) -> None:
    draft.shape, draft.outline = None, []
    draft.width = draft.between(0.6, 1.0) * draft.thick
    draft.length = draft.blocks * draft.side**3 / (draft.thick * draft.width)
    draft.profile = Profile(
        elements=(
            Sinusoid(
                amplitude=draft.between(10, 55),
                wavelength=draft.between(8, 16) * draft.thick,
                phase=draft.between(0, 360),
            ),
        )
    )


def _along_lattice(draft: _Draft) -> None:
    """Turn the lattice as the body, so that the blocks' long sides lie in the layers."""
    for fold, lattice in (
        ("azimuth", "lattice_bearing"),
        ("plunge", "lattice_plunge"),
        ("tilt", "lattice_dip"),
    ):
        draft.options.pop(lattice, None)
        if fold in draft.options:
            draft.options[lattice] = draft.options[fold]


def _plates(draft: _Draft) -> None:
    flat = draft.between(4, 10)
    draft.ratios = (flat, flat, 1.0)
    _along_lattice(draft)


def _slats(draft: _Draft) -> None:
    long = draft.between(4, 10)
    draft.ratios = (long, 1.0, draft.between(1, 2))
    if draft.chance(0.5):
        draft.ratios = (draft.ratios[1], draft.ratios[0], draft.ratios[2])
    _along_lattice(draft)


def _turned_lattice(draft: _Draft) -> None:
    draft.options["lattice_bearing"] = draft.between(-90, 90)
    draft.options["lattice_plunge"] = draft.between(-40, 40)
    draft.options["lattice_dip"] = draft.between(-40, 40)


def _rotated_lattice(draft: _Draft) -> None:
    draft.ratios = (draft.between(1, 3), draft.between(1, 3), 1.0)
    _turned_lattice(draft)


def _sub_blocked(draft: _Draft) -> None:
    halvings = int(draft.rng.integers(1, 4))
    draft.options["sub_blocks"] = 2**halvings
    # A parent at the surface becomes about 4, 17 or 70 blocks; one inside stays whole.
    draft.ratios = (1.0, 1.0, 1.0)
    parents = (1.6, 2.4, 3.6)[halvings - 1]
    draft.thick *= parents / 1.6
    draft.side *= parents
    draft.blocks /= (2.5, 9, 55)[halvings - 1]
    draft.length *= draft.between(1.0, 1.4)
    _wave(draft, 10, 50)
    draft.shape, draft.outline = None, []


def _scattered(draft: _Draft) -> None:
    draft.options["grid"] = "scattered"
    draft.options["density"] = draft.between(1, 5)
    draft.ratios = (1.0, 1.0, 1.0)
    draft.options.pop("noise", None)


def _noisy(draft: _Draft) -> None:
    _noise(draft, 0.1, 0.2)


def _incomplete(draft: _Draft) -> None:
    draft.options["missing"] = draft.between(0.03, 0.08)
    axis = "u" if draft.chance(0.5) else "v"
    extent = draft.length if axis == "u" else draft.across()
    low = draft.between(0.3, 0.7) * extent
    draft.outline = [*draft.outline, Gap(axis, low, low + draft.side)]


RECIPES: Mapping[str, Callable[[_Draft], None]] = MappingProxyType(
    {
        "flat": _flat,
        "open": _open,
        "steep": _steep,
        "overturned": _overturned,
        "bumps": _bumps,
        "vertical": _vertical,
        "chevron": _chevron,
        "box": _box,
        "fan": _fan,
        "hairpin": _hairpin,
        "tight hinge": _tight_hinge,
        "refolded": _refolded,
        "tube": _tube,
        "lens": _lens,
        "wedge": _wedge,
        "swell": _swell,
        "bulge": _bulge,
        "ellipse": _ellipse,
        "hole": _hole,
        "embayment": _embayment,
        "ragged": _ragged,
        "oblique": _oblique,
        "neck": _neck,
        "regular before": _regular_before,
        "thin": _thin,
        "one block": _one_block,
        "strip": _strip,
        "plates": _plates,
        "slats": _slats,
        "rotated lattice": _rotated_lattice,
        "sub-blocked": _sub_blocked,
        "scattered": _scattered,
        "noisy": _noisy,
        "incomplete": _incomplete,
    }
)

FAMILIES: tuple[str, ...] = tuple(RECIPES)
"""Families of random bodies, named after their unusual property."""
