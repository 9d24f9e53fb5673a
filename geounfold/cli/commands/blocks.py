"""`geounfold grid` and `transfer`: a grid of blocks, values moved between the spaces."""

from __future__ import annotations

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.cli.file_endings import JSON, POINTS_OUT
from geounfold.cli.inputs.block_sizes import columns_or_lengths
from geounfold.cli.inputs.model_frame import model_axes, model_frame, three_numbers
from geounfold.cli.inputs.unfold_options import whole_number
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError
from geounfold.io import Outputs, PointTable, read_points, write_json
from geounfold.io.coordinate_columns import Triple, parse_columns
from geounfold.io.paths import TABLE_ENDINGS, existing_file
from geounfold.io.result_columns import UNFOLDED, world_columns
from geounfold.io.tables.files import write_table
from geounfold.io.tables.points import Place

if TYPE_CHECKING:
    from geounfold.body.block_model import BlockModel
    from geounfold.estimation.transfer import Transfer
    from geounfold.geometry.mesh import Bools, Floats
    from geounfold.mapping.mesh_map import UnfoldingMap

_SPACES = ("folded", "unfolded")


def grid(args: Namespace, console: Console) -> None:
    """Write a regular grid of blocks that covers unfolded points."""
    sides = three_numbers(args.sizes, "--sizes")
    outputs = Outputs.planned(
        {"--output": (args.output, TABLE_ENDINGS)},
        [args.points, *([] if args.map is None else [args.map])],
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if args.map is not None:
        existing_file(Path(args.map))
    table = _read_blocks(
        args.points, args.columns, (UNFOLDED,), args=args, console=console, gaps=True
    )
    from geounfold.body.block_model import regular_grid
    from geounfold.mapping import mesh_map

    console.stage("making the grid")
    blocks = regular_grid(table.points, np.array(sides))
    if args.map is not None:
        saved = mesh_map.load(args.map)
        console.stage("finding the blocks in the body")
        held = _held(saved, blocks)
        if not held.any():
            raise InputError(f"{args.map}: no block of the grid lies in this map's body")
    else:
        held = np.ones(len(blocks), dtype=bool)
    index = np.rint(blocks.centroids / blocks.sizes - 0.5).astype(np.int64)
    index -= index.min(axis=0)
    columns = dict(zip("xyz", blocks.centroids[held].T, strict=True))
    columns |= dict(zip(("dx", "dy", "dz"), blocks.sizes[held].T, strict=True))
    columns |= dict(zip("ijk", index[held].T, strict=True))
    with outputs.writing() as parts:
        write_table(parts["--output"], pd.DataFrame(columns))
    count = int(np.count_nonzero(held))
    console.done(f"{count} blocks written into {args.output}")
    console.answer({"blocks": count, "covering": len(blocks), "sizes": list(sides)})


def transfer(args: Namespace, console: Console) -> None:
    """Move values between blocks of the two spaces, weighted by volume."""
    if args.to not in _SPACES:
        raise OptionError(f"--to must be folded or unfolded, not '{args.to}'")
    split = whole_number(args.split, "--split")
    outputs = Outputs.planned(
        {"--output": (args.output, POINTS_OUT), "--summary": (args.summary, JSON)},
        [args.map, args.source, args.target],
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    existing_file(Path(args.map))
    back = args.to == "folded"
    flat: tuple[Triple, ...] = (UNFOLDED,)
    frame = None if args.origin is None else model_frame(args)
    place = None if frame is None else frame.to_world
    here, there = (flat, None), ((), place)
    read = partial(_read_blocks, args=args, console=console)
    source = read(args.source, args.source_columns, *(here if back else there))
    target = read(args.target, args.target_columns, *(there if back else here))
    names = _value_columns(args.values, source)
    target.check_writable(args.output)
    values = np.column_stack([source.numbers(name) for name in names])
    axes = model_axes(args.rotation) if frame is None else frame.axes
    from geounfold.estimation.transfer import transfer as moved
    from geounfold.mapping import mesh_map

    saved = mesh_map.load(args.map)
    level = np.eye(3)
    from_blocks = _blocks(source, args.source_sizes, level if back else axes)
    to_blocks = _blocks(target, args.target_sizes, axes if back else level)
    console.stage("moving values")
    carry = saved.to_flat if back else saved.to_folded
    result = moved(from_blocks, values, to_blocks, carry, split=split)
    columns: dict[str, Any] = {}
    for k, name in enumerate(names):
        columns |= {name: result.means[:, k], f"{name}_share": result.share[:, k]}
    if back and frame is not None:
        columns |= world_columns(target.points)
    facts = _facts(names, result)
    with outputs.writing() as parts:
        target.write(parts["--output"], columns)
        if "--summary" in parts:
            write_json(parts["--summary"], facts)
    for name in names:
        lost = facts["values"][name]["unassigned"]
        if lost:
            console.warn(
                f"{args.target}: {lost} of {len(target)} blocks got no value of {name}: no block "
                f"of {args.source} that has one lies at their image"
            )
    console.done(f"{len(names)} values moved onto {len(target)} blocks in {args.output}")
    console.answer(facts)


def _facts(names: list[str], result: Transfer) -> dict[str, Any]:
    """Return what was moved, and whether volume times value was kept."""
    lost = np.count_nonzero(~result.assigned, axis=0)
    partly = np.count_nonzero(result.assigned & (result.share < 1), axis=0)
    return {
        "blocks": len(result.volumes),
        "values": {
            name: {
                "unassigned": int(lost[k]),
                "partly_assigned": int(partly[k]),
                "source_total": float(result.total[k]),
                "target_total": float(result.carried[k]),
            }
            for k, name in enumerate(names)
        },
    }


def _held(saved: UnfoldingMap, blocks: BlockModel) -> Bools:
    """Return which blocks of the flat space have a part in the control mesh, (n,)."""
    from geounfold.backends.threads import slices

    held = np.zeros(len(blocks), dtype=bool)
    for rows in slices(len(blocks), 1 << 15):
        parts = blocks.sub_points(2, rows)
        inside = saved.carry(parts.reshape(-1, 3), inverse=True).inside
        held[rows] = inside.reshape(parts.shape[:2]).any(axis=1)
    return held


def _read_blocks(
    path: str,
    columns: str | None,
    prefer: tuple[Triple, ...],
    place: Place | None = None,
    *,
    args: Namespace,
    console: Console,
    gaps: bool = False,
) -> PointTable:
    """Read points; with `gaps`, rows without coordinates (no image) are passed over."""
    console.stage(f"reading {path}")
    names = None if columns is None else parse_columns(columns)
    drop = gaps or args.drop_invalid
    table = read_points(path, names, prefer=prefer, drop_invalid=drop, place=place)
    if len(table.dropped):
        console.warn(f"{path}: {len(table.dropped)} rows without finite coordinates were left out")
    return table


def _value_columns(text: str, source: PointTable) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise OptionError(f"--values needs different column names such as AU,CU, not '{text}'")
    missing = [name for name in names if name not in source.frame.columns]
    if missing:
        raise InputError(f"{source.source}: no column '{missing[0]}' for --values")
    return names


def _blocks(table: PointTable, sizes: str | None, axes: Floats | None) -> BlockModel:
    """Return a table's blocks; `sizes` are three columns or three lengths."""
    from geounfold.io.block_sizes import block_model

    given = None if sizes is None else columns_or_lengths(sizes)
    return block_model(table.frame, table.points, given, axes, source=table.source)
