"""`geounfold body-from-holes`: blocks from coded intervals of drill-holes."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING, Any

from geounfold.cli.answers.file_endings import JSON, POINTS_OUT, SURFACES_OUT
from geounfold.cli.inputs.drillholes import hole_settings
from geounfold.cli.inputs.modelling import body_options
from geounfold.cli.inputs.numbers import number
from geounfold.cli.inputs.points import files_given
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import TABLE_ENDINGS, Outputs, write_json, write_surface
from geounfold.io.tables.files import write_table

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.modelling import HolesBody


_WASTE = 0.02  # share of waste in the intercepts from which grades of the samples are too high


def run(args: Namespace, console: Console) -> None:
    """Write the body's blocks, and its walls, intercepts and samples."""
    if args.samples_out is None and (args.assays or args.composite):
        raise OptionError("--assays and --composite are for --samples-out")
    outputs = Outputs.planned(
        {
            "--output": (args.output, POINTS_OUT),
            "--top-out": (args.top_out, SURFACES_OUT),
            "--bottom-out": (args.bottom_out, SURFACES_OUT),
            "--intercepts-out": (args.intercepts_out, TABLE_ENDINGS),
            "--samples-out": (args.samples_out, POINTS_OUT),
            "--summary": (args.summary, JSON),
        },
        files_given(args.collar, args.survey, args.intervals, args.assays, args.polygon),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    options = body_options(args)
    length = None if args.composite is None else number(args.composite, "--composite")
    settings = hole_settings(args)
    from geounfold.drillholes import read_drillholes
    from geounfold.modelling import body_from_holes

    console.stage("reading drill-holes")
    holes = read_drillholes(args.collar, args.survey, args.intervals, where=args.where, **settings)
    for line in holes.messages():
        console.warn(line)
    console.stage("drawing the walls")
    body = body_from_holes(holes, options=options)
    for line in body.told:
        console.note(line)
    for line in body.warnings:
        console.warn(line)
    samples = _samples(args, body, settings, length, console)
    if samples is not None and body.waste > _WASTE:
        console.warn(
            f"the blocks hold the waste between intercepts ({body.waste:.1%} of their length), the "
            "samples do not: their mean grade is too high for the blocks; --max-waste 0 leaves it "
            "out of both"
        )
    console.stage("writing")
    with outputs.writing() as parts:
        write_table(parts["--output"], body.table)
        for name, wall in (("--top-out", body.hanging_wall), ("--bottom-out", body.footwall)):
            if name in parts:
                write_surface(parts[name], wall)
        if "--intercepts-out" in parts:
            write_table(parts["--intercepts-out"], body.intercepts)
        if samples is not None:
            write_table(parts["--samples-out"], samples, columns=("x", "y", "z"))
        if "--summary" in parts:
            write_json(parts["--summary"], body.facts())
    console.done(f"{len(body)} blocks from {len(body.intercepts)} intercepts into {args.output}")
    console.answer(body.facts())


def _samples(
    args: Namespace,
    body: HolesBody,
    settings: dict[str, Any],
    length: float | None,
    console: Console,
) -> pd.DataFrame | None:
    """Return the samples in the body's intervals; None if they are not wanted."""
    if args.samples_out is None:
        return None
    from geounfold.drillholes import read_drillholes

    assays = None
    if args.assays is not None:
        assays = read_drillholes(args.collar, args.survey, args.assays, **settings)
        for line in assays.messages():
            console.warn(line)
    return body.samples(length, assays)
