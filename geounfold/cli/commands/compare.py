"""`geounfold compare`."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING, Any

from geounfold.cli.answers.table import table_text
from geounfold.cli.inputs.points import TRUE, files_given, read_all, triple
from geounfold.cli.inputs.unfold_options import MODEL_OPTIONS, config_file, listed, unfold_options
from geounfold.cli.terminal.console import Console
from geounfold.errors import InputError, OptionError
from geounfold.io import Outputs, holds_surface, read_points, read_surface
from geounfold.io.paths import TABLE_ENDINGS
from geounfold.io.tables.files import write_table

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats, TriMesh
    from geounfold.io import PointTable


def run(args: Namespace, console: Console) -> None:
    """Run flatteners on one surface or methods on one body, and write a table of figures."""
    outputs = Outputs.planned(
        {"--output": (args.output, TABLE_ENDINGS)},
        files_given(args.points, args.truth, config_file(args)),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    how: dict[str, Any] = {"progress": console.stage}
    if args.methods is not None:
        how["methods"] = listed(args.methods)
    elif args.truth is not None:
        raise OptionError("--truth needs --methods: it is compared with unfolded blocks")
    if holds_surface(args.points, args.element):
        given: TriMesh | Floats = read_surface(args.points, args.element)
        _refuse_model_options(args)
    else:
        how["unfolding"] = unfold_options(args)
        table = read_all(args.points, args, console)
        given = table.only().points
        if args.truth is not None:
            how["truth"] = _truth(args, table, console)
    from geounfold.comparison import flatteners

    every = "all" if args.methods is None else None
    names = every if args.flatteners is None else listed(args.flatteners)
    frame = flatteners.compare(given, names, **how)
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


def _truth(args: Namespace, table: PointTable, console: Console) -> Floats:
    """Return the blocks' coordinates before folding, (n, 3), those of the rows chosen."""
    count = len(table)
    console.stage(f"reading {args.truth}")
    truth = read_points(args.truth, triple(args.truth_columns), prefer=(TRUE,))
    if len(truth) != count:
        raise InputError(
            f"{args.truth}: has {len(truth)} rows, but {args.points} has {count}; row i of both "
            "must be the same point"
        )
    return truth.only(table.chosen).points


def _refuse_model_options(args: Namespace) -> None:
    """Raise OptionError if an option of a body is given for one surface."""
    given = [f"--{name}" for name in (*MODEL_OPTIONS, "config") if hasattr(args, name)]
    if given:
        raise OptionError(f"{given[0]} needs a table of points; {args.points} is one surface")
