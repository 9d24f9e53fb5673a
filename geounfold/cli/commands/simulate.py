"""`geounfold simulate`."""

from __future__ import annotations

import math
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geounfold.cli.answers.file_endings import POINTS_OUT, SURFACES_OUT
from geounfold.cli.inputs.numbers import whole_number
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError, nearest
from geounfold.geometry.mesh import TriMesh
from geounfold.io import Outputs
from geounfold.io.surfaces import write_surface
from geounfold.io.tables.files import write_table

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats
    from geounfold.synthetic.body import Body


def run(args: Namespace, console: Console) -> None:
    """Print the names of the simulated bodies, or write one of them with its truth."""
    from geounfold import synthetic
    from geounfold.synthetic.faulted import FAULTED_CASES, simulate_faulted

    if args.list:
        if args.case is not None or args.output is not None or args.faults_out is not None:
            raise OptionError(
                "--list has neither CASE nor -o nor --faults-out: it prints the names of all cases"
            )
        cases = {name: case.description for name, case in synthetic.CASES.items()}
        cases |= {name: f"faulted: {case.about}" for name, case in FAULTED_CASES.items()}
        console.answer({"cases": cases}, lambda: _lined_up(cases))
        return
    if args.case is None or args.output is None:
        raise OptionError("simulate needs CASE and -o OUT, or --list")
    blocks = None if args.blocks is None else whole_number(args.blocks, "--blocks")
    every = [*synthetic.CASES, *FAULTED_CASES]
    if args.case not in every:
        raise OptionError(
            f"no simulated body is named '{args.case}'{nearest(args.case, every)}; valid: "
            f"{', '.join(synthetic.CASES)}; with faults: {', '.join(FAULTED_CASES)}"
        )
    faulted = FAULTED_CASES.get(args.case)
    if args.faults_out is not None and faulted is None:
        raise OptionError(
            f"--faults-out is for faulted bodies, but {args.case} has no faults; faulted: "
            f"{', '.join(FAULTED_CASES)}"
        )
    names = [fault.name for fault in faulted.faults] if faulted is not None else []
    wanted = {"--output": (args.output, POINTS_OUT)}
    wanted |= {f"--faults-out {n}": (_named(args.faults_out, n), SURFACES_OUT) for n in names}
    outputs = Outputs.planned(wanted, overwrite=args.overwrite, watcher=console.journal)
    console.stage("simulating")
    if faulted is None:
        body = _made(args.case, blocks)
        frame, surfaces = body.frame(4), {}
        told = "" if blocks is None else narrow(body.truth, float(np.prod(body.steps)))
    else:
        faulty, told = simulate_faulted(args.case, blocks=blocks), ""
        frame, surfaces = faulty.frame(4), faulty.surfaces
    with outputs.writing() as parts:
        write_table(parts["--output"], frame)
        for name in names:
            if f"--faults-out {name}" in parts:
                write_surface(parts[f"--faults-out {name}"], TriMesh(*surfaces[name]))
    if told:
        console.warn(told)
    console.done(f"{len(frame)} points written into {args.output}")
    console.answer({"case": args.case, "points": len(frame), "output": args.output})


def _made(case: str, blocks: int | None) -> Body:
    """Return a folded body; an error of one that --blocks shrank says so."""
    from geounfold.synthetic import simulate

    try:
        return simulate(case, blocks=blocks)
    except OptionError as error:
        if blocks is None:
            raise
        raise OptionError(
            f"--blocks {blocks} is too few for {case}: its thickness stays, and {error}"
        ) from error


def narrow(truth: Floats, volume: float) -> str:
    """Return the warning on a body that --blocks made too narrow to unfold well; else empty.

    Such a body keeps its thickness and loses length and width. The least breadth is that below
    which the judge of unfoldings calls them poor.

    Parameters
    ----------
    truth : (n, 3) float
        Flat centroids: along, along and across the layer.
    volume : float
        Of a block.
    """
    from geounfold.quality.trust.judge import CRITERIA

    least = next(c.poor for c in CRITERIA if c.name == "breadth")
    long, wide = np.ptp(truth[:, :2], axis=0)
    breadth = min(long, wide) * long * wide / (len(truth) * volume)
    if breadth >= least:
        return ""
    needed = math.ceil(len(truth) * (least / breadth) ** 2 / 1000) * 1000
    return (
        f"with {len(truth):,} blocks the body is only {breadth:.1f} times as wide as thick, so "
        f"that its unfolding may be of poor trust: --blocks {needed} or more is wide enough"
    )


def _named(path: str | None, fault: str) -> str | None:
    """Return the file of a fault: its name before the ending, ``graben_f1.ts`` of graben.ts."""
    if path is None:
        return None
    whole = Path(path)
    return str(whole.with_name(f"{whole.stem}_{fault}{whole.suffix}"))


def _lined_up(texts: dict[str, str]) -> str:
    """Return names and texts as two columns."""
    width = max(map(len, texts))
    return "".join(f"{name:<{width}}  {text}\n" for name, text in texts.items())
