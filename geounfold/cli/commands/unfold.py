"""`geounfold unfold`."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING, Any, cast

from geounfold.cli.answers.locations import flat_columns, place_counts, warn_of_outside
from geounfold.cli.file_endings import HTML, JSON, MAP, POINTS_OUT, VTU
from geounfold.cli.inputs.block_sizes import BlockVolumes
from geounfold.cli.inputs.drillholes import TRACE_ENDINGS, check_hole_options, read_holes
from geounfold.cli.inputs.grades import check_grade_options, exploration, graded_samples
from geounfold.cli.inputs.model_frame import model_frame
from geounfold.cli.inputs.points import files_given, open_table, read_samples
from geounfold.cli.inputs.unfold_options import command_line, config_file, unfold_options
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import Outputs, PointTable, read_surface, write_json
from geounfold.io.result_columns import UNFOLDED, result_columns, world_columns

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.mapping.mesh_map import UnfoldingMap
    from geounfold.unfolding.options import UnfoldOptions
    from geounfold.unfolding.result import Unfolding


def unfold(args: Namespace, console: Console) -> None:
    """Unfold a body and write everything that was asked for."""
    if args.holes is None and (args.samples is None) != (args.samples_out is None):
        raise OptionError("--samples and --samples-out belong together: give both or neither")
    check_hole_options(args)
    check_grade_options(args)
    outputs = Outputs.planned(
        {
            "--output": (args.output, POINTS_OUT),
            "--summary": (args.summary, JSON),
            "--map": (args.map, MAP),
            "--mesh": (args.mesh, VTU),
            "--report": (args.report, HTML),
            "--samples-out": (args.samples_out, POINTS_OUT),
            "--traces-out": (args.traces_out, TRACE_ENDINGS),
        },
        files_given(
            args.points, args.samples, args.top, args.bottom, config_file(args), *(args.holes or ())
        ),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if args.report is not None:
        _check_pictures(console)
    options = unfold_options(args)
    _check_mesh_outputs(args, options)
    frame = model_frame(args)
    table = open_table(args, console, args.output, frame=frame, whole=args.report is not None)
    table.check_writable(args.output)
    names = table.frame.columns if isinstance(table, PointTable) else table.rows.names
    volumes = BlockVolumes(args.sizes, [str(name) for name in names], args.points)
    samples = read_samples(args, console)
    holes = read_holes(args, console)
    graded = graded_samples(args, samples, holes)
    surfaces = {
        side: None if path is None else read_surface(path)
        for side, path in (("top", args.top), ("bottom", args.bottom))
    }
    from geounfold.unfolding import run

    result = run.unfold(table.points, options, progress=console.stage, **surfaces)
    read = table.facts() if frame is None else {**table.facts(), **frame.facts()}
    summary = {**result.summary(), "input": read, "command": command_line(args)}
    if args.crosscheck:
        from geounfold.comparison.crosscheck import crosscheck as check_meshes

        summary = check_meshes(result, progress=console.stage).added_to(summary)
    warnings = summary.get("warnings", [])
    if samples is not None:
        summary["samples"] = samples.facts()
    carried = (
        None if samples is None else result_columns(UNFOLDED, result.map.carry(samples.points))
    )
    traced = {} if holes is None else holes.carried(flat_columns(result.map))
    if holes is not None:
        summary["drillholes"] = holes.facts(traced)
        summary["warnings"] = [*warnings, *holes.holes.messages()]  # said when they were read
    explored = None
    if graded is not None:
        console.stage(f"exploring {args.grade}")
        explored = exploration(args, result, graded)
        summary["exploration"] = explored.summary()
    console.stage("writing")
    with outputs.writing() as parts:
        table.write_parts(
            parts["--output"],
            lambda own, points, rows: {
                **({} if frame is None else world_columns(points)),
                **_results(result, rows, own, volumes),
            },
        )
        summary.update(volumes.facts())
        summary["warnings"] = [*summary.get("warnings", []), *volumes.warnings()]
        if samples is not None and carried is not None:
            samples.write(parts["--samples-out"], carried)
        if holes is not None:
            holes.write(parts, traced)
        if "--map" in parts:
            result.save(parts["--map"])
        if "--mesh" in parts:
            from geounfold.io.control_mesh import write_control

            mapped = cast("UnfoldingMap", result.map)  # the method has a control mesh: checked
            write_control(parts["--mesh"], mapped, result.certificate)
        if "--summary" in parts:
            write_json(parts["--summary"], summary)
        if "--report" in parts and isinstance(table, PointTable):  # which it is, read whole
            from geounfold.cli.answers.report_data import report_columns, report_holes
            from geounfold.report import write_report

            columns = _results(result, slice(0, len(table)))  # volumes are not drawn
            drawn = report_columns(table, columns)
            drilled = report_holes(holes, traced, samples, carried)
            blocks = table.points, result.points
            write_report(
                parts["--report"], summary, *blocks, drawn, holes=drilled, exploration=explored
            )
    for warning in (*warnings, *volumes.warnings()):
        console.warn(str(warning))
    if carried is not None:
        warn_of_outside(args.samples, place_counts(carried), console)
    for name, found in traced.items():
        warn_of_outside(f"the holes' {name}", place_counts(found), console)
    console.done(f"{len(table)} points unfolded into {args.output}")
    console.answer(summary)


def _check_mesh_outputs(args: Namespace, options: UnfoldOptions) -> None:
    """Raise OptionError where a control mesh is to be written that the method has none of."""
    from geounfold.methods import METHODS, no_mesh

    if not METHODS[options.method].control:
        for path, name in ((args.map, "--map"), (args.mesh, "--mesh")):
            if path is not None:
                raise OptionError(no_mesh(options.method, f"{name} has nothing to write"))


def _results(
    result: Unfolding,
    rows: slice,
    frame: pd.DataFrame | None = None,
    volumes: BlockVolumes | None = None,
) -> dict[str, Any]:
    """Return all results of some of the points, by output column."""
    distortion = {name: values[rows] for name, values in result.columns.items()}
    found = result_columns(UNFOLDED, result.carried.part(rows)) | distortion
    if frame is None or volumes is None:
        return found
    return found | volumes.columns(frame, distortion)


def _check_pictures(console: Console) -> None:
    """Raise where nothing can be drawn, before anything is computed."""
    from geounfold.report.plots.rendering import check_rendering

    console.stage("checking off-screen rendering")
    check_rendering()
