"""What can be chosen for an unfolding; every value is checked when the options are made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS
from geounfold.mapping.control_mesh import DATUMS
from geounfold.mapping.mesh_map import REACH
from geounfold.mapping.prism_coordinates import COORDINATES
from geounfold.methods import METHODS, IsomapMethodOptions, VerticalOptions, VolumetricOptions
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.thesis import ThesisOptions
from geounfold.quality.neighbour_distances import NEIGHBOURS
from geounfold.surfaces.hull import HULLS, HullOptions
from geounfold.surfaces.split import SPLITS

VALID: dict[str, tuple[str, ...]] = {
    "method": tuple(METHODS),
    "flattener": tuple(FLATTENERS),
    "hull": ("auto", *HULLS),
    "split": tuple(SPLITS),
    "datum": DATUMS,
    "coordinates": COORDINATES,
}
"""Valid values of the options that have names for them."""


def _one_of(name: str, value: str, valid: Iterable[str]) -> None:
    valid = tuple(valid)
    if value not in valid:
        raise OptionError(f"unknown {name} {value!r}; valid: {', '.join(valid)}")


@dataclass(frozen=True, kw_only=True)
class UnfoldOptions:
    """Options of an unfolding.

    Parameters
    ----------
    method : str
        ``sheet`` (ours); ``thesis`` (vertical pairing, flat at mean heights); ``ufo`` (blocks
        anchored to one flattened surface along its normals); ``stratigraphic`` (proportional
        height between bottom and top, x and y kept); ``shear`` (vertical simple shear);
        ``volumetric`` (tetrahedra of least strain); or ``isomap`` (distances to neighbours).
        ``stratigraphic``, ``shear`` and ``isomap`` have no control mesh to prove.
    flattener : str
        A name in FLATTENERS.
    hull : str
        ``auto`` or a name in HULLS.
    split : str
        A name in SPLITS.
    up : (float, float, float)
        World direction that the top (hanging wall) looks to; decided once for the body.
    datum : str
        Which surface is flat: ``mid``, ``top``, ``bottom``, or ``proportional`` (both).
    body : int, "all" or None
        Which of several separate bodies to unfold, 0 the largest; None when there is one.
    coordinates : str
        How points go between the control mesh's vertices: by those of the tetrahedron (``tet``),
        which is proved one-to-one, or of the prism, which is smooth inside it but not proved:
        ``wachspress`` (mean value where a prism is not convex) or ``mvc`` (mean value).  Blocks
        that these turn inside out, or do not bring back, are an error.
    neighbours : int
        Neighbours per point in NMD and epsilon.
    reach : float
        How far past the control mesh points are carried, in blocks; beyond they have no image.
    allow_uncertified : bool
        Give an answer that is not proved one-to-one, marked, instead of failing.
    hull_options, sheet_options, thesis_options
        The stages' own options.
    vertical_options : VerticalOptions
        Of ``stratigraphic`` and ``shear``.
    volumetric_options, isomap_options
        The methods' own options.

    Raises
    ------
    OptionError
        A value outside the valid ones, which the message lists.

    Examples
    --------
    >>> UnfoldOptions(datum="top").flattener
    'spring'
    """

    method: str = "sheet"
    flattener: str = "spring"
    hull: str = "auto"
    split: str = "signed"
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    datum: str = "mid"
    body: int | str | None = None
    coordinates: str = "tet"
    neighbours: int = NEIGHBOURS
    reach: float = REACH
    allow_uncertified: bool = False
    hull_options: HullOptions = field(default_factory=HullOptions)
    sheet_options: SheetOptions = field(default_factory=SheetOptions)
    thesis_options: ThesisOptions = field(default_factory=ThesisOptions)
    vertical_options: VerticalOptions = field(default_factory=VerticalOptions)
    volumetric_options: VolumetricOptions = field(default_factory=VolumetricOptions)
    isomap_options: IsomapMethodOptions = field(default_factory=IsomapMethodOptions)

    def __post_init__(self) -> None:
        for name, valid in VALID.items():
            _one_of(name, getattr(self, name), valid)
        up = np.asarray(self.up, dtype=np.float64)
        if up.shape != (3,) or not np.isfinite(up).all() or not up.any():
            raise OptionError(f"up must be three finite numbers, not all zero, but is {self.up}")
        if isinstance(self.body, str) and self.body != "all":
            raise OptionError(f"body must be a number from 0 or 'all', but is {self.body!r}")
        if isinstance(self.body, int) and self.body < 0:
            raise OptionError(f"body must be a number from 0 or 'all', but is {self.body}")
        if self.neighbours < 1:
            raise OptionError(f"neighbours must be at least 1, but is {self.neighbours}")
        if not 0 <= self.reach < np.inf:
            raise OptionError(f"reach must be a number of blocks from 0 up, but is {self.reach}")

    def as_dict(self) -> dict[str, Any]:
        """Return the options as plain nested dicts."""
        return asdict(self)
