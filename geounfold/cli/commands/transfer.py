"""`geounfold transfer`: values moved between folded and unfolded blocks."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from geounfold.cli.answers.file_endings import JSON, POINTS_OUT
from geounfold.cli.domains.maps import domain_parts, domains_of, load_map
from geounfold.cli.inputs.block_sizes import columns_or_lengths
from geounfold.cli.inputs.model_frame import model_axes, model_frame
from geounfold.cli.inputs.numbers import whole_number
from geounfold.cli.inputs.points import read_table, where_of
from geounfold.cli.inputs.values import read_grade, values_rules
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError
from geounfold.estimation.transfer import Transfer
from geounfold.io import Outputs, PointTable, write_json
from geounfold.io.packages.names import Triple
from geounfold.io.paths import existing_file
from geounfold.io.result_columns import UNFOLDED, world_columns
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    from geounfold.body.block_model import BlockModel
    from geounfold.geometry.mesh import Floats
    from geounfold.mapping.domain_map import DomainMap
    from geounfold.mapping.mesh_map import UnfoldingMap

_SPACES = ("folded", "unfolded")


def run(args: Namespace, console: Console) -> None:
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
    frame = None if args.origin is None else model_frame(args)
    place = None if frame is None else frame.to_world
    read = partial(read_table, console=console, drop_invalid=args.drop_invalid)
    flat: dict[str, tuple[Triple, ...]] = {"prefer": (UNFOLDED,)}
    folded = {"place": place}
    source = read(
        args.source, args.source_columns, **(flat if back else folded),
        where=where_of(args, "source_where"), element=args.source_element,
    ).only()  # fmt: skip
    whole = read(
        args.target, args.target_columns, **(folded if back else flat),
        where=where_of(args), element=args.target_element,
    )  # fmt: skip
    target = PartedTable.chosen(whole)
    names = _value_columns(args.values, source)
    target.check_writable(args.output)
    rules = values_rules(args)
    rules.check_columns(names, source.source)
    values = np.column_stack([read_grade(source, name, args, console, rules) for name in names])
    axes = model_axes(args.rotation) if frame is None else frame.axes
    saved = load_map(args)
    several = domains_of(saved)
    console.stage("moving values")
    if several is None:
        moving = _Moving(args, axes, split, back=back)
        result = moving.onto(cast("UnfoldingMap", saved), source, values, target)
    else:
        target, result = _by_domain(
            several, _Moving(args, axes, split, back=back), (source, values), whole, args, console
        )
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
                f"of {args.source} with a value lies at their image"
            )
    console.done(f"{len(names)} values moved onto {len(target)} blocks in {args.output}")
    console.answer(facts)


@dataclass(frozen=True)
class _Moving:
    """How values are moved: the sides of blocks, the axes of the folded ones, the direction."""

    args: Namespace
    axes: Floats | None
    split: int
    back: bool

    def onto(
        self,
        saved: UnfoldingMap,
        source: PointTable,
        values: Floats,
        target: PointTable | PartedTable,
    ) -> Transfer:
        """Return the values (m, k) of a source's blocks on a target's."""
        from geounfold.estimation.transfer import transfer

        level = np.eye(3)
        axes, back = self.axes, self.back
        from_blocks = _blocks(source, self.args.source_sizes, level if back else axes)
        to_blocks = _blocks(target, self.args.target_sizes, axes if back else level)
        carry = saved.to_flat if back else saved.to_folded
        return transfer(from_blocks, values, to_blocks, carry, split=self.split)


def _by_domain(
    maps: DomainMap,
    moving: _Moving,
    given: tuple[PointTable, Floats],
    target: PointTable,
    args: Namespace,
    console: Console,
) -> tuple[PartedTable, Transfer]:
    """Return the target divided by domains, and the values that each gets from its own source."""
    source, values = given
    to, _ = domain_parts(target, maps, args, console, inverse=not moving.back)
    start, _ = domain_parts(source, maps, args, console, inverse=moving.back)
    means = np.full((len(target), values.shape[1]), np.nan)
    share, volumes = np.zeros_like(means), np.zeros(len(target))
    total = np.zeros(values.shape[1])
    for k, saved in enumerate(maps.values()):
        rows, own = to.rows_of(k), start.rows_of(k)
        if rows.any() and own.any():
            found = moving.onto(saved, source.only(own), values[own], target.only(rows))
            means[rows], share[rows], volumes[rows] = found.means, found.share, found.volumes
            total += found.total
    parted = PartedTable(target, np.where(to.part >= 0, 0, to.part))
    every = to.part >= 0
    return parted, Transfer(means[every], share[every], volumes[every], total)


def _facts(names: list[str], result: Transfer) -> dict[str, Any]:
    """Return, by value, the blocks without it and the sums of volume times value."""
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


def _value_columns(text: str, source: PointTable) -> list[str]:
    """Return the columns that --values names."""
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise OptionError(f"--values needs different column names such as AU,CU, not '{text}'")
    missing = [name for name in names if name not in source.frame.columns]
    if missing:
        raise InputError(f"{source.source}: no column '{missing[0]}' for --values")
    return names


def _blocks(table: PointTable | PartedTable, sizes: str | None, axes: Floats | None) -> BlockModel:
    """Return a table's blocks; `sizes` are three columns or three lengths."""
    from geounfold.io.block_sizes import block_model

    given = None if sizes is None else columns_or_lengths(sizes)
    return block_model(table.frame, table.points, given, axes, source=table.source)
