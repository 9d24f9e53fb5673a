"""`geounfold view`."""

from __future__ import annotations

from argparse import Namespace
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.cli.answers.file_endings import MAP, PICTURE
from geounfold.cli.inputs.points import TRUE, read
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError, nearest
from geounfold.io import Outputs, PointTable
from geounfold.io.messages import listing, shown
from geounfold.io.paths import ending, existing_file
from geounfold.io.result_columns import UNFOLDED
from geounfold.io.tables.parted import ELSEWHERE, NOT_SELECTED

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Bools, Floats


def run(args: Namespace, console: Console) -> None:
    """Draw a saved map's control mesh, or points; in both spaces if the table has both."""
    if args.colour == "":
        table = read(args.points, args, console)
        names = _number_columns(table)
        console.answer({"columns": names}, lambda: "".join(f"{name}\n" for name in names))
        return
    if args.output is None:
        raise OptionError("view needs -o PICTURE, or --colour alone to list the columns")
    outputs = Outputs.planned(
        {"--output": (args.output, PICTURE)},
        [args.points],
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if ending(Path(args.points)) in MAP:
        if args.colour is not None:
            raise OptionError("--colour needs a table of points, not a map")
        existing_file(Path(args.points))
        picture = _draw_map(args.points, console)
    else:
        _check_points(args)
        picture = _draw_points(read(args.points, args, console), args.colour, console)
    with outputs.writing() as parts:
        parts["--output"].write_bytes(picture)
    console.done(f"drawn into {args.output}")
    console.answer({"output": args.output})


def _check_points(args: Namespace) -> None:
    """Raise InputError for a surface."""
    from geounfold.io.solids import is_wireframe

    if is_wireframe(existing_file(Path(args.points)), args.element):
        raise InputError(
            f"{args.points}: is a surface; view draws points and maps (.npz): `geounfold fill` "
            "makes the blocks of a closed surface"
        )


def _draw_map(path: str, console: Console) -> bytes:
    """Return a picture of a saved map's control mesh in both spaces."""
    from geounfold.mapping import mesh_map
    from geounfold.mapping.control_mesh import scaled
    from geounfold.report.plots import bodies
    from geounfold.report.plots.figures import png

    saved = mesh_map.load(path)
    folded = saved.frame.to_world(saved.control.folded.V)
    console.stage("drawing")
    return png(bodies.draw_control(scaled(saved.control, folded, saved.frame.scale)))


def _draw_points(table: PointTable, colour: str | None, console: Console) -> bytes:
    """Return a picture of points, coloured by a column, by layer or by height."""
    label = colour or _default_colour(table)
    if label not in table.names:
        raise InputError(
            f"{table.source}: no column '{shown(label)}'{nearest(label, table.names)}; columns of "
            f"numbers: {listing(_number_columns(table))}"
        )
    there = _with_image(table)
    if not there.all():
        console.warn(f"{table.source}: {np.count_nonzero(~there)} points without an image left out")
    values = _colours(table, label)
    if not np.isfinite(values[there]).all():
        missing = np.flatnonzero(there & ~np.isfinite(values))
        raise InputError(
            f"{table.source}: column '{label}' has {len(missing)} missing or infinite values, "
            f"the first in data row {missing[0] + 1}; choose a column that every row has"
        )
    from geounfold.report.plots import bodies
    from geounfold.report.plots.figures import png

    console.stage("drawing")
    look = _boxes_of(table, there)
    for names, title in ((UNFOLDED, "unfolded"), (TRUE, "truth")):
        if set(names) <= set(table.frame.columns) and names != table.columns:
            twin = np.column_stack([table.numbers(name) for name in names])[there]
            titles = ("unfolded" if table.columns == UNFOLDED else "folded", title)
            look |= {"titles": titles}
            return png(bodies.draw_bodies(table.points[there], twin, values[there], label, **look))
    return png(bodies.draw_body(table.points[there], values[there], label, **look))


def _colours(table: PointTable, label: str) -> Floats:
    """Return the numbers of a column; a column of words is an error that lists the others."""
    try:
        return table.numbers(label)
    except InputError as error:
        others = listing(_number_columns(table))
        raise InputError(f"{error}; --colour takes a column of numbers: {others}") from error


def _number_columns(table: PointTable) -> list[str]:
    """Return the columns that can colour: those that hold a number in every row that is drawn."""
    there, found = _with_image(table), []
    for name in table.names:
        with suppress(InputError):
            if np.isfinite(table.numbers(name)[there]).all():
                found.append(name)
    return found


def _boxes_of(table: PointTable, there: Bools) -> dict[str, Any]:
    """Return the keyword of the blocks' sides; empty if all are equal, or unknown."""
    from geounfold.io.block_sizes import Sides, size_columns
    from geounfold.report.blocks import block_shape, level_sides

    with suppress(InputError):  # several sets of columns: the user names none
        found = size_columns([str(name) for name in table.frame.columns])
        if found is not None:
            sides = Sides(found).of(table.frame)[there]
            columns = dict(zip(found, sides.T, strict=True))
            known = level_sides(block_shape(table.points[there], columns))
            return {} if known is None else {"sides": known}
    return {}


def _with_image(table: PointTable) -> Bools:
    """Return which rows have an image, by their location, (n,)."""
    if "location" not in table.frame.columns:
        return np.ones(len(table), dtype=bool)
    empty = ("outside", NOT_SELECTED, ELSEWHERE)
    return ~np.asarray(table.frame["location"].astype(str).isin(empty), dtype=bool)


def _default_colour(table: PointTable) -> str:
    """Return the column that colours: stratigraphic for a result, else the third coordinate."""
    result = {"stratigraphic", *UNFOLDED} <= set(table.frame.columns)
    return "stratigraphic" if result else table.columns[2]
