"""The points that commands read, and the columns of their coordinates."""

from __future__ import annotations

from argparse import Namespace
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geounfold.cli.inputs.model_frame import found_frame
from geounfold.cli.inputs.values import values_rules
from geounfold.cli.terminal.console import Console
from geounfold.io import PointTable, read_points
from geounfold.io.coordinate_columns import coded_told, parse_columns
from geounfold.io.messages import counted, rows_named
from geounfold.io.packages.names import Triple
from geounfold.io.paths import TABLE_ENDINGS, ending
from geounfold.io.selection import Where, read_where
from geounfold.io.tables.points import Place

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.geometry.mesh import Ints
    from geounfold.io.tables.large import PointStream

TRUE: Triple = ("true_x", "true_y", "true_z")


def files_given(*paths: str | None) -> list[str]:
    """Return the paths that are given."""
    return [path for path in paths if path is not None]


def triple(text: str | None) -> Triple | None:
    """Return the three columns that an option names; None without it."""
    return None if text is None else parse_columns(text)


def where_of(args: Namespace, name: str = "where") -> Where | None:
    """Return the choice of rows that an option states; None without it."""
    text = getattr(args, name, None)
    return None if text is None else read_where(text)


def read(path: str, args: Namespace, console: Console) -> PointTable:
    """Read a command's points as `read_all`; rows that are not chosen are left out."""
    return read_all(path, args, console).only()


def read_all(path: str, args: Namespace, console: Console) -> PointTable:
    """Read a command's points with its --columns, --where, --element and --drop-invalid."""
    return read_table(
        path, args.columns, console,
        drop_invalid=args.drop_invalid, where=where_of(args), element=args.element,
        missing=missing_of(args),
    )  # fmt: skip


def missing_of(args: Namespace) -> tuple[float, ...]:
    """Return the numbers of --missing, which mean missing coordinates too; () without it."""
    if getattr(args, "missing", None) is None:
        return ()
    found = []
    for word in values_rules(args).missing:
        with suppress(ValueError):  # a word, which no coordinate is
            found.append(float(word))
    return tuple(found)


def read_table(  # 8 parameters and a path: the choices of columns, rows and element
    path: str,
    columns: str | None,
    console: Console,
    prefer: tuple[Triple, ...] = (),
    place: Place | None = None,
    *,
    drop_invalid: bool,
    where: Where | None = None,
    element: str | None = None,
    missing: tuple[float, ...] = (),
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
        From the file's coordinates, (n, 3), to the world's. By default that of the frame in the
        file's columns, if they hold one.
    drop_invalid : bool
        Leave out rows without finite coordinates; else such a row is an InputError.
    where : Where, optional
        Chooses rows; the others stay in the table, marked (`PointTable.chosen`).
    element : str, optional
        Name of the element to read, for a file of several.
    missing : tuple of float, optional
        Values that mean a missing coordinate, see `read_points`.
    """
    console.stage(f"reading {path}")
    if place is None and not prefer:
        frame = found_frame(path, columns, console)
        place = None if frame is None else frame.to_world
    table = read_points(
        path, triple(columns),
        prefer=prefer, drop_invalid=drop_invalid, place=place, where=where, element=element,
        missing=missing,
    )  # fmt: skip
    _tell(table, path, console)
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
            args.points, args.columns, console, prefer, place,
            drop_invalid=args.drop_invalid, where=where_of(args), element=args.element,
            missing=missing_of(args),
        )  # fmt: skip
    from geounfold.io.tables.large import open_points

    console.stage(f"reading {args.points}")
    table = open_points(
        args.points,
        triple(args.columns),
        prefer=prefer,
        drop_invalid=args.drop_invalid,
        place=place,
        keep=keep,
        where=where_of(args),
        element=args.element,
        missing=missing_of(args),
    )
    _tell(table, args.points, console)
    return table


def read_samples(args: Namespace, console: Console) -> PointTable | None:
    """Read the samples of a command; None if it has none."""
    if args.samples is None:
        return None
    return read_table(
        args.samples, args.samples_columns, console,
        drop_invalid=args.drop_invalid,
        where=where_of(args, "samples_where"), element=args.samples_element,
        missing=missing_of(args),
    ).only()  # fmt: skip


def _tell(table: PointTable | PointStream, path: str, console: Console) -> None:
    """Tell what was skipped or assumed in reading, and warn of rows that were left out."""
    if table.notes:
        console.note(f"{path}: {'; '.join(table.notes)}")
    if len(table.dropped):
        count, named = counted(len(table.dropped), "row"), rows_named(table.dropped.tolist())
        console.warn(f"{path}: {count} without finite coordinates left out: {named}")
    if isinstance(table, PointTable) or table.kept is not None:
        chosen = slice(None) if table.chosen is None else table.chosen
        told = coded_told(table.points[chosen], table.columns, lambda: _rows_of(table)[chosen])
        if told:
            console.warn(f"{path}: {told}")


def _rows_of(table: PointTable | PointStream) -> Ints:
    """Return the data row in the file of every point, from 1."""
    every = np.arange(1, len(table) + len(table.dropped) + 1)
    return np.setdiff1d(every, table.dropped, assume_unique=True)
