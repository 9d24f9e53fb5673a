"""Whether a body is unfolded with all its rows in memory, or in batches."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.errors import InputError, OptionError, StreamError
from geounfold.io.paths import TABLE_ENDINGS, ending

if TYPE_CHECKING:
    from geounfold.io.tables.streamed import ParquetFolder
    from geounfold.unfolding.options import UnfoldOptions

BATCHES_FROM = 4_000_000
"""Rows from which a Parquet file is unfolded in batches without being told to.

In memory, four million blocks take 2.4 GiB.
"""

_NEEDS_ROWS = (
    *("report", "where", "by", "faults", "fault_blocks", "limits", "top", "bottom", "grade"),
    *(
        "block_size",
        "sub_blocks",
        "missing",
        "crosscheck",
        "mended_column",
        "part_column",
        "element",
    ),
)
"""Options that need all rows, or inputs that are not carried batch by batch."""


def in_batches(args: Namespace, options: UnfoldOptions) -> ParquetFolder | None:
    """Return the rows of POINTS if they are to be read in batches; None for all in memory.

    Raises
    ------
    OptionError
        An engine that does not go with POINTS, OUT or other options.
    InputError
        POINTS is a folder that cannot be read.
    """
    path = None if args.points is None else Path(args.points)
    folder = path is not None and path.is_dir()
    if args.engine == "memory":
        if folder:
            raise OptionError(
                f"--engine memory reads one file, and {args.points} is a folder: leave the option "
                "out, or write its parts into one file"
            )
        return None
    wanted = args.engine != "auto" or folder
    if path is None or (not folder and ending(path) != ".parquet"):
        if wanted:
            raise OptionError(
                f"--engine {args.engine} reads a Parquet file, or a folder of them, not "
                f"'{args.points or 'surfaces'}'; write the blocks as .parquet, or leave the option "
                "out"
            )
        return None
    why = _obstacle(args, options)
    if why and not wanted:
        return None
    if why:
        what = f"--engine {args.engine}" if args.engine != "auto" else f"{args.points} is a folder,"
        raise OptionError(f"{what} carries rows in batches: {why}")
    return _rows(path, wanted=wanted)


def _rows(path: Path, *, wanted: bool) -> ParquetFolder | None:
    """Return the rows of a file or folder; None if they are too few and batches are not wanted."""
    from geounfold.io.tables.streamed import ParquetFolder

    try:
        found = ParquetFolder(path)
    except InputError:
        if wanted:
            raise
        return None  # what reads it whole names the fault
    return found if wanted or found.rows >= BATCHES_FROM else None


def _obstacle(args: Namespace, options: UnfoldOptions) -> str:
    """Return what stands against batches, as what to do; empty if nothing does."""
    from geounfold.unfolding.streamed import check_streamed

    for name in _NEEDS_ROWS:
        if getattr(args, name, None):
            return f"go without --{name.replace('_', '-')}, or choose --engine memory"
    if ending(Path(args.output)) not in TABLE_ENDINGS:
        return f"OUT must end in {' or '.join(TABLE_ENDINGS)}, not '{args.output}'"
    try:
        check_streamed(options)
    except StreamError as error:
        return f"{error}; leave it out, or choose --engine memory"
    return ""
