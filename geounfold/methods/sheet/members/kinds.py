"""What coordinates leave open about a sheet: one kind of member per question.

A member answers one question otherwise than the sheet method did and leaves all else.  Some are
another mid surface over the same parameters, fitted from the answer's; others follow from the
answer's mid surface without a fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.geometry.mesh import Bools, Floats
from geounfold.methods.sheet.attempts import Case, Trial, settings_of
from geounfold.methods.sheet.members.flat_places import FlatPlaces
from geounfold.methods.sheet.mid_surface.fit import FitSettings, FittedSheet, HullSamples
from geounfold.methods.sheet.sharpening.by_lattice_sites import sharpen
from geounfold.methods.sheet.sharpening.by_layers import sharpen_layers
from geounfold.methods.sheet.sharpening.lattice_sites import Sites
from geounfold.methods.sheet.sharpening.site_rules import RIM, SiteRules

_AGAIN = (0.06, 0.04, 0.03, 0.02)
"""Softness of the separation in the rounds of a member, in blocks: the last ones of the answer."""

_AFRESH = (0.15, 0.1, *_AGAIN)
"""The same for a member whose mid surface is fitted to the hull first."""

_IN_CELL = 0.29
"""Standard deviation of a place drawn evenly in its cell, in sides of the cell: 1 / sqrt(12)."""

_WAVES, _LONGEST, _SHORTEST = 24, 40.0, 6.0
"""Number of waves of a smooth random field, and their lengths in blocks.

Sites drawn one by one average out; what a lattice hides is shared by neighbouring sites.
"""

_PATCH = (12.0, 5.0)
"""Longest and shortest wave of the field whose peaks are patches of the surface left out, blocks.

Its 0.4 upper quantile leaves out a third.
"""

_LEFT_OUT = 0.4
"""Value of that field, whose variance is 1, from which sites are left out."""

_STIFFER, _SOFTER = 1.5, 1.4
"""Factor on the smoothing length of the mid surface, and divisor."""

_WIDE_RIM = 2.5
"""Distance from a hole, in blocks, up to which sites belong to the rim; the answer's is 1."""

_WIDE_EROSION, _WIDER_EROSION = 1.5, 2.0
"""Factors on the distance kept from rejected hull vertices."""

_CHOOSY = 0.97
"""Least cosine between the normals of a hull vertex and of the sheet; the answer's is 0.93."""


def smooth_field(points: Floats, seed: int, lengths: tuple[float, float], parts: int = 3) -> Floats:
    """Return smooth random fields of variance 1 at points (n, 3), (n, parts).

    Sums of plane waves: the value depends on the place and the seed, not on the row.

    Parameters
    ----------
    points : (n, 3) float
        Places, working units.
    seed : int
        Chooses the field.
    lengths : (float, float)
        Longest and shortest wave, in blocks.
    parts : int
        Number of fields.
    """
    rng = np.random.default_rng(seed)
    out = np.empty((len(points), parts))
    for part in range(parts):
        way = rng.normal(size=(_WAVES, 3))
        way /= np.linalg.norm(way, axis=1)[:, None]
        longest, shortest = np.log(lengths)
        length = np.exp(rng.uniform(shortest, longest, _WAVES))
        start = rng.uniform(0, 2 * np.pi, _WAVES)
        phase = points @ (2 * np.pi * way / length[:, None]).T + start
        out[:, part] = np.cos(phase).sum(axis=1) * np.sqrt(2 / _WAVES)
    return out


@dataclass(frozen=True, eq=False)
class Base:
    """The answer that members depart from.

    Attributes
    ----------
    case : Case
        What the mid surface was fitted to.
    trial : Trial
        The fit that was taken.
    steps : (3,) float
        Sides of a cell, working units; (1, 1, 1) off a lattice.
    places : FlatPlaces
        Places of the blocks.
    """

    case: Case
    trial: Trial
    steps: Floats
    places: FlatPlaces

    @property
    def settings(self) -> FitSettings:
        """How the mid surface was fitted to the hull."""
        return settings_of(self.trial.name, self.case)

    @property
    def by_sites(self) -> bool:
        """Whether lattice sites sharpened the answer."""
        return self.trial.sharpened == "sites" and self.trial.sites is not None

    def separated(
        self,
        sites: Sites,
        start: FittedSheet | None = None,
        *,
        factor: float = 1.0,
        rim: float = RIM,
        sheared: float = 0.0,
    ) -> FittedSheet | None:
        """Return the mid surface sharpened again by sites; None if that fails.

        Parameters
        ----------
        sites : Sites
            Lattice sites to separate.
        start : FittedSheet, optional
            What to sharpen; the answer's mid surface if not given.
        factor : float
            Factor on the answer's smoothing length.
        rim, sheared : float
            As in `SiteRules`.
        """
        fitted = self.trial.fitted
        margins = _AGAIN if start is None else _AFRESH
        rules = SiteRules(
            margins=margins, smooth=factor * fitted.smoothing, rim=rim, sheared=sheared
        )
        return sharpen(start or fitted, sites, rules).sheet

    def refitted(
        self,
        settings: FitSettings,
        samples: HullSamples | None = None,
        points: Floats | None = None,
    ) -> FittedSheet | None:
        """Return the mid surface fitted again to the hull; None if that fails.

        If points in layers sharpened the answer, they settle what the hull leaves open: the sheet
        is sharpened again by the ``points`` given, or stays as it is.
        """
        if self.trial.sharpened == "layers":
            fitted = self.trial.fitted
            return fitted if points is None else sharpen_layers(fitted, points)
        case = self.case if samples is None else replace(self.case, samples=samples)
        return case.tried(settings)


def in_cell(base: Base, seed: int) -> FittedSheet | None:
    """Shift the surface's sites, or the hull, smoothly within their cells.

    Points in layers measure the surface themselves; of them a half is drawn.
    """
    if base.trial.sharpened == "layers":
        points = base.case.points
        half = smooth_field(points, seed, (_SHORTEST, _SHORTEST / 6), 1)[:, 0] > 0
        return sharpen_layers(base.trial.fitted, points[half])
    if base.by_sites and base.trial.sites is not None:
        sites = base.trial.sites
        shift = _IN_CELL * base.steps * smooth_field(sites.points, seed, (_LONGEST, _SHORTEST))
        return base.separated(Sites(sites.points + shift, sites.occupied))
    samples, unit = base.case.samples, base.case.unit
    shift = _IN_CELL * smooth_field(samples.points * unit, seed, (_LONGEST, _SHORTEST)) / unit
    return base.refitted(base.settings, replace(samples, points=samples.points + shift))


def stiffness(base: Base, seed: int) -> FittedSheet | None:
    """Smooth the mid surface over a longer length, or over a shorter one (odd seeds)."""
    factor = 1 / _SOFTER if seed % 2 else _STIFFER
    if base.by_sites and base.trial.sites is not None:
        return base.separated(base.trial.sites, factor=factor)
    settings = base.settings
    return base.refitted(replace(settings, smooth=settings.smooth * factor))


def rim(base: Base, seed: int) -> FittedSheet | None:
    """Take more of the border for rim: as far as slip spreads it, or a wider one (odd seeds)."""
    if base.by_sites and base.trial.sites is not None:
        if seed % 2:
            return base.separated(base.trial.sites, rim=_WIDE_RIM)
        return base.separated(base.trial.sites, sheared=1.0)
    factor = _WIDER_EROSION if seed % 2 else _WIDE_EROSION
    settings = base.settings
    return base.refitted(replace(settings, erosion=factor * settings.erosion))


def sides(base: Base, seed: int) -> FittedSheet | None:
    """Leave hull vertices whose side is in doubt to neither side, from the first guess on."""
    settings = replace(base.settings, agree=_CHOOSY)
    if base.by_sites and base.trial.sites is not None:
        start = base.case.tried(settings)
        return None if start is None else base.separated(base.trial.sites, start)
    return base.refitted(settings)


def left_out(base: Base, seed: int) -> FittedSheet | None:
    """Leave out patches of the surface, as if the blocks there were filled in or missing."""
    if base.by_sites and base.trial.sites is not None:
        sites = base.trial.sites
        kept = _kept(sites.points, seed)
        return base.separated(Sites(sites.points[kept], sites.occupied[kept]))
    samples, unit = base.case.samples, base.case.unit
    points = base.case.points
    return base.refitted(
        base.settings,
        samples.part(_kept(samples.points * unit, seed)),
        points[_kept(points, seed)] if base.trial.sharpened == "layers" else None,
    )


def _kept(points: Floats, seed: int) -> Bools:
    return np.asarray(smooth_field(points, seed, _PATCH, 1)[:, 0] < _LEFT_OUT)


def hull_level(base: Base, seed: int) -> FittedSheet | None:
    """Take the blurred hull for the surface, not the sites that sharpened it."""
    return base.case.smooth if base.trial.sharpened != "layers" else base.trial.fitted


def pin_line(base: Base, flat: Floats) -> Floats:
    """Move the pin line until layers slip by a tenth of their height, along the section."""
    out: Floats = flat.copy()
    out[:, :2] += _PIN * flat[:, 2:] * base.places.profile.axes[0]
    return out


def no_slip(base: Base, flat: Floats) -> Floats:
    """Let layers flow without slip: normals of the mid surface stay normals."""
    out: Floats = flat.copy()
    out[:, :2] -= flat[:, 2:] * (base.places.weights @ base.places.slope(base.trial.fitted))
    return out


_PIN = 0.1
"""Slip per height by which the pin line is moved; the calibration gives it its weight."""
