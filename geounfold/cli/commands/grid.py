"""`geounfold grid`: a regular grid of blocks over unfolded points."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
import pandas as pd

from geounfold.cli.domains.maps import domain_parts, domains_of, load_map
from geounfold.cli.inputs.numbers import three_numbers
from geounfold.cli.inputs.points import files_given, read_table, where_of
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError
from geounfold.io import Outputs
from geounfold.io.paths import TABLE_ENDINGS, existing_file
from geounfold.io.result_columns import UNFOLDED
from geounfold.io.tables.files import write_table

if TYPE_CHECKING:
    from geounfold.body.block_model import BlockModel
    from geounfold.geometry.mesh import Bools, Floats
    from geounfold.io import PointTable
    from geounfold.mapping.mesh_map import UnfoldingMap


def run(args: Namespace, console: Console) -> None:
    """Write a regular grid of blocks that covers unfolded points."""
    sides = three_numbers(args.sizes, "--sizes")
    outputs = Outputs.planned(
        {"--output": (args.output, TABLE_ENDINGS)},
        files_given(args.points, args.map),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    if args.map is not None:
        existing_file(Path(args.map))
    # Rows without coordinates have no image; they are left out.
    table = read_table(
        args.points, args.columns, console, (UNFOLDED,),
        drop_invalid=True, where=where_of(args), element=args.element,
    ).only()  # fmt: skip
    from geounfold.body.block_model import regular_grid

    grids, covering = [], 0
    for points, saved, more in _domains(args, table, console):
        console.stage("making the grid")
        blocks = regular_grid(points, np.array(sides))
        kept = np.ones(len(blocks), dtype=bool)
        if saved is not None:
            console.stage("finding the blocks in the body")
            kept = _in_body(args.map, saved, blocks)
        covering += len(blocks)
        grids.append(_grid_table(blocks, kept).assign(**more))
    grid = pd.concat(grids, ignore_index=True)
    with outputs.writing() as parts:
        write_table(parts["--output"], grid)
    console.done(f"{len(grid)} blocks written into {args.output}")
    console.answer({"blocks": len(grid), "covering": covering, "sizes": list(sides)})


def _domains(
    args: Namespace, table: PointTable, console: Console
) -> Iterator[tuple[Floats, UnfoldingMap | None, dict[str, str]]]:
    """Yield the points of every domain, its map, and the column that names it.

    Without a map of domains and --by, all points are one domain without a name.
    """
    saved = None if args.map is None else load_map(args)
    several = None if saved is None else domains_of(saved)
    if several is not None:
        parted, _ = domain_parts(table, several, args, console, inverse=True)
        for k, (name, one) in enumerate(several.items()):
            rows = parted.rows_of(k)
            if rows.any():
                yield table.points[rows], one, {several.column: name}
    elif args.by is not None:
        codes, names = table.categories(args.by)
        for code, name in enumerate(names):
            yield table.points[codes == code], None, {args.by: name}
    else:
        yield table.points, cast("UnfoldingMap | None", saved), {}


def _in_body(path: str, saved: UnfoldingMap, blocks: BlockModel) -> Bools:
    """Return which unfolded blocks have a part in the control mesh of a saved map, (n,).

    Raises
    ------
    InputError
        No block has one.
    """
    from geounfold.backends.threads import slices

    kept = np.zeros(len(blocks), dtype=bool)
    for rows in slices(len(blocks), 1 << 15):
        parts = blocks.sub_points(2, rows)
        inside = saved.carry(parts.reshape(-1, 3), inverse=True).inside
        kept[rows] = inside.reshape(parts.shape[:2]).any(axis=1)
    if not kept.any():
        raise InputError(f"{path}: no block of the grid lies in this map's body")
    return kept


def _grid_table(blocks: BlockModel, kept: Bools) -> pd.DataFrame:
    """Return the centroids, sides and indices from 0 of the kept blocks."""
    index = np.rint(blocks.centroids / blocks.sizes - 0.5).astype(np.int64)
    index -= index.min(axis=0)
    columns = dict(zip("xyz", blocks.centroids[kept].T, strict=True))
    columns |= dict(zip(("dx", "dy", "dz"), blocks.sizes[kept].T, strict=True))
    columns |= dict(zip("ijk", index[kept].T, strict=True))
    return pd.DataFrame(columns)
