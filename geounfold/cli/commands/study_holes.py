"""`geounfold study-holes`: a company's own comparison on its own holes."""

from __future__ import annotations

import csv
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geounfold.cli.answers.file_endings import HTML, JSON
from geounfold.cli.inputs.carrier import carrier_of
from geounfold.cli.inputs.drillholes import hole_settings
from geounfold.cli.inputs.modelling import body_options
from geounfold.cli.inputs.numbers import number
from geounfold.cli.inputs.points import files_given
from geounfold.cli.inputs.values import values_rules
from geounfold.cli.terminal.console import Console
from geounfold.errors import OptionError
from geounfold.io import TABLE_ENDINGS, Outputs, write_json
from geounfold.io.tables.files import write_table

if TYPE_CHECKING:
    from geounfold.drillholes import DrillHoles
    from geounfold.mapping.mesh_map import UnfoldingMap


def run(args: Namespace, console: Console) -> None:
    """Write the page of the comparison, its table and its figures."""
    chosen = [name for name in ("body", "code", "cut_off") if getattr(args, name) is not None]
    if len(chosen) != 1:
        raise OptionError("study-holes needs --body, --code or --cut-off, one of them")
    given = args.grade or ""
    grades = [word.strip() for word in next(csv.reader([given]), []) if word.strip()]
    if not grades:
        raise OptionError(f"--grade needs columns such as CU,NI, not '{given}'")
    outputs = Outputs.planned(
        {
            "--output": (args.output, HTML),
            "--table": (args.table, TABLE_ENDINGS),
            "--summary": (args.summary, JSON),
        },
        files_given(args.collar, args.survey, args.assays, args.body),
        overwrite=args.overwrite,
        watcher=console.journal,
    )
    length = None if args.composite is None else number(args.composite, "--composite")
    from geounfold.drillholes import read_drillholes
    from geounfold.gain import study_holes
    from geounfold.gain.from_holes import check_enough_holes

    console.stage("reading drill-holes")
    settings = hole_settings(args)
    holes = read_drillholes(args.collar, args.survey, args.assays, where=args.where, **settings)
    for line in holes.messages():
        console.warn(line)
    _check_grades(grades, holes)
    samples = holes.samples(length)
    for grade in grades:  # before the body is unfolded, which takes its time
        known = samples.loc[samples[grade].notna(), "hole"].nunique()
        check_enough_holes(grade, int(known), "with values")
    saved = _carrier(args, holes, console)
    study = study_holes(
        saved, samples, grades, hole="hole", values=values_rules(args), progress=console.stage
    )
    for line in study.lines:
        console.warn(line)
    _written(args, outputs, study, {"composites": length or "as assayed", **_input(args)})
    console.done(f"{', '.join(grades)} compared into {args.output}")
    console.answer(study.facts(), lambda: "\n".join(study.verdicts()))


def _written(args: Namespace, outputs: Outputs, study: Any, about: dict[str, Any]) -> None:
    """Write the outputs."""
    from geounfold.report.gain import write_gain_page

    with outputs.writing() as parts:
        write_gain_page(parts["--output"], study, about)
        if "--table" in parts:
            write_table(parts["--table"], study.errors)
        if "--summary" in parts:
            write_json(parts["--summary"], {**study.facts(), "input": about})


def _input(args: Namespace) -> dict[str, Any]:
    """Return what was read, by name; of files without their folders."""
    words = {name: getattr(args, name) for name in ("code", "cut_off", "where")}
    files = {name: getattr(args, name) for name in ("collar", "survey", "assays", "body")}
    named = {name: Path(file).name for name, file in files.items() if file is not None}
    return {**named, **{name: word for name, word in words.items() if word is not None}}


def _check_grades(grades: list[str], holes: DrillHoles) -> None:
    from geounfold.io.messages import listing
    from geounfold.io.selection import nearest_name

    for name in grades:
        if name not in holes.grades:
            near = nearest_name(name, holes.grades)
            hint = f"; did you mean {near}?" if near else ";"
            raise OptionError(
                f"{holes.sources['assay']}: no grade '{name}'{hint} grades: {listing(holes.grades)}"
            )


def _carrier(args: Namespace, holes: DrillHoles, console: Console) -> UnfoldingMap:
    """Return the body's map: that of --body, or of the body that the holes make."""
    if args.body is not None:
        return carrier_of(args.body, args, console)
    from geounfold.modelling import body_from_holes
    from geounfold.unfolding.run import unfold

    console.stage("drawing the walls")
    body = body_from_holes(holes, options=body_options(args))
    for line in body.told:
        console.note(line)
    return unfold(body.points, progress=console.stage).map  # type: ignore[return-value]
