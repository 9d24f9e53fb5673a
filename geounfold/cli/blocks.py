"""The commands for block models: a grid over unfolded blocks, values moved between the spaces."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.cli.console import Console
from geounfold.cli.frames import model_axes, model_frame, three_numbers
from geounfold.errors import InputError, OptionError
from geounfold.io import Outputs, PointTable, read_points, write_json
from geounfold.io.coordinates import Triple, parse_columns
from geounfold.io.formats import point_endings
from geounfold.io.points import Place
from geounfold.io.results import UNFOLDED, world_columns
from geounfold.io.tables import TABLE_ENDINGS, existing_file, write_table

if TYPE_CHECKING:
    from geounfold.blockmodel import BlockModel, Transfer
    from geounfold.mapping import UnfoldingMap
    from geounfold.mesh import Bools, Floats

_POINTS_OUT = (*TABLE_ENDINGS, *point_endings(writing=True))
_JSON = (".json",)
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
    table = _read(args.points, args.columns, args, console, (UNFOLDED,), gaps=True)
    from geounfold import mapping
    from geounfold.blockmodel import regular_grid

    console.stage("making the grid")
    blocks = regular_grid(table.points, np.array(sides))
    if args.map is not None:
        saved = mapping.load(args.map)
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
    split = _whole(args.split, "--split")
    outputs = Outputs.planned(
        {"--output": (args.output, _POINTS_OUT), "--summary": (args.summary, _JSON)},
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
    source = _read(args.source, args.source_columns, args, console, *(here if back else there))
    target = _read(args.target, args.target_columns, args, console, *(there if back else here))
    names = _value_columns(args.values, source)
    target.check_writable(args.output)
    values = np.column_stack([source.numbers(name) for name in names])
    axes = model_axes(args.rotation) if frame is None else frame.axes
    from geounfold import mapping
    from geounfold.blockmodel import transfer as moved

    saved = mapping.load(args.map)
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
    from geounfold.threads import slices

    held = np.zeros(len(blocks), dtype=bool)
    for rows in slices(len(blocks), 1 << 15):
        parts = blocks.sub_points(2, rows)
        inside = saved.carry(parts.reshape(-1, 3), inverse=True).inside
        held[rows] = inside.reshape(parts.shape[:2]).any(axis=1)
    return held


def _read(
    path: str,
    columns: str | None,
    args: Namespace,
    console: Console,
    prefer: tuple[Triple, ...],
    place: Place | None = None,
    *,
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
    from geounfold.blockmodel import block_model

    given = None if sizes is None else _columns_or_lengths(sizes)
    return block_model(table.frame, table.points, given, axes, source=table.source)


def _columns_or_lengths(text: str) -> Triple | tuple[float, float, float]:
    try:
        a, b, c = (float(word) for word in text.split(","))
    except ValueError:
        return parse_columns(text)
    return a, b, c


class BlockVolumes:
    """The columns of a block model's volumes, folded and unfolded, and their sums.

    Parameters
    ----------
    sizes : str or None
        Three columns or lengths as the user gave them; without, columns are found by name.
    names : sequence of str
        The table's columns.
    source : str
        The table, for messages.

    Raises
    ------
    InputError
        Columns that are not there.
    OptionError
        Lengths that are not positive.
    """

    def __init__(self, sizes: str | None, names: Sequence[str], source: str) -> None:
        from geounfold.blockmodel.sizes import Sides, size_columns

        self._sides: Sides | None = None
        self._folded = self._unfolded = 0.0
        self._without = 0
        if sizes is None:
            with suppress(InputError):  # several sets of columns: none is taken unasked
                found = size_columns(names)
                self._sides = None if found is None else Sides(found)
            return
        given = _columns_or_lengths(sizes)
        for value in given:
            if isinstance(value, str) and value not in names:
                raise InputError(f"{source}: no column '{value}' for --sizes")
            if not isinstance(value, str) and not 0 < value < np.inf:
                raise OptionError(f"--sizes needs three positive lengths, not '{sizes}'")
        self._sides = Sides(given)

    def columns(self, frame: pd.DataFrame, results: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return block_volume and unfolded_volume of a batch of rows; nothing without sides."""
        if self._sides is None:
            return {}
        volume = self._sides.of(frame).prod(axis=1)
        unfolded = volume * results["volume_ratio"]
        self._without += int(np.count_nonzero(np.isnan(volume)))
        self._folded += float(np.nansum(volume))
        self._unfolded += float(np.nansum(unfolded))
        return {"block_volume": volume, "unfolded_volume": unfolded}

    def facts(self) -> dict[str, Any]:
        """Return the sums over all batches, for the summary."""
        if self._sides is None:
            return {}
        return {
            "block_volumes": {
                "folded": self._folded,
                "unfolded": self._unfolded,
                "without_sides": self._without,
            }
        }

    def warnings(self) -> list[str]:
        """Say how many rows had no sides."""
        if not self._without:
            return []
        return [f"{self._without} blocks have no positive sides, and so no volume"]


def _whole(text: str, option: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise OptionError(f"{option} needs a whole number of 1 or more, not '{text}'")
    return int(text)
