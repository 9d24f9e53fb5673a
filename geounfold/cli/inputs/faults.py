"""The faults of `geounfold unfold`: surfaces, fault blocks, directions of slip, slip table."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.backends.system.files import same_file
from geounfold.errors import InputError, OptionError

if TYPE_CHECKING:
    from geounfold.io import PointTable
    from geounfold.io.tables.large import PointStream

_NEEDS = ("slip_direction", "outline", "slips")
"""Options that mean something with faults only."""


def check_fault_options(args: Namespace) -> None:
    """Raise OptionError if options on faults lack faults, or do not go with others."""
    if args.limits is not None and args.by is not None:
        raise OptionError(
            "--limits are of one body, --by unfolds several domains: choose one by --where"
        )
    if args.faults is None and args.fault_blocks is None:
        for name in _NEEDS:
            if getattr(args, name) is not None:
                flag = f"--{name.replace('_', '-')}"
                raise OptionError(f"{flag} is of faults: give --faults or --fault-blocks too")
        return
    for path in args.faults or ():
        if args.points is not None and same_file(Path(path), Path(args.points)):
            raise OptionError(f"--faults {path} is POINTS itself: give the surface of a fault")
    if args.by is not None:
        raise OptionError(
            "--by unfolds domains one by one, --faults and --fault-blocks join the blocks of one: "
            "choose a domain by --where in place of --by"
        )
    if args.top is not None or args.bottom is not None:
        raise OptionError("--top and --bottom are of a body without faults: leave them out")


def read_faults(args: Namespace, table: PointTable | PointStream) -> dict[str, Any]:
    """Return what `geounfold.unfold` takes on faults and limits; empty if there are none.

    Parameters
    ----------
    args : Namespace
        The options.
    table : PointTable or PointStream
        The blocks, all rows.

    Raises
    ------
    InputError
        A file that is no surface; blocks without a fault block.
    OptionError
        A direction of slip that cannot be read.
    """
    found: dict[str, Any] = {} if args.limits is None else {"limits": args.limits}
    if args.faults is None and args.fault_blocks is None:
        return found
    found["outline"] = args.outline or "ore"
    if args.faults is not None:
        from geounfold.faults.given import named_surfaces

        found["faults"] = named_surfaces([Path(path) for path in args.faults])
    if args.fault_blocks is not None:
        found["fault_blocks"] = _blocks(args.fault_blocks, table)
    if args.slip_direction is not None:
        found["slip_direction"] = _directions(args.slip_direction, list(found.get("faults", {})))
    return found


def _blocks(column: str, table: PointTable | PointStream) -> np.ndarray:
    """Return the fault block of every chosen row."""
    codes, names = table.categories(column)
    if table.chosen is not None:
        codes = codes[table.chosen]
    missing = np.flatnonzero(codes < 0)
    if len(missing):
        raise InputError(
            f"{table.source}: {len(missing)} points have no value in {column!r}, the first is "
            f"point {missing[0] + 1}; give every point a fault block, or choose others by --where"
        )
    return np.array(names)[codes]


def _directions(words: list[str], names: list[str]) -> dict[str, tuple[float, ...]]:
    """Return directions of slip by fault: of NAME=TREND/PLUNGE, or of TREND/PLUNGE for all."""
    found: dict[str, tuple[float, ...]] = {}
    for word in words:
        name, given, text = word.rpartition("=")
        try:
            numbers = tuple(float(part) for part in text.replace(",", "/").split("/"))
        except ValueError:
            numbers = ()
        if len(numbers) != 2:
            raise OptionError(
                f"--slip-direction must be NAME=TREND/PLUNGE in degrees, but is {word!r}"
            )
        if given and names and name not in names:
            raise OptionError(
                f"--slip-direction: there is no fault {name!r}; given: {', '.join(names)}"
            )
        for fault in [name] if given else names:
            found[fault] = numbers
    return found
