"""Names of holes that differ between the tables by letter case, zeros or ``.0`` only."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace

import numpy as np

from geounfold.drillholes.findings import NOTE, Log
from geounfold.drillholes.tables import HoleTable


def name_key(name: str) -> str:
    """Return a hole's name without letter case, zeros before a number, and ``.0`` at its end.

    Examples
    --------
    >>> name_key("DDH-001"), name_key("ddh-1"), name_key("1.0"), name_key("0"), name_key("A100")
    ('ddh-1', 'ddh-1', '1', '0', 'a100')
    """
    bare = re.sub(r"(?<=\d)\.0+$", "", name.casefold())
    return re.sub(r"(?<!\d)0+(?=\d)", "", bare)


def matched_names(table: HoleTable, collar: HoleTable, log: Log) -> HoleTable:
    """Return a table whose holes have the names of the collar table; what was matched is told.

    A name that the collar table has stays. Another one takes the collar's name of the same key, if
    one collar has that key.
    """
    own = {str(name) for name in collar.hole}
    keys = Counter(name_key(name) for name in own)
    by_key = {name_key(name): name for name in own if keys[name_key(name)] == 1}
    names, back = np.unique(table.hole.astype(str), return_inverse=True)
    first = {name: row for row, name in reversed(list(enumerate(table.hole.astype(str))))}
    made = names.astype(object)
    for k, name in enumerate(names.tolist()):
        other = by_key.get(name_key(name))
        if name in own or other is None:
            continue
        made[k] = other
        log.add(
            table.source, "hole named otherwise than in the collar table", NOTE,
            "matched: letter case, zeros before numbers and .0 aside",
            hole=name, row=int(table.row[first[name]]), detail=f"'{other}' there",
        )  # fmt: skip
    return replace(table, hole=made[back])
