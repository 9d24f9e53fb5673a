"""Rules: which lattice sites a horizon has to separate, and how softly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

DEPTHS = (1.25, 1.0, 0.75)
"""Depth below the horizon, in blocks, one per round, from which an empty site is a hole."""

RIM = 1.0
"""Distance from a hole, in blocks, up to which a site belongs to the rim, not to a horizon."""

COVER = 0.9
"""Distance along the sheet, in blocks, from the nearest block beyond which an empty site is a hole.

Used only if the layer is thin there (`SiteRules.thin`).
"""

BAND = 1.2
"""Largest distance of a used site from its horizon, in blocks."""

PINCHED = 0.25
"""Half thickness, in blocks, below which no site is used: the layer has pinched out there."""

FIRST_SMOOTH = 2.7
"""Smoothing length of the mid surface in the first round, in blocks."""

SLACK = 0.5
"""Distance, in blocks, past the used sites up to which others are updated as the sheet moves."""


@dataclass(frozen=True, kw_only=True)
class SiteRules:
    """The rules that depend on the body and on how its sheet was fitted; lengths in blocks.

    Attributes
    ----------
    margins : tuple of float
        Softness of the separation, one per round.
    thin : float
        Half thickness up to which the layer counts as thin.  Then an empty site below the horizon
        and far from any block is a hole, at any depth.
    thinnest : float
        Half thickness below which sites are not used.
    taper : float
        Slope of the half thickness above which sites are not used.
    held : bool
        Whether steps are also limited past the rim, over which the sheet is only continued.
    sheared : float
        Share of the slip added to the distance from the rim, because slip spreads the rim's sites
        along the unfolded layer.
    smooth : float
        Smoothing length of the mid surface in the first round.
    rim : float
        Distance from a hole up to which a site belongs to the rim, not to a horizon.
    """

    margins: tuple[float, ...] = (0.3, 0.3, 0.15, 0.1, 0.06, 0.04, 0.03, 0.02, 0.02, 0.02)
    thin: float = 1.25
    thinnest: float = 1.0
    taper: float = 0.25
    held: bool = True
    sheared: float = 0.0
    smooth: float = FIRST_SMOOTH
    rim: float = RIM

    def to_the_edges(self) -> SiteRules:
        """Return the rules that use the sites of feather edges and steep flanks too."""
        return replace(self, thinnest=PINCHED, taper=np.inf)

    def for_cells(self, side: float) -> SiteRules:
        """Return the rules for a sheet that was fitted to cells of ``side`` blocks.

        Such a sheet is farther off at first, so wider margins precede the others.
        """
        if side <= 1:
            return self
        wider = self.margins[0] * side * 0.5 ** np.arange(np.ceil(np.log2(side)))
        return replace(self, margins=(*wider.tolist(), *self.margins), held=False)
