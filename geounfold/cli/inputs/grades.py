"""The grade that ``--grade`` names, for exploratory data analysis."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from geounfold.cli.inputs.values import read_grade
from geounfold.errors import InputError, OptionError
from geounfold.io.coordinate_columns import numbers

if TYPE_CHECKING:
    from geounfold.cli.inputs.drillholes import HoleData
    from geounfold.cli.terminal.console import Console
    from geounfold.estimation import Exploration
    from geounfold.geometry.mesh import Floats
    from geounfold.io import PointTable
    from geounfold.unfolding.result import Unfolding


def check_grade_options(args: Namespace) -> None:
    """Raise OptionError if ``--grade`` has no samples or no report.

    Raises
    ------
    OptionError
        Without --report, or without --holes and --samples.
    """
    if args.grade is None:
        return
    if args.report is None:
        raise OptionError("--grade needs --report R.html, where its figures and tables go")
    if args.holes is None and args.samples is None:
        raise OptionError("--grade needs the samples that hold it: --holes, or --samples")


def graded_samples(
    args: Namespace, samples: PointTable | None, holes: HoleData | None, console: Console
) -> pd.DataFrame | None:
    """Return coordinates and grade of the samples to explore; None without --grade.

    Raises
    ------
    OptionError
        The column holds a coordinate, or another place along a hole.
    InputError
        No such column, text in it, or too few numbers for a variogram.
    """
    if args.grade is None:
        return None
    points, grades, source = _table(args, samples, holes, console)
    from geounfold.estimation import FEWEST_SAMPLES

    known = int(np.count_nonzero(np.isfinite(grades)))
    if known < FEWEST_SAMPLES:
        raise InputError(
            f"{source}: only {known} of {len(grades)} samples have a value of '{args.grade}', and "
            f"a variogram needs at least {FEWEST_SAMPLES}; go without --grade"
        )
    return pd.DataFrame({**dict(zip("xyz", points.T, strict=True)), args.grade: grades})


def exploration(args: Namespace, result: Unfolding, graded: pd.DataFrame) -> Exploration:
    """Return the exploration of a grade in both spaces.

    Raises
    ------
    InputError
        Too few samples within the map's reach, or values that do not vary.
    """
    from geounfold.estimation import explore

    try:
        return explore(result, graded, grade=args.grade)
    except InputError as error:
        raise InputError(f"--grade {args.grade}: {error}; go without --grade") from error


def _table(
    args: Namespace, samples: PointTable | None, holes: HoleData | None, console: Console
) -> tuple[Floats, Floats, str]:
    """Return coordinates, (n, 3), grades, (n,), and their file."""
    grade = args.grade
    if samples is not None:
        if grade in (*samples.columns, *"xyz"):
            raise OptionError(f"--grade {grade} names a coordinate")
        return samples.points, read_grade(samples, grade, args, console), samples.source
    if holes is None or holes.samples is None:  # checked with the options
        raise OptionError("--grade needs the samples that hold it: --holes, or --samples")
    from geounfold.drillholes.holes import SAMPLE_COLUMNS

    frame, source = holes.samples, holes.holes.sources["assay"]
    if grade in SAMPLE_COLUMNS:
        raise OptionError(f"--grade {grade} names a place, not a grade")
    if grade not in frame:
        there = ", ".join(str(n) for n in holes.holes.grades) or "none"
        raise InputError(f"{source}: no column '{grade}'; columns of numbers: {there}")
    values = numbers(frame[grade], source=source)
    return frame[list("xyz")].to_numpy(dtype=np.float64), values, source
