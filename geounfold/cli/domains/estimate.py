"""`geounfold estimate` with a map of several domains: each from its own samples."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.cli.domains.maps import domain_parts
from geounfold.cli.inputs.estimation import estimation, summarised
from geounfold.cli.inputs.unfold_options import command_line
from geounfold.errors import DomainError, GeounfoldError, InputError
from geounfold.io import PointTable, write_json
from geounfold.io.tables.parted import PartedTable, sliced

if TYPE_CHECKING:
    from geounfold.cli.terminal.console import Console
    from geounfold.estimation import Estimation
    from geounfold.io import Outputs
    from geounfold.mapping.domain_map import DomainMap


def estimate_by(
    args: Namespace,
    console: Console,
    maps: DomainMap,
    outputs: Outputs,
    samples: PointTable,
    table: PointTable,
) -> None:
    """Estimate the blocks of every domain from the samples of the same domain.

    Raises
    ------
    DomainError
        A domain failed; the others were written.
    GeounfoldError
        All domains failed; nothing was written.
    """
    blocks, own = domain_parts(table, maps, args, console)
    known, _ = domain_parts(samples, maps, args, console)
    results: dict[str, Estimation] = {}
    failures: dict[str, GeounfoldError] = {}
    summaries: dict[str, Any] = {}
    for k, (name, saved) in enumerate(maps.items()):
        rows, sampled = blocks.rows_of(k), known.rows_of(k)
        if not rows.any():
            continue

        def stage(what: str, name: str = name) -> None:
            console.stage(f"{name}: {what}")

        def note(what: str, name: str = name) -> None:
            console.note(f"{maps.column} {name}: {what}")

        try:
            if not sampled.any():
                raise InputError(f"{samples.source}: no sample of this domain")
            found = estimation(args, saved, samples.only(sampled), table.points[rows], stage)
            summaries[name] = summarised(args, found, stage, note)
            results[name] = found
        except GeounfoldError as error:
            failures[name] = error
    check_domains(maps.column, results, failures, all_failed=True)
    facts = {
        "by": maps.column,
        "domains": _rows(summaries, failures),
        "summaries": summaries,
        "command": command_line(args),
    }
    parted, makes = _parts(args, maps, blocks, results, named=not own)
    with outputs.writing() as parts:
        parted.write_parts(parts["--output"], *makes)
        if "--summary" in parts:
            write_json(parts["--summary"], facts)
    for name in results:
        for warning in summaries[name]["warnings"]:
            console.warn(f"{maps.column} {name}: {warning}")
    count = sum(found.blocks.counts()["estimated"] for found in results.values())
    console.done(f"{args.grade} estimated on {count} of {len(parted)} blocks into {args.output}")
    console.answer(facts)
    check_domains(maps.column, results, failures)


def check_domains(
    column: str,
    results: dict[str, Any],
    failures: dict[str, GeounfoldError],
    *,
    all_failed: bool = False,
) -> None:
    """Raise DomainError for the domains that failed; with `all_failed`, only if all did."""
    if not failures or (all_failed and results):
        return
    first = next(iter(failures))
    if not results:
        raise type(failures[first])(f"{column} {first}: {failures[first]}")
    told = "; ".join(f"{name}: {error}" for name, error in failures.items())
    raise DomainError(
        f"{len(failures)} of {len(failures) + len(results)} domains failed, the others are there: "
        f"{told}"
    )


def _parts(
    args: Namespace,
    maps: DomainMap,
    blocks: PartedTable,
    results: dict[str, Estimation],
    *,
    named: bool,
) -> tuple[PartedTable, list[Any]]:
    """Return the table with a part for each domain that has a result, and what writes each."""
    place = np.full(blocks.count + 1, -2, dtype=np.int64)
    place[-1] = -1
    makes: list[Any] = []
    for k, name in enumerate(maps):
        if name in results:
            place[k] = len(makes)
            count = len(results[name].blocks.flag)
            more = {maps.column: np.full(count, name)} if named else {}
            makes.append(sliced({**more, **results[name].columns}))
    if blocks.count > len(maps):  # points that no map reaches
        place[len(maps)] = len(makes)
        count = int(np.count_nonzero(blocks.part == len(maps)))
        known = {
            f"{args.grade}_samples": np.zeros(count, dtype=np.int64),
            f"{args.grade}_flag": np.full(count, "outside_map"),
            "location": np.full(count, "outside"),
        }
        names = next(iter(results.values())).columns
        empty = np.full(count, np.nan)
        makes.append(
            sliced({maps.column: np.full(count, ""), **{n: known.get(n, empty) for n in names}})
        )
    part = np.where(blocks.part >= 0, place[np.maximum(blocks.part, -1)], blocks.part)
    return PartedTable(blocks.table, part, len(makes)), makes


def _rows(summaries: dict[str, Any], failures: dict[str, GeounfoldError]) -> list[dict[str, Any]]:
    """Return a row per domain for the summary."""
    names = ("mean_of_samples", "mean_of_blocks")
    rows = [
        {
            "domain": name,
            "outcome": "estimated",
            "samples": found["samples"]["used"],
            "blocks": found["blocks"]["given"],
            "estimated": found["blocks"]["estimated"],
            **{n: found[n] for n in names},
            "error": "",
        }
        for name, found in summaries.items()
    ]
    return rows + [
        {"domain": name, "outcome": "failed", "error": str(error)}
        for name, error in failures.items()
    ]
