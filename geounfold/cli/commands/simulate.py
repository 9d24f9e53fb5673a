"""`geounfold simulate`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geounfold.cli.answers.file_endings import POINTS_OUT, SURFACES_OUT
from geounfold.cli.inputs.numbers import whole_number
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.geometry.mesh import TriMesh
from geounfold.io import Outputs
from geounfold.io.surfaces import write_surface
from geounfold.io.tables.files import write_table


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
        frame, surfaces = synthetic.simulate(args.case, blocks=blocks).frame(4), {}
    else:
        body = simulate_faulted(args.case, blocks=blocks)
        frame, surfaces = body.frame(4), body.surfaces
    with outputs.writing() as parts:
        write_table(parts["--output"], frame)
        for name in names:
            if f"--faults-out {name}" in parts:
                write_surface(parts[f"--faults-out {name}"], TriMesh(*surfaces[name]))
    console.done(f"{len(frame)} points written into {args.output}")
    console.answer({"case": args.case, "points": len(frame), "output": args.output})


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
