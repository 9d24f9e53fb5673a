"""The points that commands read, and the columns they are in."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.cli.terminal.console import Console
from geounfold.io import PointTable, read_points
from geounfold.io.coordinate_columns import Triple, parse_columns
from geounfold.io.paths import TABLE_ENDINGS, ending

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.io.tables.large import PointStream

TRUE: Triple = ("true_x", "true_y", "true_z")


def files_given(*paths: str | None) -> list[str]:
    """Return the paths of those options that were given."""
    return [path for path in paths if path is not None]


def triple(text: str | None) -> Triple | None:
    """Return the three columns that an option names, or None without it."""
    return None if text is None else parse_columns(text)


def read(
    path: str,
    args: Namespace,
    console: Console,
    prefer: tuple[Triple, ...] = (),
    frame: ModelFrame | None = None,
) -> PointTable:
    """Read the points of a command, and say what was left out."""
    console.stage(f"reading {path}")
    columns = triple(args.columns)
    place = None if frame is None else frame.to_world
    table = read_points(path, columns, prefer=prefer, drop_invalid=args.drop_invalid, place=place)
    _say_dropped(table, path, console)
    return table


def open_table(
    args: Namespace,
    console: Console,
    out: str,
    prefer: tuple[Triple, ...] = (),
    *,
    frame: ModelFrame | None = None,
    keep: bool = True,
    whole: bool = False,
) -> PointTable | PointStream:
    """Read the points of a command, in batches where both files are tables, unless wanted whole."""
    if whole or ending(Path(out)) not in TABLE_ENDINGS:
        return read(args.points, args, console, prefer, frame)
    from geounfold.io.tables.large import open_points

    console.stage(f"reading {args.points}")
    columns = triple(args.columns)
    table = open_points(
        args.points,
        columns,
        prefer=prefer,
        drop_invalid=args.drop_invalid,
        place=None if frame is None else frame.to_world,
        keep=keep,
    )
    _say_dropped(table, args.points, console)
    return table


def _say_dropped(table: PointTable | PointStream, path: str, console: Console) -> None:
    if len(table.dropped):
        console.warn(f"{path}: {len(table.dropped)} rows without finite coordinates were left out")


def read_samples(args: Namespace, console: Console) -> PointTable | None:
    """Read the samples of a command; None where there are none."""
    if args.samples is None:
        return None
    console.stage(f"reading {args.samples}")
    columns = triple(args.samples_columns)
    table = read_points(args.samples, columns, drop_invalid=args.drop_invalid)
    if len(table.dropped):
        console.warn(f"{args.samples}: {len(table.dropped)} rows were left out")
    return table
