"""The options of body-from-holes, from words."""

from __future__ import annotations

import csv
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.cli.inputs.numbers import number
from geounfold.cli.inputs.solid import block_size
from geounfold.errors import OptionError
from geounfold.io.paths import existing_file
from geounfold.io.strings import holds_strings, read_strings

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats
    from geounfold.modelling import BodyOptions


def body_options(args: Namespace) -> BodyOptions:
    """Return the rules that the options state.

    Raises
    ------
    OptionError
        A value is outside its valid range, or --code and --cut-off are given both or neither.
    """
    from geounfold.modelling import BodyOptions

    if (args.code is None) == (args.cut_off is None):
        raise OptionError(f"{args.command} needs --code A,B or --cut-off GRADE=VALUE, one of them")
    given: dict[str, Any] = {}
    if args.code is not None:
        words = next(csv.reader([args.code], skipinitialspace=True), [])
        given["code"] = [word.strip() for word in words if word.strip()]
        if not given["code"]:
            raise OptionError(f"--code needs codes such as ORE1,ORE2, not '{args.code}'")
    for name in ("max_waste", "least_length", "extent", "least_thickness"):
        if getattr(args, name, None) is not None:
            given[name] = number(getattr(args, name), _flag(name))
    if args.cut_off is not None:
        given["cut_off"] = _cut_off(args.cut_off)
    if getattr(args, "axis", None) is not None:
        given["axis"] = _axis(args.axis)
    if getattr(args, "polygon", None) is not None:
        given["polygon"] = _polygon(args.polygon)
    if getattr(args, "shape", None) is not None:
        given["shape"] = args.shape
    if args.code_column is not None:
        given["code_column"] = args.code_column
    try:
        return BodyOptions(**given, block_size=block_size(args.block_size))
    except OptionError as error:
        words_ = str(error)
        for name in (*given, "block_size"):
            words_ = words_.replace(name, _flag(name)) if "_" in name else words_
        raise OptionError(words_) from error


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _cut_off(text: str) -> tuple[str, float]:
    name, equals, value = (word.strip() for word in text.rpartition("="))
    if not (equals and name and value):
        raise OptionError(f"--cut-off needs GRADE=VALUE such as CU=0.3, not '{text}'")
    return name, number(value, "--cut-off")


def _axis(text: str) -> tuple[float, float]:
    words = text.split(",")
    if len(words) != 2:
        raise OptionError(f"--axis needs trend and plunge such as 35,18, not '{text}'")
    return number(words[0], "--axis"), number(words[1], "--axis")


def _polygon(text: str) -> Floats:
    """Return the corners (k, 2) of an outline: a file of strings, or a table with x and y."""
    path = existing_file(Path(text))
    if holds_strings(path):
        strings = read_strings(path)
        if len(strings.first) != 2:
            raise OptionError(f"{path}: holds {len(strings.first) - 1} strings; --polygon is one")
        return np.asarray(strings.xyz[:, :2])
    from geounfold.io.coordinate_columns import readable_numbers
    from geounfold.io.messages import listing
    from geounfold.io.tables.files import read_table

    frame = read_table(path).frame
    names = {str(name).strip().lower(): k for k, name in reversed(list(enumerate(frame.columns)))}
    if "x" not in names or "y" not in names:
        raise OptionError(
            f"{path}: --polygon needs columns x and y; it has: {listing(frame.columns)}"
        )
    corners = np.column_stack([readable_numbers(frame.iloc[:, names[c]])[0] for c in "xy"])
    if not np.isfinite(corners).all():
        row = int(np.flatnonzero(~np.isfinite(corners).all(axis=1))[0]) + 1
        raise OptionError(f"{path}: --polygon: data row {row} has no number for x or y")
    return corners
