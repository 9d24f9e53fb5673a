"""Saved maps on the command line: of one body, or of the domains of a model."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from geounfold.errors import InputError, OptionError
from geounfold.io.messages import listing, shown
from geounfold.io.paths import existing_file
from geounfold.io.selection import column_position, nearest_name
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    from geounfold.cli.terminal.console import Console
    from geounfold.geometry.mesh import Ints
    from geounfold.io import PointTable
    from geounfold.io.tables.large import PointStream
    from geounfold.mapping.domain_map import DomainMap
    from geounfold.mapping.mesh_map import UnfoldingMap


def load_map(args: Namespace, path: str | None = None) -> UnfoldingMap | DomainMap:
    """Return the map of a command; that of the domain that --domain names.

    Raises
    ------
    InputError
        The file is not a map.
    OptionError
        --domain or --by for a map of one body, or a domain that the file does not hold.
    """
    from geounfold.mapping.domain_file import holds_domains

    path = args.map if path is None else path
    path = str(existing_file(Path(path)))
    domain = getattr(args, "domain", None)
    if not holds_domains(path):
        for option in ("domain", "by"):
            if getattr(args, option, None) is not None:
                raise OptionError(f"--{option} needs a map of domains; {path} is that of one body")
        from geounfold.mapping import mesh_map

        return mesh_map.load(path)
    from geounfold.mapping.domain_map import load_domains

    maps = load_domains(path)
    if domain is None:
        return maps
    if domain not in maps:
        near = nearest_name(domain, maps)
        hint = f"; did you mean {shown(near)}?" if near else ";"
        raise OptionError(f"{path}: no domain '{shown(domain)}'{hint} it has: {listing(maps)}")
    return maps[domain]


def one_map(args: Namespace, path: str | None = None) -> UnfoldingMap:
    """Return the map of a command that needs one body's; --domain chooses it.

    Raises
    ------
    OptionError
        The file holds several domains, and --domain names none.
    """
    found = load_map(args, path)
    several = domains_of(found)
    if several is not None:
        path = args.map if path is None else path
        raise OptionError(
            f"{path}: holds the maps of {len(several)} domains ({listing(several)}); choose one by "
            "--domain NAME"
        )
    return cast("UnfoldingMap", found)


def domains_of(saved: UnfoldingMap | DomainMap) -> DomainMap | None:
    """Return a map of several domains; None for that of one body."""
    return cast("DomainMap", saved) if hasattr(saved, "maps") else None


def domain_parts(
    table: PointTable | PointStream,
    maps: DomainMap,
    args: Namespace,
    console: Console,
    *,
    inverse: bool = False,
) -> tuple[PartedTable, bool]:
    """Return a table divided by the domains of a map, and whether its own column did so.

    A table of folded points without the column is divided by place: each point belongs to the
    domain in whose body it lies, or to the nearest.

    Raises
    ------
    InputError
        A table of unfolded points has no such column.
    """
    column = args.by or maps.column
    chosen = table.chosen
    selected = np.ones(len(table), dtype=bool) if chosen is None else chosen
    if args.by is None and not _has(table.names, column):
        if inverse:
            column_position(table.names, column, table.source)
        console.warn(
            f"{table.source}: no column '{shown(column)}': each point was given to the domain in "
            "or nearest to whose body it lies; --by COLUMN names the column, --domain NAME one "
            "domain for all"
        )
        there = np.flatnonzero(selected)
        part = np.full(len(table), -1, dtype=np.int64)
        part[there] = maps.nearest(table.points[there])
        part[there] = np.where(part[there] < 0, len(maps), part[there])
        return PartedTable(table, part, len(maps) + 1), False
    codes, names = table.categories(column)
    part = _places(codes, names, maps)
    if not (selected & (part >= 0)).any():
        raise InputError(
            f"{table.source}: column '{shown(column)}' names no domain of the map; the map has "
            f"{listing(maps)}, the column {listing(names)}"
        )
    lost = sorted({names[c] for c in codes[selected & (part < 0) & (codes >= 0)].tolist()})
    if lost:
        console.warn(
            f"{table.source}: {np.count_nonzero(selected & (part < 0))} rows are of domains that "
            f"the map does not hold ({listing(lost)}); they were left empty, marked elsewhere"
        )
    return PartedTable(table, np.where(selected, part, -1), len(maps)), True


def _places(codes: Ints, names: list[str], maps: DomainMap) -> Ints:
    from geounfold.io.selection.labels import label

    own = {label(name): k for k, name in enumerate(maps)}
    place = np.array([own.get(name, -2) for name in names] + [-2], dtype=np.int64)
    return place[codes]


def _has(names: list[str], column: str) -> bool:
    return any(name.strip().casefold() == column.strip().casefold() for name in names)
