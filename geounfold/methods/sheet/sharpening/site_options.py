"""Options of the sharpening by lattice sites."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, kw_only=True)
class SiteOptions:
    """How the sheet is sharpened; lengths in blocks.

    ``margins``: softness of the separation, round by round; ``smooth``, ``least``: smoothing
    length of the mid surface, and what it is lowered to, by ``pace``, while more than
    ``tolerated`` of the sites lie on the wrong side and the margin is at most ``adapt``;
    ``smooth_half``: that of the half thickness; ``rim``: a site this near to an empty site
    inside the layer is the rim's, not a horizon's; ``depths``: how far below the horizon that
    is, round by round; ``thin``, ``cover``: where the half thickness is at most ``thin``, that
    is anywhere below the horizon but farther than ``cover`` along the sheet from any block;
    ``band``: largest distance of a site from its horizon; ``thinnest``, ``taper``: half
    thickness (or half of its median, where that is less) below which, and its slope above
    which, sites are left alone; ``slack``: how far
    sites past those limits are followed all the same, as the sheet moves; ``misfit``: mean
    depth on the wrong side above which the first fit is kept; ``enough``: sites per coefficient
    of the sheet up to which all are used, where blocks were merged; ``held``: whether steps are
    limited past the rim as well, where the sheet is but continued; ``sheared``: share of the
    slip by which the distance from the rim grows, as slip spreads the rim's sites along the
    unfolded layer.
    """

    margins: tuple[float, ...] = (0.3, 0.3, 0.15, 0.1, 0.06, 0.04, 0.03, 0.02, 0.02, 0.02)
    smooth: float = 2.7
    least: float = 1.73
    pace: float = 1.15
    tolerated: float = 0.03
    adapt: float = 0.06
    smooth_half: float = 3.5
    rim: float = 1.0
    depths: tuple[float, ...] = (1.25, 1.0, 0.75)
    band: float = 1.2
    thin: float = 1.25
    cover: float = 0.9
    thinnest: float = 1.0
    taper: float = 0.25
    slack: float = 0.5
    misfit: float = 0.01
    enough: int = 100
    held: bool = True
    sheared: float = 0.0

    def for_cells(self, side: float) -> SiteOptions:
        """Return the options for a sheet fitted to cells of merged blocks of some side.

        Such a sheet is farther off at first: the margins begin with wider ones.
        """
        if side <= 1:
            return self
        wider = self.margins[0] * side * 0.5 ** np.arange(np.ceil(np.log2(side)))
        return replace(self, margins=(*wider.tolist(), *self.margins), held=False)
