"""`geounfold unfold`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.cli.answers.closing import closing_lines, names_of
from geounfold.cli.answers.file_endings import HTML, JSON, MAP, POINTS_OUT, TRACES, VTU
from geounfold.cli.answers.unfolded import UnfoldedBody
from geounfold.cli.commands.unfold_in_batches import unfold_in_batches
from geounfold.cli.domains.unfold import check_by, unfold_by
from geounfold.cli.inputs.body import read_body
from geounfold.cli.inputs.drillholes import check_hole_options
from geounfold.cli.inputs.engine import in_batches
from geounfold.cli.inputs.faults import check_fault_options
from geounfold.cli.inputs.grades import check_grade_options, exploration
from geounfold.cli.inputs.points import files_given
from geounfold.cli.inputs.solid import check_points_given
from geounfold.cli.inputs.unfold_options import command_line, config_file, unfold_options
from geounfold.cli.terminal.console import Console
from geounfold.errors import GeounfoldError, OptionError
from geounfold.io import Outputs

if TYPE_CHECKING:
    from geounfold.unfolding.options import UnfoldOptions


def run(args: Namespace, console: Console) -> None:
    """Unfold a body and write all outputs that are wanted."""
    check_points_given(args)
    if args.holes is None and (args.samples is None) != (args.samples_out is None):
        raise OptionError("--samples and --samples-out belong together: give both or neither")
    check_hole_options(args)
    check_grade_options(args)
    check_by(args)
    check_fault_options(args)
    outputs = _outputs(args, console)
    if args.report is not None:
        _check_rendering(console)
    options = unfold_options(args)
    _check_mesh_outputs(args, options)
    rows = in_batches(args, options)
    if rows is not None and unfold_in_batches(args, console, outputs, options, rows):
        return
    body = read_body(args, console)
    if args.by is not None:
        unfold_by(args, console, outputs, options, body)
        return
    from geounfold.unfolding import run as unfolding

    try:
        result = unfolding.unfold(
            body.points,
            options,
            progress=console.stage,
            top=body.top,
            bottom=body.bottom,
            **body.faults,
        )
    except GeounfoldError as error:
        if not body.hint:
            raise
        raise type(error)(f"{error}; {body.hint}") from error
    summary = {**result.summary(), "command": command_line(args)}
    if args.unit is not None:
        summary["unit"] = args.unit
    notes = [body.hint, body.box_hint(summary)]
    summary["warnings"] = [*filter(None, notes), *summary.get("warnings", [])]
    if args.crosscheck:
        from geounfold.comparison.crosscheck import crosscheck

        summary = crosscheck(result, progress=console.stage).added_to(summary)
    explored = None
    if body.graded is not None:
        console.stage(f"exploring {args.grade}")
        explored = exploration(args, result, body.graded)
    console.stage("writing")
    unfolded = UnfoldedBody(
        result, body, summary, explored, mended=args.mended_column, part=args.part_column
    )
    with outputs.writing() as parts:
        unfolded.write(parts)
    for warning in unfolded.warnings:
        console.warn(warning)
    files = (args.output, args.summary, args.map, args.mesh, args.report)
    written = names_of((*files, args.samples_out, args.traces_out))
    console.close(lambda seconds: closing_lines(unfolded.summary, seconds, written))
    console.answer(unfolded.summary)


def _outputs(args: Namespace, console: Console) -> Outputs:
    """Return the checked outputs."""
    inputs = files_given(
        *(*_points_files(args), args.samples, args.top, args.bottom, config_file(args)),
        *(*(args.holes or ()), *(args.faults or ())),
        *(limit for limit in args.limits or () if limit.count(",") != 5),
    )
    wanted = {
        "--output": (args.output, POINTS_OUT),
        "--summary": (args.summary, JSON),
        "--map": (args.map, MAP),
        "--mesh": (args.mesh, VTU),
        "--report": (args.report, HTML),
        "--slips": (args.slips, POINTS_OUT),
        "--samples-out": (args.samples_out, POINTS_OUT),
        "--traces-out": (args.traces_out, TRACES),
    }
    return Outputs.planned(wanted, inputs, overwrite=args.overwrite, watcher=console.journal)


def _points_files(args: Namespace) -> list[str | None]:
    """Return the file of the points, or all files of their folder."""
    if args.points is None or not Path(args.points).is_dir():
        return [args.points]
    return [str(file) for file in sorted(Path(args.points).iterdir()) if file.is_file()]


def _check_mesh_outputs(args: Namespace, options: UnfoldOptions) -> None:
    """Raise OptionError if --map or --mesh is given for a method without a control mesh."""
    from geounfold.methods import METHODS, no_mesh

    if not METHODS[options.method].control:
        for path, name in ((args.map, "--map"), (args.mesh, "--mesh")):
            if path is not None:
                raise OptionError(no_mesh(options.method, f"{name} has nothing to write"))


def _check_rendering(console: Console) -> None:
    """Raise MissingDependencyError if nothing can be drawn, before anything is computed."""
    from geounfold.report.plots.rendering import check_rendering

    console.stage("checking off-screen rendering")
    check_rendering()
