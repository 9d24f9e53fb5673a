"""Attempts to fit the mid surface: a list, tried in order until the body does not contradict one.

No single fit to the hull suits every body.  Smoothing that evens out staircases straightens hinges
of few blocks' radius; a half thickness that is kept from bending ends before the rim of a lens.  So
the blocks judge each attempt.  Its measure is the contradiction:

- on a lattice, the mean depth, in blocks, of the lattice sites on the wrong side of the horizons
  after the sheet was sharpened by them; infinite if no site could be used;
- elsewhere, the mean distance, in blocks, by which blocks lie beyond the horizons.  Points that lie
  in layers sharpen the sheet, which then counts as not contradicted.

The first attempt whose contradiction is at most `HOLDS` is taken.  If there is none, the last
resort is taken, or the closer fit if it is contradicted clearly less.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from geounfold.backends.progress import told, within
from geounfold.errors import SplitError
from geounfold.geometry.mesh import Floats
from geounfold.methods.sheet.mid_surface.fit import (
    FitSettings,
    FittedSheet,
    HullSamples,
    fit_mid_surface,
)
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet
from geounfold.methods.sheet.sharpening.by_lattice_sites import enough_sites, sharpen
from geounfold.methods.sheet.sharpening.by_layers import sharpen_layers
from geounfold.methods.sheet.sharpening.lattice_sites import Sites
from geounfold.methods.sheet.sharpening.site_rules import SiteRules

HOLDS = 0.008
"""Contradiction, in blocks, up to which an attempt is taken.

Measured: 0.00002 to 0.006 for correct sheets, on lattices and elsewhere; 0.02 and more for sheets
that lost a limb.
"""

CLEARLY = 0.6
"""Share of the first attempt's contradiction that the closer fit must stay below to be taken.

Measured: 0.05 to 0.5 if the first attempt had lost a limb, 0.9 to 1.6 if the closer one had.
"""

TAPERING = 0.1
"""Relative standard deviation of the half thickness from which a body may taper to its rim."""

EXPLAINS_MORE = 1.4
"""Ratio of the hull explained, tapering to smooth, from which the tapering fit goes first."""

EXPLAINED = 0.4
"""Least share of the hull that the choosy fit has to explain to be tried on the lattice."""


@dataclass(frozen=True, eq=False)
class Case:
    """One body: the data that its mid surface is fitted to and judged by.

    Attributes
    ----------
    medial : MedialSheet
        First guess, in the unit of ``samples``.
    samples : HullSamples
        Vertices of the hull; in blocks, or in cells of ``unit`` blocks.
    cells : (k, 3) float
        Blocks, or merged blocks, in the same unit; the sheet must reach all of them.
    points : (n, 3) float
        Blocks, working units.
    find_sites : callable
        Returns the lattice sites at the body's surface; None off a lattice.
    unit : int
        Blocks along the side of a cell; 1 if blocks were not merged.
    judged : bool
        False if the samples are the true top and bottom, which blocks do not correct.
    smoothing : float
        Length below which the mid surface is smoothed, in blocks (see `FitSettings`).
    """

    medial: MedialSheet
    samples: HullSamples
    cells: Floats
    points: Floats
    find_sites: Callable[[], Sites | None]
    unit: int
    judged: bool
    smoothing: float

    def fit(self, settings: FitSettings) -> FittedSheet:
        """Return the sheet fitted to the hull, working units.

        Raises
        ------
        SplitError
            No hull vertex agrees with the sheet.
        """
        return fit_mid_surface(self.medial, self.samples, self.cells, settings).scaled(self.unit)

    def tried(self, settings: FitSettings) -> FittedSheet | None:
        """Return the sheet fitted to the hull; None if no hull vertex agrees with it."""
        try:
            return self.fit(settings)
        except SplitError:
            return None

    @cached_property
    def sites(self) -> Sites | None:
        """Lattice sites at the body's surface; None off a lattice."""
        return self.find_sites()

    @cached_property
    def smooth(self) -> FittedSheet:
        """The smooth fit, which the other attempts are compared with."""
        return self.fit(FitSettings(smooth=self.smoothing))

    @cached_property
    def tapering(self) -> FittedSheet | None:
        """The tapering fit; None if the body does not taper or it explains no more of the hull."""
        half = self.smooth.sheet.grid.value(self.smooth.half, self.smooth.near)
        if float(np.std(half)) <= TAPERING * float(np.mean(half)):
            return None
        found = self.tried(_tapering(self))
        explains = found is not None and found.accepted > EXPLAINS_MORE * self.smooth.accepted
        return found if explains else None

    @property
    def first(self) -> FitSettings:
        """The settings of the first attempt."""
        return FitSettings(smooth=self.smoothing) if self.tapering is None else _tapering(self)

    def judge(self, name: str, fitted: FittedSheet, rules: SiteRules) -> Trial:
        """Return the trial of a fit: sharpened by the blocks, with its contradiction."""
        if not self.judged:
            return Trial(name, fitted, 0.0)
        if self.sites is None:
            layered = sharpen_layers(fitted, self.points)
            if layered is not None:
                return Trial(name, layered, 0.0, "layers")
            return Trial(name, fitted, fitted.left_out(self.points) / fitted.unit)
        used = enough_sites(fitted, self.sites, rules)
        found = sharpen(fitted, used, rules)
        if found.sheet is None or found.depth > HOLDS:
            return Trial(name, fitted, found.depth, sites=used)
        sheet = _to_the_edges(found.sheet, used, rules) if found.leaves_out else found.sheet
        return Trial(name, sheet, found.depth, "sites", used)


@dataclass(frozen=True, eq=False)
class Trial:
    """The outcome of an attempt.

    Attributes
    ----------
    name : str
        Name of the attempt.
    fitted : FittedSheet
        The sheet; sharpened unless ``sharpened`` is empty.
    contradiction : float
        Contradiction, in blocks (see the module); infinite if no lattice site could be used, NaN if
        the attempt was not judged.
    sharpened : str
        What sharpened it: ``sites`` of the lattice, ``layers``, or nothing (empty).
    sites : Sites or None
        The lattice sites it was judged by.
    """

    name: str
    fitted: FittedSheet
    contradiction: float
    sharpened: str = ""
    sites: Sites | None = None

    @property
    def holds(self) -> bool:
        """Whether the contradiction is small enough for the attempt to be taken."""
        return self.contradiction <= HOLDS

    def row(self) -> dict[str, object]:
        """Return the figures for the summary."""
        return {
            "name": self.name,
            "explained": self.fitted.accepted,
            "contradiction": self.contradiction if np.isfinite(self.contradiction) else None,
            "sharpened": self.sharpened,
        }


def _to_the_edges(sheet: FittedSheet, sites: Sites, rules: SiteRules) -> FittedSheet:
    """Return a sharpened sheet made to follow the blocks where the layer thins to nothing.

    At first sites are used where the layer is two blocks thick and does not taper steeply: others
    mislead a sheet that is not near them yet, and speak against sheets that are right elsewhere.
    Where such a sheet leaves blocks out, it follows them: it ran straight on past a trough's
    feather edges, with a mean error of the level of 0.169 and 0.101, now 0.035 and 0.029. A sheet
    that the edges contradict stays as it is.
    """
    found = sharpen(sheet, sites, rules.to_the_edges())
    return sheet if found.sheet is None or found.depth > HOLDS else found.sheet


_RULES = SiteRules()


@dataclass(frozen=True)
class Attempt:
    """One way of fitting the mid surface.

    Attributes
    ----------
    name : str
        Shown in the summary.
    fit : callable
        ``fit(case)`` returns the sheet fitted to the hull, or None if the attempt does not suit
        the body.
    rules : SiteRules
        Which lattice sites judge it.
    needs_contradiction : bool
        Whether it is tried only if the first trial could be judged.
    """

    name: str
    fit: Callable[[Case], FittedSheet | None]
    rules: SiteRules = _RULES
    needs_contradiction: bool = False


def _tapering(case: Case) -> FitSettings:
    """Return settings for a half thickness that may taper all the way to the rim."""
    return FitSettings(smooth=case.smoothing, order_half=3, smooth_half=4.5)


def _choosy(case: Case) -> FittedSheet | None:
    """Fit to hull vertices whose normals agree more closely, so that no rim is taken for a horizon.

    Only on a lattice whose blocks were not merged, and if enough of the hull is explained.
    """
    if case.sites is None or case.unit > 1:
        return None
    found = case.tried(settings_of("choosy", case))
    return found if found is not None and found.accepted > EXPLAINED else None


def _closer(case: Case) -> FittedSheet | None:
    """Fit closer to the hull and let the sheet grow step by step.

    The smoothing that evens out staircases flattens a hinge of few blocks' radius.  The sheet then
    runs straight past the bend, rejects the hull there, and keeps its distance from it.  So it
    never reaches the body's ends, which in overturned folds are long wedges.
    """
    return case.tried(settings_of("closer", case))


def settings_of(name: str, case: Case) -> FitSettings:
    """Return the settings of an attempt, or of the last resort ``rough``, by its name."""
    if name == "smooth":
        return FitSettings(smooth=case.smoothing)
    if name == "closer":
        return FitSettings(
            smooth=1.0, rough=1.0, unseen=1e-4, rounds=8, later=0.7, erosion=0.75, ahead=2.0
        )
    if name == "rough":
        return replace(case.first, rough=_ROUGH)
    return replace(_tapering(case), agree=0.95) if name == "choosy" else _tapering(case)


ATTEMPTS = (
    Attempt("tapering", lambda case: case.tapering),
    Attempt("smooth", lambda case: case.smooth if case.tapering is None else None),
    Attempt("choosy", _choosy),
    Attempt("closer", _closer, SiteRules(sheared=1.0), needs_contradiction=True),
)
"""The attempts, in the order in which they are tried."""

_ROUGH = 1.25
"""Factor on the smoothing length on staircases, for the last resort on a lattice.

Lattice sites that contradict every attempt belong to a rougher body than a smooth sheet can follow.
"""


def try_in_turn(case: Case) -> tuple[Trial, tuple[Trial, ...]]:
    """Return the trial that is taken, and all trials in order.

    Raises
    ------
    SplitError
        No hull vertex agrees with a smooth sheet.
    """
    trials: list[Trial] = []
    for attempt in ATTEMPTS:
        if trials and attempt.needs_contradiction and not np.isfinite(trials[0].contradiction):
            continue
        before = 1 - 0.5 ** len(trials)  # most bodies need one attempt, few need all
        with within(before, (1 + before) / 2):
            fitted = attempt.fit(case)
            if fitted is None:
                continue
            told(0.6)
            trials.append(case.judge(attempt.name, fitted, attempt.rules))
        if trials[-1].holds:
            return trials[-1], tuple(trials)
    taken = _least_contradicted(case, trials)
    return taken, (*(t for t in trials if t is not taken), taken)


def _least_contradicted(case: Case, trials: list[Trial]) -> Trial:
    """Return the last resort, or the closer fit if it is contradicted clearly less."""
    first, last = trials[0], trials[-1]
    resort = first
    if case.sites is not None:
        rough = case.fit(settings_of("rough", case))
        resort = Trial("rough", rough, np.nan, sites=first.sites)
    if last.name != "closer" or last.contradiction > CLEARLY * first.contradiction:
        return resort
    left_out = (t.fitted.left_out(case.points) for t in (last, resort))
    return last if next(left_out) < next(left_out) else resort
