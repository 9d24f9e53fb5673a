"""`geounfold map`: other points, wireframes or drill-holes carried with a saved map."""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from geounfold.cli.answers.file_endings import POINTS_OUT, SURFACES_OUT, TRACES
from geounfold.cli.answers.locations import flat_columns, outside_warnings, place_counts
from geounfold.cli.domains.maps import domain_parts, domains_of, load_map, one_map
from geounfold.cli.domains.unfold import carried_holes, placed_told
from geounfold.cli.inputs.drillholes import check_hole_options, read_holes
from geounfold.cli.inputs.model_frame import model_frame
from geounfold.cli.inputs.points import files_given, open_table, triple
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError, OutputError
from geounfold.io import Outputs, holds_surface, write_surface
from geounfold.io.paths import ending, existing_file
from geounfold.io.result_columns import (
    FOLDED,
    UNFOLDED,
    given_blocks,
    result_columns,
    world_columns,
)
from geounfold.io.strings import STRINGS_OUT, holds_strings, read_strings, write_strings
from geounfold.io.surfaces import read_surface_with_meta
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.body.model_frame import ModelFrame
    from geounfold.geometry.mesh import Floats
    from geounfold.io import PointTable
    from geounfold.io.tables.large import PointStream
    from geounfold.mapping.carried import Carried
    from geounfold.mapping.domain_map import DomainMap
    from geounfold.mapping.mesh_map import UnfoldingMap


def run(args: Namespace, console: Console) -> None:
    """Carry points, a wireframe or drill-holes with a saved map; points also back."""
    check_hole_options(args)
    _check_options(args)
    frame = model_frame(args, console, None if args.inverse else args.points)
    if frame is not None and (args.points is None or args.inverse):
        raise OptionError("--origin needs POINTS in the folded space, without --inverse")
    if args.engine == "dask":
        _carry_on_cluster(args, frame, console)
        return
    outputs = Outputs.planned(
        {
            "--output": (
                args.output,
                tuple(dict.fromkeys((*POINTS_OUT, *SURFACES_OUT, *STRINGS_OUT))),
            ),
            "--samples-out": (args.samples_out, POINTS_OUT),
            "--traces-out": (args.traces_out, TRACES),
        },
        files_given(args.map, args.points, *(args.holes or ())),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    if args.points is not None and _is_strings(args):
        _carry_strings(args, frame, console, outputs)
    elif args.points is not None and _is_wireframe(args):
        _carry_surface(args, frame, console, outputs)
    else:
        _carry_points(args, frame, console, outputs)


def _check_options(args: Namespace) -> None:
    """Raise OptionError if options contradict each other."""
    if (args.points is None) != (args.output is None):
        raise OptionError(
            "map needs POINTS and -o OUT, or --holes with --samples-out or --traces-out"
        )
    if args.holes is None and args.samples_out is not None:
        raise OptionError("--samples-out needs --holes COLLAR SURVEY ASSAY")
    if args.engine == "dask" and (args.points is None or args.holes is not None):
        raise OptionError("--engine dask carries POINTS into -o OUT, no drill-holes")
    if args.engine == "dask" and args.where is not None:
        raise OptionError("--engine dask carries all rows: go without --where")
    if args.engine != "dask" and args.scheduler is not None:
        raise OptionError("--scheduler needs --engine dask")
    if args.holes is not None and args.inverse:
        raise OptionError("--holes are in the folded space: without --inverse")


def _carry_points(
    args: Namespace, frame: ModelFrame | None, console: Console, outputs: Outputs
) -> None:
    """Carry a table, drill-holes, or both."""
    saved = load_map(args)
    several = domains_of(saved)
    table: PointTable | PointStream | PartedTable | None = None
    carryings: list[_Carrying] = []
    if args.points is not None:
        prefer = (UNFOLDED,) if args.inverse else ()
        opened = open_table(args, console, prefer, frame=frame, keep=several is not None)
        if args.inverse and args.columns is None and tuple(opened.columns) != UNFOLDED:
            console.note(
                f"{args.points}: no columns {', '.join(UNFOLDED)}: {', '.join(opened.columns)} "
                "were taken as coordinates in the flat space"
            )
        if several is None:
            table = PartedTable.chosen(opened)
            carryings = [_Carrying(cast("UnfoldingMap", saved), frame, args)]
        else:
            table, carryings = _by_domain(several, opened, frame, args, console)
    holes = read_holes(args, console, where="where" if args.points is None else "")
    console.stage("carrying points")
    if several is not None:
        traced = carried_holes(several, args.by or several.column, holes)
    else:
        flat = flat_columns(cast("UnfoldingMap", saved))
        traced = {} if holes is None else holes.carried(flat)
    with outputs.writing() as parts:
        if table is not None:
            table.write_parts(parts["--output"], *(c.columns for c in carryings))
            if not any(c.unsolved_warnings(args.points) for c in carryings):
                _check_reached(args.points, sum((c.counts for c in carryings), Counter()))
        if holes is not None:
            holes.write(parts, traced)
    counts = {name: place_counts(found) for name, found in traced.items() if found}
    warnings = []
    if table is not None:
        total = sum((c.counts for c in carryings), Counter({"carried": 0}))
        points = {word: total[word] for word in ("carried", "extrapolated", "outside")}
        counts = {"points": points, **counts}
        warnings = outside_warnings(args.points, points)
        for carrying in carryings:
            warnings += carrying.unsolved_warnings(args.points)
    if several is not None:
        told = {f"the holes' {name}": columns for name, columns in traced.items()}
        warnings += placed_told(args.by or several.column, told)
    for name in traced:
        warnings += outside_warnings(f"the holes' {name}", counts[name])
    for warning in warnings:
        console.warn(warning)
    written = {args.output: counts.get("points"), args.samples_out: counts.get("samples")}
    done = [f"{c['carried']} points carried into {path}" for path, c in written.items() if c]
    console.done(", ".join(done) or f"traces carried into {args.traces_out}")
    console.answer(counts)


def _check_reached(source: str, counts: Counter[str]) -> None:
    """Raise InputError if the map reaches none of the points."""
    if counts["carried"] and counts["outside"] == counts["carried"]:
        raise InputError(
            f"{source}: the map reaches none of the {counts['carried']} points: are they in the "
            "coordinates of the body that was unfolded?"
        )


def _by_domain(
    maps: DomainMap,
    table: PointTable | PointStream,
    frame: ModelFrame | None,
    args: Namespace,
    console: Console,
) -> tuple[PartedTable, list[_Carrying]]:
    """Return a table divided by the domains of a map, and what carries each part."""
    parted, own = domain_parts(table, maps, args, console, inverse=args.inverse)
    named = [{} if own else {maps.column: name} for name in maps]
    carryings = [
        _Carrying(saved, frame, args, more)
        for saved, more in zip(maps.values(), named, strict=True)
    ]
    if not own:  # the last part: points that no map reaches
        nearest = next(iter(maps.values()))
        carryings.append(_Carrying(nearest, frame, args, {maps.column: ""}))
    return parted, carryings


class _Carrying:
    """Output columns of points, batch by batch, and counts over all batches."""

    def __init__(
        self,
        saved: UnfoldingMap,
        frame: ModelFrame | None,
        args: Namespace,
        more: Mapping[str, str] | None = None,
    ) -> None:
        self._saved, self._frame, self._inverse = saved, frame, args.inverse
        self._more = more or {}
        self.counts: Counter[str] = Counter()
        self._unsolved = 0

    def columns(self, frame: pd.DataFrame, points: Floats, __: slice) -> dict[str, Any]:
        """Return the output columns of a batch of points."""
        blocks = given_blocks(frame, inverse=self._inverse)
        if blocks is not None and getattr(self._saved, "faulted", False):
            carried = self._saved.carry_by_block(points, blocks, inverse=True)
        else:
            carried = self._saved.carry(points, inverse=self._inverse)
        found = result_columns(FOLDED if self._inverse else UNFOLDED, carried)
        self.counts.update(place_counts(found))
        self._unsolved += carried.unsolved if self._inverse else 0
        own = {name: np.full(len(points), word) for name, word in self._more.items()}
        world = {} if self._frame is None else world_columns(points)
        return {**own, **world, **found}

    def unsolved_warnings(self, source: str) -> list[str]:
        """Return the warning of points in the control mesh without an inverse."""
        if not self._unsolved:
            return []
        return [
            f"{source}: {self._unsolved} points lie inside the control mesh, but the inverse "
            f"of its {self._saved.coordinates} coordinates was not found there; they were left "
            "empty too"
        ]


def _carry_on_cluster(args: Namespace, frame: ModelFrame | None, console: Console) -> None:
    """Carry a table in parts by a Dask cluster, into a folder of parts."""
    kind = ending(Path(args.output))
    if kind not in (".csv", ".parquet"):
        raise OptionError(
            f"--engine dask writes a folder that ends in .csv or .parquet, not '{args.output}'"
        )
    from geounfold.io.outputs import whole_folder
    from geounfold.io.tables.parts import parts_of
    from geounfold.unfolding.dask_map import Carrying, carry_folder

    existing_file(Path(args.map))
    if Path(args.output).resolve() == Path(args.points).resolve():
        raise OutputError(f"{args.output}: --output is also an input; choose another folder")
    place = None if frame is None else frame.to_world
    how = Carrying(triple(args.columns), args.inverse, args.drop_invalid, kind, place)
    with whole_folder(args.output, overwrite=args.overwrite, watcher=console.journal) as folder:
        saved = one_map(args)
        console.stage(f"looking through {args.points}")
        parts = parts_of(args.points)
        console.stage("carrying points")
        found = carry_folder(args.scheduler, saved, parts, folder.absolute(), how)
    dropped = found.pop("dropped")
    if dropped:
        console.warn(f"{args.points}: {dropped} rows without finite coordinates were left out")
    for warning in outside_warnings(args.points, found):
        console.warn(warning)
    console.done(f"{found['carried']} points carried into {args.output}, {len(parts)} parts")
    console.answer({"points": found, "parts": len(parts)})


def _is_wireframe(args: Namespace) -> bool:
    """Return whether a surface is written: by the ending of OUT, or by those of both files."""
    kind = ending(Path(args.output))
    if kind not in SURFACES_OUT:
        return False
    return kind not in POINTS_OUT or holds_surface(args.points, args.element)


def _is_strings(args: Namespace) -> bool:
    """Return whether strings are written: by the ending of OUT and the content of POINTS."""
    return ending(Path(args.output)) in STRINGS_OUT and holds_strings(args.points)


def _carry_strings(
    args: Namespace, frame: ModelFrame | None, console: Console, outputs: Outputs
) -> None:
    """Carry the vertices of strings and write the same strings through them."""
    console.stage(f"reading {args.points}")
    if args.where is not None:
        raise OptionError(f"--where chooses rows of a table; {args.points} holds strings")
    strings = read_strings(args.points)
    placed = _carried_vertices(args, strings.xyz, frame, console, "string")
    with outputs.writing() as parts:
        write_strings(parts["--output"], replace(strings, xyz=placed.points))
    _told(args, placed, console)


def _carried_vertices(
    args: Namespace, vertices: Floats, frame: ModelFrame | None, console: Console, what: str
) -> Carried:
    """Return the carried vertices of a wireframe or of strings.

    Raises
    ------
    InputError
        Some lie beyond the map's reach.
    """
    saved = one_map(args)
    console.stage("carrying vertices")
    placed = vertices if frame is None else frame.to_world(vertices)
    carried = saved.carry(placed, inverse=args.inverse)
    lost = int(np.count_nonzero(~np.isfinite(carried.points).all(axis=1)))
    if lost:
        raise InputError(
            f"{args.points}: {lost} of {len(vertices)} vertices lie too far from the control mesh "
            f"to be carried; cut the {what} nearer to the body, or write a table of its vertices"
        )
    return carried


def _told(args: Namespace, carried: Carried, console: Console) -> None:
    """Tell how many vertices were carried, and which lie outside."""
    counts = place_counts(result_columns(UNFOLDED, carried))
    for warning in outside_warnings(args.points, counts):
        console.warn(warning)
    console.done(f"{len(carried.points)} vertices carried into {args.output}")
    console.answer({"vertices": counts})


def _carry_surface(
    args: Namespace, frame: ModelFrame | None, console: Console, outputs: Outputs
) -> None:
    """Carry a wireframe's vertices and write the same triangles between them."""
    console.stage(f"reading {args.points}")
    if args.where is not None:
        raise OptionError(f"--where chooses rows of a table; {args.points} is a surface")
    mesh, meta = read_surface_with_meta(args.points, args.element)
    carried = _carried_vertices(args, mesh.V, frame, console, "wireframe")
    with outputs.writing() as parts:
        write_surface(parts["--output"], type(mesh)(carried.points, mesh.F), meta)
    _told(args, carried, console)
