"""The points that commands read, and the columns of their coordinates."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.cli.terminal.console import Console
from geounfold.io import PointTable, read_points
from geounfold.io.coordinate_columns import Triple, parse_columns
from geounfold.io.paths import TABLE_ENDINGS, ending
from geounfold.io.tables.points import Place

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.io.tables.large import PointStream

TRUE: Triple = ("true_x", "true_y", "true_z")


def files_given(*paths: str | None) -> list[str]:
    """Return the paths that are given."""
    return [path for path in paths if path is not None]


def triple(text: str | None) -> Triple | None:
    """Return the three columns that an option names; None without it."""
    return None if text is None else parse_columns(text)


def read(path: str, args: Namespace, console: Console) -> PointTable:
    """Read a command's points with its --columns and --drop-invalid."""
    return read_table(path, args.columns, console, drop_invalid=args.drop_invalid)


def read_table(
    path: str,
    columns: str | None,
    console: Console,
    prefer: tuple[Triple, ...] = (),
    place: Place | None = None,
    *,
    drop_invalid: bool,
) -> PointTable:
    """Read points, and warn of rows that are left out.

    Parameters
    ----------
    path : str
        The file.
    columns : str or None
        Three column names with commas between; None finds them.
    console : Console
        Shows the stage and the warning.
    prefer : tuple of three column names each, optional
        Columns that are read before others.
    place : callable, optional
        From the file's coordinates, (n, 3), to the world's.
    drop_invalid : bool
        Leave out rows without finite coordinates; else such a row is an InputError.
    """
    console.stage(f"reading {path}")
    names = triple(columns)
    table = read_points(path, names, prefer=prefer, drop_invalid=drop_invalid, place=place)
    _warn_of_dropped(table, path, console)
    return table


def open_table(
    args: Namespace,
    console: Console,
    prefer: tuple[Triple, ...] = (),
    *,
    frame: ModelFrame | None = None,
    keep: bool = True,
    whole: bool = False,
) -> PointTable | PointStream:
    """Read the points of a command: in batches if both files are tables, else whole.

    Parameters
    ----------
    args : Namespace
        ``points`` and ``output`` are the files.
    console : Console
        Shows the stage and the warning of rows that are left out.
    prefer : tuple of three column names each, optional
        Columns that are read before others.
    frame : ModelFrame, optional
        That of the points; without, they are in the world.
    keep : bool, optional
        Keep all coordinates in memory.
    whole : bool, optional
        Read tables whole too.
    """
    place = None if frame is None else frame.to_world
    if whole or ending(Path(args.output)) not in TABLE_ENDINGS:
        return read_table(
            args.points, args.columns, console, prefer, place, drop_invalid=args.drop_invalid
        )
    from geounfold.io.tables.large import open_points

    console.stage(f"reading {args.points}")
    table = open_points(
        args.points,
        triple(args.columns),
        prefer=prefer,
        drop_invalid=args.drop_invalid,
        place=place,
        keep=keep,
    )
    _warn_of_dropped(table, args.points, console)
    return table


def read_samples(args: Namespace, console: Console) -> PointTable | None:
    """Read the samples of a command; None if it has none."""
    if args.samples is None:
        return None
    columns, drop_invalid = args.samples_columns, args.drop_invalid
    return read_table(args.samples, columns, console, drop_invalid=drop_invalid)


def _warn_of_dropped(table: PointTable | PointStream, path: str, console: Console) -> None:
    if len(table.dropped):
        console.warn(f"{path}: {len(table.dropped)} rows without finite coordinates were left out")
