"""The options for the values of grades: --missing, --below-detection and --cap."""

from __future__ import annotations

import csv
from argparse import Namespace
from typing import TYPE_CHECKING

from geounfold.errors import InputError, OptionError
from geounfold.io.messages import listing
from geounfold.io.selection.mixed import quoted

if TYPE_CHECKING:
    from geounfold.cli.terminal.console import Console
    from geounfold.geometry.mesh import Floats
    from geounfold.io import PointTable
    from geounfold.io.grade_values import GradeRules


def values_rules(args: Namespace) -> GradeRules:
    """Return the rules for values of grades that the options state.

    Raises
    ------
    OptionError
        --missing, --below-detection or --cap has an invalid value.
    """
    from geounfold.io.grade_values import BELOW_DETECTION, GradeRules

    below = args.below_detection or "missing"
    if below not in BELOW_DETECTION:
        raise OptionError(
            f"--below-detection must be one of {', '.join(BELOW_DETECTION)}, not '{below}'"
        )
    missing = next(csv.reader([args.missing or ""], skipinitialspace=True), [])
    caps: dict[str, float | str] = {}
    for text in args.cap or ():
        name, equals, value = (word.strip() for word in text.rpartition("="))
        if not (equals and name and value):
            raise OptionError(f"--cap needs COLUMN=VALUE such as AU=20 or AU=p99, not '{text}'")
        if name in caps:
            raise OptionError(f"--cap names {name} twice")
        caps[name] = value
    try:
        return GradeRules(missing=tuple(missing), below_detection=below, cap=caps)
    except OptionError as error:
        raise OptionError(f"--cap: {error}") from error


def no_grade(error: InputError, table: PointTable, args: Namespace, name: str) -> InputError:
    """Return the error of a column of words, with the columns that may be grades."""
    if "it is no grade" not in str(error):
        return error
    from geounfold.io.grade_values import grades_of

    rest = table.frame.drop(columns=[*table.columns, name], errors="ignore")
    found = grades_of(rest)
    told = f"; columns of numbers: {listing(found)}" if found else ", and no other column has any"
    chooses = f'; --samples-where "{quoted(name)}=..." chooses samples by it'
    return InputError(f"{error}{told}{chooses if hasattr(args, 'samples_where') else ''}")


def read_grade(
    table: PointTable,
    name: str,
    args: Namespace,
    console: Console,
    rules: GradeRules | None = None,
) -> Floats:
    """Return a table's grade, (n,), by the rules of the options; what is unusual is told.

    Raises
    ------
    InputError
        No such column, or fewer than half of its values are numbers.
    """
    from geounfold.io.grade_values import grade_of

    try:
        values, lines, _ = grade_of(table.column(name), table.source, rules or values_rules(args))
    except InputError as error:
        raise no_grade(error, table, args, name) from error
    for line in lines:
        console.warn(line)
    return values
