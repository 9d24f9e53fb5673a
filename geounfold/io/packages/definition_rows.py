"""Rows between the names of columns and the data: units, types, descriptions, a model's definition.

Maptek Vulcan, *Model to CSV*: rows 2 to 4 hold each variable's description, type and default value,
with the row's own name in the first field. Micromine, *Export block model*: the types of the fields
stand below their names, and below these the model's origin, block size and the position of the
coordinates in a block, and for a turned model its rotation. Sources: `exports`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from geounfold.io.messages import counted, shown

_NUMBER = re.compile(
    r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|infinity|nan)", re.I
)
_UNIT_WORDS = """
m metre meter metres meters ft feet deg degree degrees ° % g/t gpt ppm ppb oz/t opt kg/t t/m3 g/cc
text string character char alpha numeric number real double float integer int short long name byte
boolean
"""
_UNITS = frozenset(_UNIT_WORDS.split())
_SHOWN = 3  # rows named in a message


@dataclass(frozen=True)
class DefinitionRows:
    """What stands between the names of columns and the data.

    Attributes
    ----------
    count : int
        Number of rows.
    notes : tuple of str
        What was left out or assumed, a sentence each.
    fault : str
        Why the coordinates cannot be used as they stand, and what to do; empty if they can.
    """

    count: int = 0
    notes: tuple[str, ...] = ()
    fault: str = ""


def is_number(field: str) -> bool:
    """Return whether a field holds a number, with a decimal point or a comma."""
    return _NUMBER.fullmatch(field.strip()) is not None


def definition_rows(
    rows: Sequence[Sequence[str]], where: Sequence[int], count: int
) -> DefinitionRows:
    """Return what stands above the data.

    Rows are left out if no coordinate of theirs is a number, some field has a text, and a row with
    a number follows. Without coordinates only a row of units or types is left out.

    Parameters
    ----------
    rows : sequence of lists of str
        The first rows below the names of the columns.
    where : sequence of int
        Positions of the coordinates; empty if the table has none.
    count : int
        Number of columns.
    """
    above = 0
    while above < len(rows) and not _is_data(rows[above], where):
        above += 1
    if above == len(rows) or not any(field.strip() for row in rows[:above] for field in row):
        return DefinitionRows()
    if not where and not all(_is_unit_row(row) for row in rows[:above]):
        return DefinitionRows()
    if not above:
        return DefinitionRows()
    titles = ", ".join(f"'{shown(_title(row))}'" for row in rows[:above][:_SHOWN])
    notes = [f"{counted(above, 'row')} below the names of the columns left out: {titles}"]
    return (
        _with_micromine(rows, above, count, notes) if where else DefinitionRows(above, (notes[0],))
    )


def _is_data(row: Sequence[str], where: Sequence[int]) -> bool:
    if where and len(row) == 1:  # a table of points has three columns or more
        return False
    fields = [row[i] for i in where if i < len(row)] if where else row
    return any(is_number(field) for field in fields)


def _is_unit_row(row: Sequence[str]) -> bool:
    """Return whether a row has units or types only."""
    words = [field.strip().strip("()[]").casefold() for field in row if field.strip()]
    return bool(words) and all(word in _UNITS for word in words)


def _title(row: Sequence[str]) -> str:
    return next((field.strip() for field in row if field.strip()), "")


def _with_micromine(
    rows: Sequence[Sequence[str]], above: int, count: int, notes: list[str]
) -> DefinitionRows:
    """Return the rows with Micromine's rows of the origin and the rotation, if these follow."""
    origin = _filled(rows[above])
    if not (
        len(origin) == 7
        and all(map(is_number, origin[:6]))
        and not is_number(origin[6])
        and (count > 7 or len(rows) > above + 1)
    ):
        return DefinitionRows(above, tuple(notes))
    position = origin[6]
    notes.append(f"the row of the model's origin left out (blocks' position: '{shown(position)}')")
    found = above + 1
    turned = _filled(rows[found]) if found < len(rows) else []
    if len(turned) == 6 < count and all(map(is_number, turned)):
        found += 1
        angles = ", ".join(turned[:3])
        asked = "; if the coordinates are the model's own, give --origin and --rotation"
        about = asked if any(float(angle.replace(",", ".")) for angle in turned[:3]) else ""
        notes.append(f"the row of the model's rotation left out (about z, x, y: {angles}){about}")
    fault = ""
    if not re.search(r"cent", position, re.IGNORECASE):
        fault = (
            f"the coordinates are not those of the blocks' centres but of their "
            f"'{shown(position)}'; export again with the block origin at the centre"
        )
    return DefinitionRows(found, tuple(notes), fault)


def _filled(row: Sequence[str]) -> list[str]:
    """Return the fields up to the last one that is not blank; none if one before it is blank."""
    fields = [field.strip() for field in row]
    while fields and not fields[-1]:
        fields.pop()
    return fields if all(fields) else []
