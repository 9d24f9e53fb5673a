"""Options of the sheet method's stages."""

from __future__ import annotations

from dataclasses import dataclass, field

from geounfold.body.merged_blocks import MERGE_ABOVE
from geounfold.errors import OptionError
from geounfold.methods.sheet.meshing.build import ControlOptions
from geounfold.methods.sheet.meshing.top_and_bottom import HorizonOptions
from geounfold.methods.sheet.mid_surface.fit import CloserFitOptions, FitOptions
from geounfold.methods.sheet.mid_surface.medial_points import MedialOptions
from geounfold.methods.sheet.mid_surface.parallel_surface import ConformOptions
from geounfold.methods.sheet.sharpening.by_layers import LayerOptions
from geounfold.methods.sheet.sharpening.site_options import SiteOptions


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """Options of every stage of the sheet method; lengths in blocks.

    ``refused_rough``: the fit's ``rough`` where lattice sites do not agree with a smooth sheet.
    Before that, and where the half thickness differs by more than ``tapering`` (standard
    deviation over mean), another fit is tried that keeps the third differences of the half
    thickness small, to ``taper_half`` instead of ``smooth_half``.  It is taken where it explains
    ``taper_gain`` times as much of the hull, or, with the fit's ``agree`` raised to
    ``refused_agree``, where it explains ``refused_share`` of the hull and lattice sites agree
    with it.  ``closer``: how the sheet is fitted where they agree with neither, or, of points on
    no lattice, where they lie ``left_out`` blocks and more beyond it on average; ``sheared``:
    see OccupancyOptions, of the sheet so fitted.  ``merge_above``: number of blocks up to which
    none are merged into larger cells.
    """

    medial: MedialOptions = field(default_factory=MedialOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    occupancy: SiteOptions = field(default_factory=SiteOptions)
    horizons: HorizonOptions = field(default_factory=HorizonOptions)
    layers: LayerOptions = field(default_factory=LayerOptions)
    conform: ConformOptions = field(default_factory=ConformOptions)
    control: ControlOptions = field(default_factory=ControlOptions)
    closer: CloserFitOptions = field(default_factory=CloserFitOptions)
    left_out: float = 0.008
    sheared: float = 1.0
    refused_rough: float = 1.25
    refused_agree: float = 0.95
    refused_share: float = 0.4
    tapering: float = 0.1
    taper_half: float = 4.5
    taper_gain: float = 1.4
    merge_above: int = MERGE_ABOVE

    def __post_init__(self) -> None:
        if self.merge_above < 1:
            raise OptionError(f"merge_above must be 1 or more blocks, but is {self.merge_above}")
