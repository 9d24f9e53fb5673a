"""Wireframes that are given in place of block centroids."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geounfold.cli.arguments.parser import taken_by_options
from geounfold.cli.inputs.numbers import number
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError
from geounfold.io import PointTable
from geounfold.io.paths import existing_file

if TYPE_CHECKING:
    from geounfold.body.fill import FilledSolid

COLUMNS = ("x", "y", "z")

_BLOCKS_ONLY = ("block_size", "sub_blocks")
_POINTS_ONLY = ("columns", "sizes", "where", "by", "origin", "rotation")


def open_solid(args: Namespace, console: Console) -> FilledSolid | None:
    """Return the solid that a command's files are; None if they are points.

    Raises
    ------
    InputError
        The surface is no solid's.
    OptionError
        An option that does not fit solids, or one of theirs without a solid.
    """
    from geounfold.io.solids import is_wireframe

    check_points_given(args)
    if args.points is not None and not is_wireframe(
        existing_file(Path(args.points)), getattr(args, "element", None)
    ):
        _check_unused(args, _BLOCKS_ONLY, f"needs a closed surface; {args.points} holds points")
        return None
    _check_unused(args, _POINTS_ONLY, "needs block centroids, not surfaces")
    return filled(args, console)


def check_points_given(args: Namespace) -> None:
    """Raise OptionError if there is neither POINTS nor a body between two surfaces."""
    if args.points is None and (args.top is None or args.bottom is None):
        needed = (
            "give block centroids or a closed surface, or --top and --bottom for the body between "
            "two surfaces"
        )
        raise OptionError(f"POINTS is missing: {taken_by_options(args.words) or needed}")


def filled(args: Namespace, console: Console) -> FilledSolid:
    """Return the blocks in a command's solid, or between its two surfaces, and tell their facts."""
    from geounfold.io.solids import fill

    size = block_size(args.block_size)
    parts = 1 if args.sub_blocks is None else _parts(args.sub_blocks)
    solid, sides = args.points, (None, None)
    if solid is None:
        sides = (args.top, args.bottom)
    name = source(args)
    console.stage(f"filling {name}")
    element = getattr(args, "element", None)
    try:
        made = fill(solid, size, top=sides[0], bottom=sides[1], sub_blocks=parts, element=element)
    except OptionError as error:
        raise OptionError(str(error).replace("block_size", "--block-size")) from error
    except InputError as error:
        words = str(error)
        raise InputError(words if words.startswith(name) else f"{name}: {words}") from error
    for sentence in made.told:
        console.note(f"{name}: {sentence}")
    return made


def table_of(made: FilledSolid, name: str) -> PointTable:
    """Return filled blocks as a table that was read."""
    none = np.empty(0, np.int64)
    return PointTable(name, made.table, COLUMNS, made.points, none, text=False)


def source(args: Namespace) -> str:
    """Return the name of a command's solid in messages."""
    return str(args.points) if args.points is not None else f"{args.top} and {args.bottom}"


def block_size(text: str | None) -> float | tuple[float, ...] | None:
    """Return one side or three; None without the option."""
    if text is None:
        return None
    sides = tuple(number(word, "--block-size") for word in text.split(","))
    if len(sides) not in (1, 3):
        raise OptionError(f"--block-size needs one length or three such as 10,10,5, not '{text}'")
    return sides if len(sides) == 3 else sides[0]


def _parts(text: str) -> int:
    if text not in ("1", "2", "4", "8"):
        raise OptionError(f"--sub-blocks needs 1, 2, 4 or 8, not '{text}'")
    return int(text)


def _check_unused(args: Namespace, names: tuple[str, ...], why: str) -> None:
    """Raise OptionError if one of some options is given."""
    for name in names:
        if getattr(args, name, None) is not None:
            raise OptionError(f"--{name.replace('_', '-')} {why}")
