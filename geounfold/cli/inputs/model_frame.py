"""The options for a block model in its own coordinates: --origin and --rotation."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from geounfold.cli.inputs.numbers import three_numbers
from geounfold.errors import OptionError
from geounfold.io.coordinate_columns import parse_columns

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.cli.terminal.console import Console
    from geounfold.geometry.mesh import Floats


def found_frame(path: str, columns: str | None, console: Console | None) -> ModelFrame | None:
    """Return the frame that a file's columns hold, and tell it; None if they hold none.

    Parameters
    ----------
    path : str
        The file.
    columns : str or None
        The three columns that the user names; the frame is that of XC, YC, ZC.
    console : Console or None
        Shows what was assumed.

    Raises
    ------
    InputError
        The frame cannot be used.
    """
    if columns is not None and plain_columns(columns) != ("xc", "yc", "zc"):
        return None
    from geounfold.io.packages.datamine import frame_in

    found = frame_in(path)
    if found is None:
        return None
    if console is not None:
        console.note(f"{path}: {found.note}")
    return found.frame


def plain_columns(text: str) -> tuple[str, ...]:
    """Return the plain names of an option's three columns."""
    from geounfold.io.packages.names import plain_name

    return tuple(plain_name(name) for name in parse_columns(text))


def model_axes(rotation: str | None) -> Floats | None:
    """Return the axes of a model turned by --rotation, (3, 3); None without it."""
    from geounfold.body.model_frame import axes_from_angles

    return None if rotation is None else axes_from_angles(*three_numbers(rotation, "--rotation"))


def model_frame(
    args: Namespace, console: Console | None = None, path: str | None = None
) -> ModelFrame | None:
    """Return the frame of the points; None if they are in the world.

    It is given by --origin and --rotation, or by columns of the file (see `packages.datamine`).

    Parameters
    ----------
    args : Namespace
        The options.
    console : Console, optional
        Shows what was assumed of the file's columns.
    path : str, optional
        The file of the points.

    Raises
    ------
    OptionError
        --rotation without --origin.
    InputError
        The file's columns hold a frame that cannot be used.
    """
    if args.origin is None and args.rotation is None and path is not None:
        return found_frame(path, args.columns, console)
    if args.origin is None:
        if args.rotation is not None:
            raise OptionError(
                "--rotation turns a model's own coordinates about its origin: give --origin too, "
                "or neither if the centroids are world coordinates"
            )
        return None
    from geounfold.body.model_frame import ModelFrame

    angles = (0.0, 0.0, 0.0)
    if args.rotation is not None:
        angles = three_numbers(args.rotation, "--rotation")
    return ModelFrame.turned(three_numbers(args.origin, "--origin"), *angles)
