"""Options of an unfolding; every value is checked when the options are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from geounfold.errors import (
    OptionError,
    check_flag,
    check_number,
    check_numbers,
    check_one_of,
    check_options,
    check_whole,
    nearest,
)
from geounfold.flattening import FLATTENERS, check_flattener_options
from geounfold.mapping.control_mesh import DATUMS
from geounfold.mapping.mesh_map import REACH
from geounfold.mapping.prism_coordinates import COORDINATES
from geounfold.methods import METHODS, IsomapMethodOptions, VerticalOptions, VolumetricOptions
from geounfold.methods.sheet.members.run import LEAST_MEMBERS
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.thesis import ThesisOptions
from geounfold.quality.neighbour_distances import NEIGHBOURS
from geounfold.surfaces.hull import HULLS, HullOptions
from geounfold.surfaces.split import SPLITS
from geounfold.unfolding.gone_options import gone

PARTS = ("auto", "one")
"""Whether bodies of several sheets are divided into these, or taken as one sheet each."""

VALID: dict[str, tuple[str, ...]] = {
    "method": tuple(METHODS),
    "flattener": tuple(FLATTENERS),
    "hull": ("auto", *HULLS),
    "split": tuple(SPLITS),
    "datum": DATUMS,
    "parts": PARTS,
    "coordinates": COORDINATES,
}
"""Valid values of the options that take a name."""

STAGES: dict[str, type] = {
    "hull_options": HullOptions,
    "sheet_options": SheetOptions,
    "thesis_options": ThesisOptions,
    "vertical_options": VerticalOptions,
    "volumetric_options": VolumetricOptions,
    "isomap_options": IsomapMethodOptions,
}
"""Classes of the options of single stages and methods."""


@dataclass(frozen=True, kw_only=True)
class UnfoldOptions:
    """Options of an unfolding.

    Parameters
    ----------
    method : str
        How the map is made.  ``sheet``: prisms along the mid surface's normals, with slip between
        layers.  ``thesis``: vertical pairs, flat at mean heights.  ``ufo``: blocks anchored to the
        flat mid surface.  ``volumetric``: tetrahedra of least strain.  These can be proved
        one-to-one.  The others cannot: ``stratigraphic`` (share of the thickness), ``shear``
        (vertical), ``isomap`` (distances to neighbours).
    flattener : str
        What lays the reference surfaces flat.
    hull : str
        What wraps the body's surface around the blocks; ``auto`` takes the first that fits.
    split : str
        How the hull is split; ``signed`` holds on overturned folds too.
    up : (float, float, float)
        World direction, of any length, to which the top (hanging wall) looks.
    datum : str
        Surface that becomes flat: ``mid``, ``top``, ``bottom`` or ``proportional`` (both).
    body : int, "all" or None
        Body to unfold if there are several, 0 the largest; None if there is one.
    parts : str
        ``auto`` fits each sheet of a branched, split or repeated body; ``one`` fits one to all.
    coordinates : str
        ``tet``: tetrahedra carry points, proved; ``wachspress``, ``mvc``: prisms, not proved.
    neighbours : int
        Neighbours per block in the figures NMD and epsilon.
    reach : float
        Distance from the body, in blocks, up to which other points are carried.
    allow_uncertified : bool
        Whether an answer that is not proved one-to-one is given, marked, and is no error.
    strict : bool
        Whether poor trust is an error.
    uncertainty : int
        Other unfoldings by which the error of every place is estimated: 0 (none), or 6 or more.
    flattener_options : dataclass, dict or None
        Options of the flattener, such as SpringOptions; None for its defaults.
    hull_options : HullOptions or dict
        Options of the hulls. The options of every stage may also be a dict of values by name.
    sheet_options : SheetOptions
        Options of ``sheet``, and of the methods that take its mid surface: all but ``thesis``.
    thesis_options : ThesisOptions
        Options of ``thesis``.
    vertical_options : VerticalOptions
        Options of ``stratigraphic`` and ``shear``.
    volumetric_options : VolumetricOptions
        Options of ``volumetric``.
    isomap_options : IsomapMethodOptions
        Options of ``isomap``.

    Raises
    ------
    OptionError
        A value out of its range; the message names the option, what is valid, and the value.

    Examples
    --------
    >>> UnfoldOptions(datum="top").flattener
    'spring'
    >>> UnfoldOptions(hull_options={"level": 0.4}).hull_options.level
    0.4
    """

    method: str = "sheet"
    flattener: str = "spring"
    hull: str = "auto"
    split: str = "signed"
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    datum: str = "mid"
    body: int | str | None = None
    parts: str = "auto"
    coordinates: str = "tet"
    neighbours: int = NEIGHBOURS
    reach: float = REACH
    allow_uncertified: bool = False
    strict: bool = False
    uncertainty: int = 0
    flattener_options: Any = None
    hull_options: HullOptions = field(default_factory=HullOptions)
    sheet_options: SheetOptions = field(default_factory=SheetOptions)
    thesis_options: ThesisOptions = field(default_factory=ThesisOptions)
    vertical_options: VerticalOptions = field(default_factory=VerticalOptions)
    volumetric_options: VolumetricOptions = field(default_factory=VolumetricOptions)
    isomap_options: IsomapMethodOptions = field(default_factory=IsomapMethodOptions)

    def __new__(cls, *args: Any, **given: Any) -> UnfoldOptions:
        """Check the names before the dataclass does: OptionError names the nearest one."""
        check_names(given, cls)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for name, valid in VALID.items():
            check_one_of(name, getattr(self, name), valid)
        check_numbers("up", self.up, 3)
        up = tuple(float(x) for x in self.up)
        if not any(up):
            raise OptionError(f"up must be a list of 3 numbers, not all 0, but is {list(up)}")
        object.__setattr__(self, "up", up)
        check_whole("body", self.body, 0, word="all", none=True)
        check_whole("neighbours", self.neighbours, 1)
        check_number("reach", self.reach, 0)
        check_flag("allow_uncertified", self.allow_uncertified)
        check_flag("strict", self.strict)
        check_whole("uncertainty", self.uncertainty, 0)
        if 0 < self.uncertainty < LEAST_MEMBERS:
            raise OptionError(
                f"uncertainty must be 0 or from {LEAST_MEMBERS} up, one unfolding for each "
                f"question that coordinates leave open, but is {self.uncertainty}"
            )
        for name, kind in (
            STAGES | {"flattener_options": FLATTENERS[self.flattener].options}
        ).items():
            object.__setattr__(self, name, _from_dict(name, getattr(self, name), kind))
        check_flattener_options(self.flattener, self.flattener_options)
        for name, kind in STAGES.items():
            check_options(name, getattr(self, name), kind)

    def as_dict(self) -> dict[str, Any]:
        """Return the options as plain nested dicts."""
        return asdict(self)


def check_names(values: Mapping[str, Any], kind: Any, path: tuple[str, ...] = ()) -> None:
    """Raise OptionError if a name is no field of an options class.

    Parameters
    ----------
    values : mapping
        By the option's name.
    kind : type
        The options class.
    path : tuple of str
        Names of the options that hold the class, the outermost first.
    """
    known = [f.name for f in fields(kind)]
    for name, value in values.items():
        if name not in known:
            full = ".".join((*path, str(name)))
            inside = f" in {'.'.join(path)}" if path else ""
            raise OptionError(
                gone(full, value)
                or f"there is no option {full}{nearest(name, known)}; "
                f"valid{inside}: {', '.join(known) or 'none'}"
            )


def _from_dict(name: str, value: Any, kind: Any) -> Any:
    """Return options given as a dict as their class; any other value as it is."""
    if not isinstance(value, dict):
        return value
    check_names(value, kind, (name,))
    return kind(**value)
