"""The commands: check every path and option, read, compute, write all outputs together."""

from __future__ import annotations

import shlex
from argparse import Namespace
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from geounfold.cli.blocks import BlockVolumes
from geounfold.cli.console import Console
from geounfold.cli.exploring import check_grade_options, exploration, graded_samples
from geounfold.cli.frames import model_frame
from geounfold.cli.holes import TRACE_ENDINGS, check_hole_options, read_holes
from geounfold.cli.table import table_text
from geounfold.errors import InputError, OptionError, OutputError
from geounfold.io import (
    Outputs,
    PointTable,
    holds_surface,
    read_points,
    read_surface,
    write_json,
    write_surface,
)
from geounfold.io.coordinates import Triple, parse_columns
from geounfold.io.formats import point_endings, surface_endings
from geounfold.io.results import FOLDED, UNFOLDED, result_columns, world_columns
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables import TABLE_ENDINGS, ending, existing_file, write_table

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.blockmodel import ModelFrame
    from geounfold.io.streams import PointStream
    from geounfold.mapping import UnfoldingMap
    from geounfold.mesh import Bools, Floats, TriMesh
    from geounfold.methods import PointwiseMap
    from geounfold.options import UnfoldOptions
    from geounfold.pipeline import Unfolding

_POINTS_OUT = (*TABLE_ENDINGS, *point_endings(writing=True))
_SURFACES_OUT = surface_endings(writing=True)
_JSON = (".json",)
_MAP = (".npz",)
_VTU = (".vtu",)
_HTML = (".html", ".htm")
_PICTURE = (".png",)
_TOML = (".toml",)
_TRUE: Triple = ("true_x", "true_y", "true_z")
_MODEL = (
    *("method", "flattener", "hull", "split", "up", "datum", "coordinates", "body"),
    *("neighbours", "reach"),
)


def unfold(args: Namespace, console: Console) -> None:
    """Unfold a body and write everything that was asked for."""
    if args.holes is None and (args.samples is None) != (args.samples_out is None):
        raise OptionError("--samples and --samples-out belong together: give both or neither")
    check_hole_options(args)
    check_grade_options(args)
    outputs = Outputs.planned(
        {
            "--output": (args.output, _POINTS_OUT),
            "--summary": (args.summary, _JSON),
            "--map": (args.map, _MAP),
            "--mesh": (args.mesh, _VTU),
            "--report": (args.report, _HTML),
            "--samples-out": (args.samples_out, _POINTS_OUT),
            "--traces-out": (args.traces_out, TRACE_ENDINGS),
        },
        _given(
            args.points, args.samples, args.top, args.bottom, _config(args), *(args.holes or ())
        ),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if args.report is not None:
        _check_pictures(console)
    options = _options(args)
    _check_mesh_outputs(args, options)
    frame = model_frame(args)
    table = _open(args, console, args.output, frame=frame, whole=args.report is not None)
    table.check_writable(args.output)
    names = table.frame.columns if isinstance(table, PointTable) else table.rows.names
    volumes = BlockVolumes(args.sizes, [str(name) for name in names], args.points)
    samples = _read_samples(args, console)
    holes = read_holes(args, console)
    graded = graded_samples(args, samples, holes)
    surfaces = {
        side: None if path is None else read_surface(path)
        for side, path in (("top", args.top), ("bottom", args.bottom))
    }
    from geounfold import pipeline

    result = pipeline.unfold(table.points, options, progress=console.stage, **surfaces)
    read = table.facts() if frame is None else {**table.facts(), **frame.facts()}
    summary = {**result.summary(), "input": read, "command": _command(args)}
    if args.crosscheck:
        from geounfold.verification import crosscheck as check_meshes

        summary = check_meshes(result, progress=console.stage).added_to(summary)
    warnings = summary.get("warnings", [])
    if samples is not None:
        summary["samples"] = samples.facts()
    carried = (
        None if samples is None else result_columns(UNFOLDED, result.map.carry(samples.points))
    )
    traced = {} if holes is None else holes.carried(_flat(result.map))
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
            from geounfold.io.volumes import write_control

            mapped = cast("UnfoldingMap", result.map)  # the method has a control mesh: checked
            write_control(parts["--mesh"], mapped, result.certificate)
        if "--summary" in parts:
            write_json(parts["--summary"], summary)
        if "--report" in parts and isinstance(table, PointTable):  # which it is, read whole
            from geounfold.cli.reporting import report_columns, report_holes
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
        _warn_of_outside(args.samples, _places(carried), console)
    for name, found in traced.items():
        _warn_of_outside(f"the holes' {name}", _places(found), console)
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


def carry(args: Namespace, console: Console) -> None:
    """Carry other points with a saved map, to the flat side or back; or drill-holes."""
    check_hole_options(args)
    if (args.points is None) != (args.output is None):
        raise OptionError(
            "map needs POINTS and -o OUT, or --holes with --samples-out or --traces-out"
        )
    if args.holes is None and args.samples_out is not None:
        raise OptionError("--samples-out needs --holes COLLAR SURVEY ASSAY")
    frame = model_frame(args)
    if frame is not None and (args.points is None or args.inverse):
        raise OptionError("--origin is that of POINTS in the folded space: without --inverse")
    if args.engine == "dask":
        _carry_on_cluster(args, frame, console)
        return
    if args.scheduler is not None:
        raise OptionError("--scheduler needs --engine dask")
    if args.holes is not None and args.inverse:
        raise OptionError("--holes are where they were drilled: without --inverse")
    outputs = Outputs.planned(
        {
            "--output": (args.output, (*_POINTS_OUT, *_SURFACES_OUT)),
            "--samples-out": (args.samples_out, _POINTS_OUT),
            "--traces-out": (args.traces_out, TRACE_ENDINGS),
        },
        _given(args.map, args.points, *(args.holes or ())),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    if args.points is not None and _is_wireframe(args):
        _carry_surface(args, frame, console, outputs)
        return
    prefer = (UNFOLDED,) if args.inverse else ()
    table = (
        None
        if args.points is None
        else _open(args, console, args.output, prefer, frame=frame, keep=False)
    )
    holes = read_holes(args, console)
    from geounfold import mapping

    saved = mapping.load(args.map)
    console.stage("carrying points")
    names = FOLDED if args.inverse else UNFOLDED
    places: Counter[str] = Counter()
    unsolved: list[int] = []

    def carried(_: pd.DataFrame, points: Floats, __: slice) -> dict[str, Any]:
        there = saved.carry(points, inverse=args.inverse)
        found = result_columns(names, there)
        places.update(_places(found))
        unsolved.append(there.unsolved if args.inverse else 0)
        return found if frame is None else {**world_columns(points), **found}

    traced = {} if holes is None else holes.carried(_flat(saved))
    with outputs.writing() as parts:
        if table is not None:
            table.write_parts(parts["--output"], carried)
        if holes is not None:
            holes.write(parts, traced)
    named = {name: _places(found) for name, found in traced.items() if found}
    if table is not None:
        named = {"points": dict(places), **named}
        _warn_of_outside(args.points, named["points"], console)
    if sum(unsolved):
        console.warn(
            f"{args.points}: {sum(unsolved)} points lie inside the control mesh, but the inverse "
            f"of its {saved.coordinates} coordinates was not found there; they were left empty too"
        )
    for name in traced:
        _warn_of_outside(f"the holes' {name}", named[name], console)
    written = {args.output: named.get("points"), args.samples_out: named.get("samples")}
    counts = [f"{c['carried']} points carried into {p}" for p, c in written.items() if c]
    console.done(", ".join(counts) or f"traces carried into {args.traces_out}")
    console.answer(named)


def _carry_on_cluster(args: Namespace, frame: ModelFrame | None, console: Console) -> None:
    """Carry a table in parts by a Dask cluster, into a folder of parts."""
    if args.points is None or args.holes is not None:
        raise OptionError("--engine dask carries POINTS into -o OUT, no drill-holes")
    kind = ending(Path(args.output))
    if kind not in (".csv", ".parquet"):
        raise OptionError(
            f"--engine dask writes a folder that ends in .csv or .parquet, not '{args.output}'"
        )
    from geounfold import mapping
    from geounfold.clusters import Carrying, carry_folder
    from geounfold.io.outputs import whole_folder
    from geounfold.io.parts import parts_of

    existing_file(Path(args.map))
    if Path(args.output).resolve() == Path(args.points).resolve():
        raise OutputError(f"{args.output}: --output is also an input; choose another folder")
    place = None if frame is None else frame.to_world
    how = Carrying(_triple(args.columns), args.inverse, args.drop_invalid, kind, place)
    with whole_folder(args.output, overwrite=args.overwrite, watcher=console.journal) as folder:
        saved = mapping.load(args.map)
        console.stage(f"looking through {args.points}")
        parts = parts_of(args.points)
        console.stage("carrying points")
        found = carry_folder(args.scheduler, saved, parts, folder.absolute(), how)
    dropped = found.pop("dropped")
    if dropped:
        console.warn(f"{args.points}: {dropped} rows without finite coordinates were left out")
    _warn_of_outside(args.points, found, console)
    console.done(f"{found['carried']} points carried into {args.output}, {len(parts)} parts")
    console.answer({"points": found, "parts": len(parts)})


def _is_wireframe(args: Namespace) -> bool:
    """Return whether `map` is to write a surface: as the output's ending, and both files, say."""
    kind = ending(Path(args.output))
    if kind not in _SURFACES_OUT:
        return False
    return kind not in _POINTS_OUT or holds_surface(args.points)


def _carry_surface(
    args: Namespace, frame: ModelFrame | None, console: Console, outputs: Outputs
) -> None:
    """Carry a wireframe's vertices and write the same triangles between them."""
    console.stage(f"reading {args.points}")
    mesh, meta = read_surface_with_meta(args.points)
    from geounfold import mapping

    saved = mapping.load(args.map)
    console.stage("carrying vertices")
    vertices = mesh.V if frame is None else frame.to_world(mesh.V)
    carried = saved.carry(vertices, inverse=args.inverse)
    lost = int(np.count_nonzero(~np.isfinite(carried.points).all(axis=1)))
    if lost:
        raise InputError(
            f"{args.points}: {lost} of {len(mesh.V)} vertices lie too far from the control mesh to "
            "be carried; cut the wireframe nearer to the body, or write a table of its vertices"
        )
    with outputs.writing() as parts:
        write_surface(parts["--output"], type(mesh)(carried.points, mesh.F), meta)
    places = _places(result_columns(UNFOLDED, carried))
    _warn_of_outside(args.points, places, console)
    console.done(f"{len(mesh.V)} vertices carried into {args.output}")
    console.answer({"vertices": places})


def _flat(saved: UnfoldingMap | PointwiseMap) -> Callable[[Floats], dict[str, Any]]:
    """Return what carries points to the flat side, into output columns."""
    return lambda points: result_columns(UNFOLDED, saved.carry(points))


def _places(columns: dict[str, Any]) -> dict[str, int]:
    """Return how many points were carried, and how many of them not by the control mesh."""
    location = columns["location"]
    words = ("extrapolated", "outside")
    return {"carried": len(location), **{w: int(np.count_nonzero(location == w)) for w in words}}


def _warn_of_outside(path: str, places: dict[str, int], console: Console) -> None:
    """Say how many carried points the control mesh does not hold."""
    total, extrapolated, empty = (places[word] for word in ("carried", "extrapolated", "outside"))
    if extrapolated:
        console.warn(
            f"{path}: {extrapolated} of {total} points lie outside the control mesh and "
            "were carried by its continuation; they are marked extrapolated"
        )
    if empty:
        console.warn(
            f"{path}: {empty} of {total} points lie farther from the control mesh than "
            "the map reaches; they were left empty and are marked outside"
        )


def estimate(args: Namespace, console: Console) -> None:
    """Estimate a grade on blocks from samples, in the unfolded space of a saved map."""
    from geounfold.cli.estimating import estimation, summarised

    outputs = Outputs.planned(
        {"--output": (args.output, _POINTS_OUT), "--summary": (args.summary, _JSON)},
        _given(args.map, args.samples, args.points, args.variogram),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    table = _read(args.points, args, console)
    table.check_writable(args.output)
    samples = _read_samples(args, console)
    if samples is None:
        raise OptionError("estimate needs SAMPLES")
    result = estimation(args, samples, table, console.stage)
    summary = {**summarised(args, result, console.stage), "command": _command(args)}
    with outputs.writing() as parts:
        table.write(parts["--output"], result.columns)
        if "--summary" in parts:
            write_json(parts["--summary"], summary)
    for warning in result.warnings():
        console.warn(warning)
    known = result.blocks.counts()["estimated"]
    console.done(f"{args.grade} estimated on {known} of {len(table)} blocks into {args.output}")
    console.answer(summary)


def compare(args: Namespace, console: Console) -> None:
    """Try flatteners on one body or surface and write a table of how they did."""
    outputs = Outputs.planned(
        {"--output": (args.output, TABLE_ENDINGS)},
        _given(args.points, args.truth, _config(args)),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    how: dict[str, Any] = {"progress": console.stage}
    if args.methods is not None:
        how["methods"] = _listed(args.methods)
    elif args.truth is not None:
        raise OptionError("--truth is compared with unfolded blocks: give --methods too")
    if holds_surface(args.points):
        given: TriMesh | Floats = read_surface(args.points)
        _refuse_model_options(args)
    else:
        how["unfolding"] = _options(args)
        table = _read(args.points, args, console)
        given = table.points
        if args.truth is not None:
            how["truth"] = _truth(args, len(table), console)
    from geounfold import comparison

    every = "all" if args.methods is None else None
    names = every if args.flatteners is None else _listed(args.flatteners)
    frame = comparison.compare(given, names, **how)
    with outputs.writing() as parts:
        write_table(parts["--output"], frame)
    for _, row in frame[frame["error"] != ""].iterrows():
        if "method" in row:
            console.warn(f"method {row['method']} failed: {row['error']}")
        else:
            where = f"on the {row['surface']} surface"
            console.warn(f"{row['flattener']} failed {where}: {row['error']}")
    console.done(f"{len(frame)} rows written into {args.output}")
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    console.answer({"rows": rows}, lambda: table_text(frame))


def _listed(names: str) -> str | list[str]:
    """Return names separated by commas, or the word all."""
    found = [name.strip() for name in names.split(",")]
    return "all" if found == ["all"] else found


def _truth(args: Namespace, count: int, console: Console) -> Floats:
    """Read where the blocks truly lay, row by row."""
    console.stage(f"reading {args.truth}")
    truth = read_points(args.truth, _triple(args.truth_columns), prefer=(_TRUE,))
    if len(truth) != count:
        raise InputError(
            f"{args.truth}: has {len(truth)} rows, but {args.points} has {count}; rows must belong "
            "together one by one"
        )
    return truth.points


def crosscheck(args: Namespace, console: Console) -> None:
    """Unfold a body and check its control mesh against other meshes of the same border."""
    outputs = Outputs.planned(
        {
            "--output": (args.output, (*TABLE_ENDINGS, *_JSON)),
            "--differences": (args.differences, _POINTS_OUT),
        },
        _given(args.points, _config(args)),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    table = _read(args.points, args, console)
    if args.differences is not None:
        table.check_writable(args.differences)
    from geounfold import pipeline, verification
    from geounfold.cli.figures import crosscheck_lines

    given = {"meshers": args.meshers, "interiors": args.interiors}
    named: dict[str, Any] = {
        name: tuple(word.strip() for word in words.split(","))
        for name, words in given.items()
        if words is not None
    }
    chosen = verification.CrossCheckOptions(**named)
    result = pipeline.unfold(table.points, _options(args), progress=console.stage)
    check = verification.crosscheck(result, chosen, progress=console.stage)
    facts = {**check.as_dict(), "input": table.facts(), "command": _command(args)}
    console.stage("writing")
    with outputs.writing() as parts:
        if "--differences" in parts:
            columns = {f"difference_{name}": v for name, v in check.differences.items()}
            table.write(parts["--differences"], columns)
        if "--output" in parts and ending(Path(args.output)) in _JSON:
            write_json(parts["--output"], facts)
        elif "--output" in parts:
            write_table(parts["--output"], check.table)
    for warning in [*result.summary()["warnings"], *check.warnings]:
        console.warn(warning)
    console.done(f"{len(check.meshes) - 1} meshes compared")
    quiet = args.output is not None
    console.answer(facts, None if quiet else lambda: "".join(crosscheck_lines(check)))


def _refuse_model_options(args: Namespace) -> None:
    """Raise where options that shape a body's surfaces are given beside a surface."""
    given = [f"--{name}" for name in (*_MODEL, "config") if hasattr(args, name)]
    if given:
        raise OptionError(f"{given[0]} needs a table of points; {args.points} is one surface")


def quality(args: Namespace, console: Console) -> None:
    """Print how well an unfolding keeps distances, and how far from a truth it is."""
    outputs = Outputs.planned(
        {"--output": (args.output, _JSON)},
        _given(args.folded, args.unfolded, args.truth),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    folded = read_points(args.folded, _triple(args.columns))
    unfolded = read_points(args.unfolded, _triple(args.unfolded_columns), prefer=(UNFOLDED,))
    truth = None
    if args.truth is not None:
        truth = read_points(args.truth, _triple(args.truth_columns), prefer=(_TRUE,))
    for other in (unfolded, truth):
        if other is not None and len(other) != len(folded):
            raise InputError(
                f"{other.source}: has {len(other)} rows, but {folded.source} has {len(folded)}; "
                "rows must belong together one by one"
            )
    from geounfold.cli.figures import quality_figures

    console.stage("measuring")
    figures = quality_figures(
        folded.points,
        unfolded.points,
        None if truth is None else truth.points,
        _count(args.neighbours, "--neighbours"),
    )
    with outputs.writing() as parts:
        if "--output" in parts:
            write_json(parts["--output"], figures)
    console.done("measured")
    console.answer(figures, lambda: "".join(_figure_lines(figures)))


def simulate(args: Namespace, console: Console) -> None:
    """List the simulated bodies, or write one with its truth."""
    from geounfold import synthetic

    if args.list:
        if args.case is not None or args.output is not None:
            raise OptionError("--list stands alone: it neither takes a CASE nor writes a file")
        cases = {name: case.description for name, case in synthetic.CASES.items()}
        console.answer({"cases": cases}, lambda: _lined_up(cases))
        return
    if args.case is None or args.output is None:
        raise OptionError("simulate needs CASE and -o OUT, or --list")
    blocks = _count(args.blocks, "--blocks")
    outputs = Outputs.planned(
        {"--output": (args.output, _POINTS_OUT)},
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    console.stage("simulating")
    body = synthetic.simulate(args.case, blocks=blocks)
    frame = body.frame(4)
    with outputs.writing() as parts:
        write_table(parts["--output"], frame)
    console.done(f"{len(frame)} points written into {args.output}")
    console.answer({"case": args.case, "points": len(frame), "output": args.output})


def view(args: Namespace, console: Console) -> None:
    """Draw a saved map's control mesh, or points: folded and unfolded where a table has both."""
    outputs = Outputs.planned(
        {"--output": (args.output, _PICTURE)},
        [args.points],
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if ending(Path(args.points)) in _MAP:
        if args.colour is not None:
            raise OptionError("--colour needs a table of points, not a map")
        existing_file(Path(args.points))
        picture = _draw_map(args.points, console)
    else:
        picture = _draw_points(_read(args.points, args, console), args.colour, console)
    with outputs.writing() as parts:
        parts["--output"].write_bytes(picture)
    console.done(f"drawn into {args.output}")
    console.answer({"output": args.output})


def init(args: Namespace, console: Console) -> None:
    """Write every option with its default and what it does, to a file or to stdout."""
    outputs = Outputs.planned(
        {"--output": (args.output, _TOML)}, overwrite=args.overwrite, watcher=console.journal
    )
    from geounfold.config import template

    if args.output is None:
        console.say(template())
        return
    with outputs.writing() as parts:
        parts["--output"].write_text(template(), encoding="utf-8")
    console.done(f"options written into {args.output}")
    console.answer({"output": args.output})


def doctor(args: Namespace, console: Console) -> None:
    """Say what is installed and whether it works."""
    from geounfold.cli.checkup import check_up, healthy, in_words

    found = check_up(console.stage)
    console.done("checked")
    console.answer(found, lambda: in_words(found))
    healthy(found)


def completion(args: Namespace, console: Console) -> None:
    """Print what teaches a shell to complete the command line."""
    from geounfold.cli.completion import script

    console.say(script(args.shell))


def _draw_map(path: str, console: Console) -> bytes:
    """Return a picture of a saved map's control mesh in both spaces."""
    from geounfold import mapping, plotting
    from geounfold.control import scaled

    saved = mapping.load(path)
    folded = saved.frame.to_world(saved.control.folded.V)
    console.stage("drawing")
    return plotting.png(plotting.draw_control(scaled(saved.control, folded, saved.frame.scale)))


def _draw_points(table: PointTable, colour: str | None, console: Console) -> bytes:
    """Return a picture of points, coloured by a column, by layer or by height."""
    label = colour or _default_colour(table)
    there = _with_image(table)
    if not there.all():
        console.warn(f"{table.source}: {np.count_nonzero(~there)} points without an image left out")
    values = table.numbers(label)
    if not np.isfinite(values[there]).all():
        missing = np.flatnonzero(there & ~np.isfinite(values))
        raise InputError(
            f"{table.source}: column '{label}' has {len(missing)} missing or infinite values, "
            f"the first in data row {missing[0] + 1}; choose a column that every row has"
        )
    from geounfold import plotting

    console.stage("drawing")
    for names, title in ((UNFOLDED, "unfolded"), (_TRUE, "truth")):
        if set(names) <= set(table.frame.columns) and names != table.columns:
            twin = np.column_stack([table.numbers(name) for name in names])[there]
            titles = ("unfolded" if table.columns == UNFOLDED else "folded", title)
            return plotting.png(
                plotting.draw_bodies(table.points[there], twin, values[there], label, titles=titles)
            )
    return plotting.png(plotting.draw_body(table.points[there], values[there], label))


def _with_image(table: PointTable) -> Bools:
    """Return which rows of a table do not lie outside the reach of the map that carried them."""
    if "location" not in table.frame.columns:
        return np.ones(len(table), dtype=bool)
    return np.asarray(table.frame["location"].astype(str) != "outside", dtype=bool)


def _default_colour(table: PointTable) -> str:
    """Return the column to colour by: of a result, how high in the layer; else the height."""
    result = {"stratigraphic", *UNFOLDED} <= set(table.frame.columns)
    return "stratigraphic" if result else table.columns[2]


def _check_pictures(console: Console) -> None:
    """Raise where nothing can be drawn, before anything is computed."""
    from geounfold import plotting

    console.stage("checking off-screen rendering")
    plotting.check_rendering()


def _given(*paths: str | None) -> list[str]:
    return [path for path in paths if path is not None]


def _triple(text: str | None) -> Triple | None:
    return None if text is None else parse_columns(text)


def _read(
    path: str,
    args: Namespace,
    console: Console,
    prefer: tuple[Triple, ...] = (),
    frame: ModelFrame | None = None,
) -> PointTable:
    """Read the points of a command, and say what was left out."""
    console.stage(f"reading {path}")
    columns = _triple(args.columns)
    place = None if frame is None else frame.to_world
    table = read_points(path, columns, prefer=prefer, drop_invalid=args.drop_invalid, place=place)
    _say_dropped(table, path, console)
    return table


def _open(
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
        return _read(args.points, args, console, prefer, frame)
    from geounfold.io.streams import open_points

    console.stage(f"reading {args.points}")
    columns = _triple(args.columns)
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


def _read_samples(args: Namespace, console: Console) -> PointTable | None:
    if args.samples is None:
        return None
    console.stage(f"reading {args.samples}")
    columns = _triple(args.samples_columns)
    table = read_points(args.samples, columns, drop_invalid=args.drop_invalid)
    if len(table.dropped):
        console.warn(f"{args.samples}: {len(table.dropped)} rows were left out")
    return table


def _options(args: Namespace) -> UnfoldOptions:
    """Return the options given by words and file, words first; the pipeline knows the others."""
    from geounfold.options import UnfoldOptions

    readers: dict[str, Callable[[str], Any]] = {
        "up": _direction,
        "body": _body,
        "neighbours": lambda text: _count(text, "--neighbours"),
        "reach": _reach,
    }
    given = {n: getattr(args, n) for n in _MODEL if hasattr(args, n)}
    values: dict[str, Any] = {n: readers.get(n, str)(text) for n, text in given.items()}
    if hasattr(args, "allow_uncertified"):
        values["allow_uncertified"] = args.allow_uncertified
    path = _config(args)
    return UnfoldOptions(**values) if path is None else replace(_read_config(path), **values)


def _read_config(path: str) -> UnfoldOptions:
    """Return the options in a TOML file."""
    from geounfold.config import from_toml

    try:
        text = existing_file(Path(path)).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise OptionError(f"{path}: not valid TOML: not UTF-8 text") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    return from_toml(text, path)


def _config(args: Namespace) -> str | None:
    path: str | None = getattr(args, "config", None)
    return path


def _command(args: Namespace) -> str:
    """Return the command that repeats the run, in a shell's words."""
    return shlex.join(["geounfold", *args.words])


def _direction(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError as error:
        raise OptionError(f"--up needs three numbers such as 0,0,1, not '{text}'") from error
    return x, y, z


def _reach(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise OptionError(f"--reach needs a number of blocks such as 3, not '{text}'") from error


def _body(text: str) -> int | str:
    if text == "all":
        return text
    if not text.isdecimal():
        raise OptionError(f"--body needs the number of a body, or all, not '{text}'")
    return int(text)


def _count(text: str | None, option: str) -> int | None:
    if text is None:
        return None
    if not text.isdecimal() or int(text) < 1:
        raise OptionError(f"{option} needs a whole number of 1 or more, not '{text}'")
    return int(text)


def _lined_up(texts: dict[str, str]) -> str:
    """Return names and texts as two columns."""
    width = max(map(len, texts))
    return "".join(f"{name:<{width}}  {text}\n" for name, text in texts.items())


def _figure_lines(figures: dict[str, Any]) -> list[str]:
    """Return figures as aligned lines, groups of statistics as a table below the others."""
    width = max(map(len, figures))
    groups = {name: value for name, value in figures.items() if isinstance(value, dict)}
    plain = {name: value for name, value in figures.items() if name not in groups}
    lines = [f"{name:<{width}}  {_figure(value)}\n" for name, value in plain.items()]
    for number, (name, group) in enumerate(groups.items()):
        if number == 0:
            head = "".join(f"{key:>13}" for key in group)
            lines.append(f"\n{'':<{width}}{head}\n")
        cells = "".join(f"{_figure(value):>13}" for value in group.values())
        lines.append(f"{name:<{width}}{cells}\n")
    return lines


def _figure(value: Any) -> str:
    """Return a figure to six digits; several one after the other; a dash for none."""
    if isinstance(value, tuple | list):
        return "  ".join(map(_figure, value))
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
