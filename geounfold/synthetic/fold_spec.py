"""The recipe of a simulated body."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.synthetic.outline import Even, Place, Region, Thickness
from geounfold.synthetic.profile import Profile, require_finite, require_positive

GRIDS = ("before", "after", "scattered")


@dataclass(frozen=True, kw_only=True)
class FoldSpec:
    """The recipe of a simulated body. All lengths are in one unit, which the user chooses.

    Parameters
    ----------
    description : str
        One line for lists.
    profile : Profile
        Heading of the mid surface along arc length, in the section across the fold axis.
    length, width : float
        The sheet's extent before folding, across and along the fold axis.
    thickness : float, Even, Lens, Swell, Wedge or Bulge
        Heights of bottom and top about the mid surface.
    outline : tuple of regions
        Ellipse, Hole, Ragged, Embayment, ObliqueCut, Neck, Gap; the body lies in all of them.
    steps : (float, float, float)
        Block sides along the lattice's axes; there is one scattered point per volume of a block.
    grid : {'before', 'after', 'scattered'}
        Blocks are regular before folding, or after it (as in a block model), or points are
        scattered at random without a lattice.
    azimuth, plunge, tilt : float
        Angles of the fold axis, degrees: bearing, plunge and dip of ``rotation_from_angles``.
    lattice_bearing, lattice_plunge, lattice_dip : float
        Angles of the lattice of a body gridded after folding, degrees, as those of the fold axis.
    offset : (float, float, float)
        World coordinates of the fold's and the lattice's origin.
    noise : float
        Standard deviation of the noise of each folded coordinate, in block sides; the truth has
        none.
    missing : float
        Share of the blocks left out at random, in [0, 1).
    seed : int
        Seed of noise, missing blocks and scattered points.
    pin : float or None
        Heading, degrees, at which layers do not slip; None for the mean heading.
    origin : float
        Arc length whose mid-surface point is the origin.
    refold : Profile or None
        A second fold, about the axis across the first one. With it no exact flattening exists;
        the truth keeps volumes, not lengths.
    sub_blocks : {1, 2, 4, 8}
        Number of smallest blocks along a parent's side. Blocks that the body's surface crosses are
        halved along every axis down to that number; ``steps`` are the parents' sides.
    density : float
        Highest over lowest density of scattered points, 1 or more.
    closed : bool
        Whether the profile ends where it starts, as a tube's does, and the body is whole there.
        A closed body has no flat image without a cut; the truth is that of the tube cut along the
        normals there.

    Raises
    ------
    OptionError
        A value is outside its valid ones.
    """

    description: str
    profile: Profile
    length: float
    width: float
    thickness: Thickness | float
    outline: tuple[Region, ...] = ()
    steps: tuple[float, float, float] = (10.0, 10.0, 10.0)
    grid: str = "after"
    azimuth: float = 0.0
    plunge: float = 0.0
    tilt: float = 0.0
    lattice_bearing: float = 0.0
    lattice_plunge: float = 0.0
    lattice_dip: float = 0.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: float = 0.0
    missing: float = 0.0
    seed: int = 0
    pin: float | None = None
    origin: float = 0.0
    refold: Profile | None = None
    sub_blocks: int = 1
    density: float = 1.0
    closed: bool = False

    def __post_init__(self) -> None:
        require_positive("length", self.length)
        require_positive("width", self.width)
        self._check_triples()
        for name in ("azimuth", "plunge", "tilt", "noise", "missing", "origin"):
            require_finite(name, getattr(self, name))
        for name in ("lattice_bearing", "lattice_plunge", "lattice_dip"):
            require_finite(name, getattr(self, name))
        if self.grid not in GRIDS:
            raise OptionError(f"grid {self.grid!r} is not one of: {', '.join(GRIDS)}")
        if self.noise < 0:
            raise OptionError(f"noise must not be negative, but is {self.noise!r}")
        if not 0 <= self.missing < 1:
            raise OptionError(f"missing is a share and must lie in [0, 1), not {self.missing!r}")
        if self.pin is not None:
            require_finite("pin", self.pin)
        if not isinstance(self.seed, int) or self.seed < 0:
            raise OptionError(f"seed must be a whole number from 0 up, not {self.seed!r}")
        self._check_parts()
        self._check_grid()

    def _check_grid(self) -> None:
        if self.sub_blocks not in (1, 2, 4, 8):
            raise OptionError(f"sub_blocks is not one of: 1, 2, 4, 8, but {self.sub_blocks!r}")
        if self.sub_blocks != 1 and self.grid != "after":
            raise OptionError(f"sub_blocks need the grid 'after', not {self.grid!r}")
        require_finite("density", self.density)
        if self.density < 1:
            raise OptionError(f"density is a ratio and must be 1 or more, not {self.density!r}")
        if self.density != 1 and self.grid != "scattered":
            raise OptionError(f"a density needs the grid 'scattered', not {self.grid!r}")
        plain = self.grid == "after" and self.refold is None and isinstance(self.shape, Even)
        if self.closed and not plain:
            raise OptionError("a closed body must be gridded after one fold and evenly thick")

    def _check_parts(self) -> None:
        for name in ("profile", "refold"):
            value = getattr(self, name)
            if not (isinstance(value, Profile) or (name == "refold" and value is None)):
                raise OptionError(f"{name} must be a Profile, not {value!r}")
        if not hasattr(self.thickness, "heights"):
            require_positive("thickness", self.thickness)
        if not all(hasattr(region, "keeps") for region in self.outline):
            raise OptionError(f"outline must be a tuple of regions, not {self.outline!r}")

    def _check_triples(self) -> None:
        for name in ("steps", "offset"):
            values = getattr(self, name)
            if np.shape(values) != (3,):
                raise OptionError(f"{name} must be three numbers, not {values!r}")
            for value in values:
                (require_positive if name == "steps" else require_finite)(name, value)

    @property
    def shape(self) -> Thickness:
        """The thickness as heights of bottom and top."""
        if isinstance(self.thickness, (int, float)):
            return Even(float(self.thickness))
        return self.thickness

    @property
    def developable(self) -> bool:
        """Whether an exact flattening exists: not if the body is folded twice, or closed."""
        twice = self.refold is not None and self.refold.elements and self.profile.elements
        return not (twice or self.closed)

    def with_options(self, **overrides: object) -> FoldSpec:
        """Return a copy with other values of some fields.

        Raises
        ------
        OptionError
            A name is no field, or a value is outside its valid ones.
        """
        names = [f.name for f in fields(self)]
        for name in overrides:
            if name not in names:
                raise OptionError(
                    f"unknown option {name!r} of a simulated body; valid: blocks, "
                    + ", ".join(names)
                )
        return replace(self, **overrides)  # type: ignore[arg-type]

    def with_blocks(self, blocks: int) -> FoldSpec:
        """Return the body enlarged or reduced in its plane to hold about so many blocks.

        Length and width are scaled. Sinusoids keep their wavelength; bends and bumps are
        stretched. In a sub-blocked body the parents are counted, and those at the surface count by
        the share of them in the body.

        Parameters
        ----------
        blocks : int
            Number of blocks wanted.
        """
        require_positive("blocks", blocks)
        spec = self
        for _ in range(3):
            factor = float(np.sqrt(blocks * np.prod(spec.steps) / volume(spec)))
            spec = replace(
                spec,
                length=spec.length * factor,
                width=spec.width * factor,
                profile=spec.profile.stretched(factor),
                refold=spec.refold and spec.refold.stretched(factor),
            )
        return spec


def volume(spec: FoldSpec) -> float:
    """Return the body's volume, by the midpoint rule over the sheet."""
    n = 400
    a, b = ((g.ravel() + 0.5) / n for g in np.meshgrid(*[np.arange(n)] * 2, indexing="ij"))
    low, high = spec.shape.heights(a, b)
    thick = np.where(keeps(spec, a * spec.length, b * spec.width, np.zeros(len(a))), high - low, 0)
    out = float(thick.mean() * spec.length * spec.width)
    if out <= 0:
        raise OptionError("the outline leaves nothing of the body")
    return out


def keeps(spec: FoldSpec, u: Floats, v: Floats, w: Floats) -> Bools:
    """Return which points, (n,), lie in the rectangle and in all regions of the outline."""
    place = Place(u, v, w, spec.length, spec.width)
    out: Bools = (u >= 0) & (u <= spec.length) & (v >= 0) & (v <= spec.width)
    for region in spec.outline:
        out &= region.keeps(place)
    return out
