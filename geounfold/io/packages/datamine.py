"""The frame of a rotated Datamine model, from the columns that hold it.

Datamine, *COPYMOD*: XC, YC and ZC of a rotated model are coordinates along the model's own axes.
X0, Y0, Z0 are the world coordinates of the point whose own coordinates are XMORIG, YMORIG, ZMORIG.
ANGLE1 to ANGLE3 about ROTAXIS1 to ROTAXIS3 (1, 2, 3 for x, y, z) turn the axes. Sources: `exports`.

One turn about z is applied: clockwise seen from above, as bearings are. The pages that are public
do not show the sense of turns about x and y, so for these the user is asked.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geounfold.body.model_frame import ModelFrame, axes_from_angles
from geounfold.errors import InputError, MissingDependencyError
from geounfold.geometry.mesh import Floats
from geounfold.io.coordinate_columns import numbers
from geounfold.io.packages.names import WORLD, plain_name
from geounfold.io.paths import TEXT_ENDINGS, ending
from geounfold.io.tables.large import CsvSource, ParquetSource

_OWN = ("xc", "yc", "zc")
_PLACE = ("x0", "y0", "z0")
_ANGLES = ("angle1", "angle2", "angle3")
_AXES = ("rotaxis1", "rotaxis2", "rotaxis3")
_CORNER = ("xmorig", "ymorig", "zmorig")
_FAULTS = (InputError, MissingDependencyError, OSError, ValueError, EOFError, zlib.error)
_HEAD = 1 << 16  # bytes in which the names of the columns are looked for
_Z = 3  # the number of the z axis


@dataclass(frozen=True, eq=False)
class FoundFrame:
    """The frame that a file holds.

    Attributes
    ----------
    frame : ModelFrame
        Of the coordinates XC, YC, ZC.
    note : str
        What was assumed.
    """

    frame: ModelFrame
    note: str


def frame_in(path: str | Path) -> FoundFrame | None:
    """Return the frame that a table holds; None if it holds none, or world coordinates too.

    Raises
    ------
    InputError
        The frame differs between rows, is incomplete, or turns about other axes than z.
    """
    path = Path(path)
    kind = ending(path)
    if kind not in (".parquet", *TEXT_ENDINGS) or not path.is_file():
        return None
    try:
        if kind in TEXT_ENDINGS and not kind.endswith(".gz") and not _may_hold(path):
            return None
        source = ParquetSource(path) if kind == ".parquet" else CsvSource(path)
    except _FAULTS:  # the reader of the points raises the error
        return None
    plain = [plain_name(name) for name in source.names]
    has_world = any(set(plain) >= set(world) for world in WORLD)
    if has_world or not {*_OWN, *_PLACE, *_ANGLES} <= set(plain):
        return None
    wanted = [name for name in (*_PLACE, *_ANGLES, *_AXES, *_CORNER) if name in plain]
    where = tuple(plain.index(name) for name in wanted)
    low, high = np.full(len(wanted), np.inf), np.full(len(wanted), -np.inf)
    for frame in source.batches(where):
        values = np.column_stack(
            [numbers(frame.iloc[:, k], source=str(path)) for k in range(len(wanted))]
        )
        low = np.fmin(low, np.nanmin(values, axis=0, initial=np.inf))
        high = np.fmax(high, np.nanmax(values, axis=0, initial=-np.inf))
    if not np.isfinite(low).all() or not np.array_equal(low, high):
        raise _asked(
            path, "has columns of a rotated model (X0, ANGLE1, ...) that vary or are empty"
        )
    return _frame(path, dict(zip(wanted, low.tolist(), strict=True)))


def _may_hold(path: Path) -> bool:
    """Return whether the name of an angle is in the first lines of a text."""
    with path.open("rb") as stream:
        head = stream.read(_HEAD)
    return b"angle1" in head.replace(b"\0", b"").lower()


def _frame(path: Path, values: dict[str, float]) -> FoundFrame | None:
    """Return the frame of the values of its columns; None if it is the world's."""
    place = np.array([values[name] for name in _PLACE])
    corner = np.array([values.get(name, 0.0) for name in _CORNER])
    turns = [
        (values[angle], int(values.get(axis, 0)))
        for angle, axis in zip(_ANGLES, _AXES, strict=True)
        if values[angle] % 360
    ]
    if not turns and np.array_equal(place, corner):
        return None
    if any(axis != _Z for _, axis in turns):
        told = ", ".join(f"{angle:g} about axis {axis}" for angle, axis in turns)
        raise _asked(path, f"is a rotated model (turned by {told}; X0, Y0, Z0)")
    angle = sum(angle for angle, _ in turns)
    axes: Floats = axes_from_angles(angle)
    frame = ModelFrame(place - corner @ axes, axes)
    at = ", ".join(f"{value:.10g}" for value in place)
    return FoundFrame(
        frame,
        f"XC, YC, ZC are the rotated model's own coordinates (X0, ANGLE1, ROTAXIS1): turned by "
        f"{angle:g} degrees clockwise about z, seen from above, and moved to ({at}); if that is "
        "not the model's place, give --origin and --rotation",
    )


def _asked(path: Path, what: str) -> InputError:
    return InputError(
        f"{path}: {what}; XC, YC, ZC are its own coordinates: give --origin X,Y,Z and --rotation "
        "BEARING,PLUNGE,DIP, or export world coordinates (XWORLD, YWORLD, ZWORLD of COPYMOD)"
    )
