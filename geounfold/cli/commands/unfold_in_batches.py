"""`geounfold unfold` of a Parquet file or folder whose rows are not held in memory."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from geounfold.cli.answers.closing import closing_lines, names_of
from geounfold.cli.inputs.block_sizes import BlockVolumes
from geounfold.cli.inputs.body import BodyInputs
from geounfold.cli.inputs.drillholes import read_holes
from geounfold.cli.inputs.model_frame import model_frame
from geounfold.cli.inputs.points import read_samples, triple
from geounfold.cli.inputs.unfold_options import command_line
from geounfold.cli.terminal.console import Console
from geounfold.errors import StreamError
from geounfold.io import Outputs

if TYPE_CHECKING:
    from geounfold.io.tables.streamed import ParquetFolder
    from geounfold.unfolding.options import UnfoldOptions


def unfold_in_batches(
    args: Namespace,
    console: Console,
    outputs: Outputs,
    options: UnfoldOptions,
    rows: ParquetFolder,
) -> bool:
    """Unfold the rows of POINTS in batches and write all outputs that are wanted.

    Returns
    -------
    bool
        False if the user left the choice and the body needs all rows at once, which is told.

    Raises
    ------
    StreamError
        The body needs all rows at once, and the user chose batches or POINTS is a folder.
    """
    from geounfold.cli.answers.in_batches import StreamedAnswer
    from geounfold.io.tables.streamed import StreamedPoints
    from geounfold.unfolding.streamed import unfold_streamed

    frame = model_frame(args, console, str(rows.first))
    points = StreamedPoints(
        args.points,
        triple(args.columns),
        drop_invalid=args.drop_invalid,
        place=None if frame is None else frame.to_world,
        rows=rows,
    )
    volumes = BlockVolumes(args.sizes, rows.names, args.points)
    samples, holes = read_samples(args, console), read_holes(args, console)
    console.note(
        f"{args.points}: its {rows.rows:,} rows are unfolded in batches; --engine memory holds all"
    )
    try:
        result = unfold_streamed(points.batches, points.sample(), options, progress=console.stage)
    except StreamError as error:
        if args.engine != "auto" or rows.files > 1:
            raise StreamError(
                f"{args.points}: cannot be unfolded in batches: {error}; --engine memory holds all "
                "rows of one file"
            ) from error
        console.note(f"{args.points}: unfolded in memory instead, because {error}")
        return False
    table = points.table(result.duplicates)
    if len(table.dropped):
        console.warn(
            f"{args.points}: {len(table.dropped)} rows without finite coordinates were left out"
        )
    body = BodyInputs(table, frame, volumes, samples, holes, None, None, None)
    more = {"command": command_line(args)} | ({} if args.unit is None else {"unit": args.unit})
    console.stage("carrying and writing")
    answer = StreamedAnswer(result, body, more)
    with outputs.writing() as parts:
        answer.write(parts)
    for warning in answer.warnings:
        console.warn(warning)
    written = names_of(
        (args.output, args.summary, args.map, args.mesh, args.samples_out, args.traces_out)
    )
    console.close(lambda seconds: closing_lines(answer.summary, seconds, written))
    console.answer(answer.summary)
    return True
