"""`geounfold quality`."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

import numpy as np

from geounfold.cli.answers.file_endings import JSON
from geounfold.cli.inputs.numbers import whole_number
from geounfold.cli.inputs.points import TRUE, files_given, triple, where_of
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError
from geounfold.io import Outputs, read_points, write_json
from geounfold.io.paths import SWAPPED
from geounfold.io.result_columns import UNFOLDED


def run(args: Namespace, console: Console) -> None:
    """Print how well an unfolding keeps distances, and its distance from a truth."""
    outputs = Outputs.planned(
        {"--output": (args.output, JSON)},
        files_given(args.folded, args.unfolded, args.truth),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    folded = read_points(
        args.folded, triple(args.columns), where=where_of(args), element=args.element
    )
    rows = folded.chosen
    unfolded = read_points(
        args.unfolded, triple(args.unfolded_columns),
        prefer=(UNFOLDED,), among=rows, element=args.unfolded_element,
    )  # fmt: skip
    truth = None
    if args.truth is not None:
        truth = read_points(args.truth, triple(args.truth_columns), prefer=(TRUE,), among=rows)
    folded = folded.only()
    for other in (unfolded, truth):
        if other is not None and len(other) != len(folded):
            raise InputError(
                f"{other.source}: has {len(other)} rows, but {folded.source} has {len(folded)}; "
                "row i of both must be the same point"
            )
    from geounfold.cli.answers.figures import quality_figures

    console.stage("measuring")
    figures = quality_figures(
        folded.points,
        unfolded.points,
        None if truth is None else truth.points,
        None if args.neighbours is None else whole_number(args.neighbours, "--neighbours"),
    )
    with outputs.writing() as parts:
        if "--output" in parts:
            write_json(parts["--output"], figures)
    if np.array_equal(folded.points, unfolded.points):
        console.warn(
            f"{unfolded.source} has the same coordinates as {folded.source}: nothing was unfolded; "
            f"{SWAPPED}"
        )
    console.done("measured")
    console.answer(figures, lambda: "".join(_figure_lines(figures)))


def _figure_lines(figures: dict[str, Any]) -> list[str]:
    """Return single figures as aligned lines, and statistics as a table below them."""
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
    """Return a figure with six digits, a list of them, or a dash for None."""
    if isinstance(value, tuple | list):
        return "  ".join(map(_figure, value))
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
