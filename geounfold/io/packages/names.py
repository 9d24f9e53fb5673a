"""Names of columns: coordinates and sides of blocks, as packages write them.

Names are spelled as `plain_name` returns them. Names of the second tier are tried only if no set of
the first is complete, so that a table with x, y, z and further sets stays clear.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product

Triple = tuple[str, str, str]


def _axes(patterns: Sequence[str]) -> tuple[Triple, ...]:
    return tuple((p.format("x"), p.format("y"), p.format("z")) for p in patterns)


WORLD: tuple[Triple, ...] = (("xworld", "yworld", "zworld"), ("worldx", "worldy", "worldz"))
"""World coordinates beside a model's own: Datamine's COPYMOD, and geounfold with --origin."""

_FIRST = (
    *("centroid{}", "{}centroid", "{}", "{}c", "{}centre", "{}center", "centre{}", "center{}"),
    *("mid{}", "{}mid", "{}coord", "coord{}", "{}world", "world{}"),
)

_SECOND = (
    *("{}pt", "{}p", "{}point", "{}cent", "cent{}", "{}cen", "{}ctr", "{}cg", "{}location"),
    *("{}loc", "loc{}", "{}position", "{}pos", "pos{}", "{}coordinate", "{}coordinates"),
    *("{}gravitycenter", "{}gravitycentre", "{}utm", "utm{}", "c{}", "{}m", "{}block", "block{}"),
)

_LEVEL = ("elevation", "elev", "rl", "z", "altitude", "level", "height", "el", "cota", "elevacion")
_LEVEL_BESIDE = {("rechtswert", "hochwert"): ("höhe", "hoehe", "z")}
_PLAN = (
    *(("easting", "northing"), ("east", "north"), ("x", "y"), ("e", "n")),
    *(("eastings", "northings"), ("utme", "utmn"), ("utmx", "utmy"), ("este", "norte")),
    *(("xutm", "yutm"), ("xc", "yc"), ("rechtswert", "hochwert")),
)

_NAMED: tuple[Triple, ...] = (
    ("easting", "northing", "elevation"),
    ("east", "north", "elevation"),
)

_FIRST_SETS = (*_axes(_FIRST), *_NAMED)
_PLANS = tuple(
    (a, b, c)
    for a, b in _PLAN
    for c in _LEVEL_BESIDE.get((a, b), _LEVEL)
    if (a, b, c) not in _FIRST_SETS
)

COORDINATES: tuple[tuple[Triple, ...], ...] = (_FIRST_SETS, _PLANS, _axes(_SECOND))
"""Sets of names of coordinates, tier by tier."""

DOWN = ("depth", "tvd", "tvdss", "zdown", "depthz")
"""Names of coordinates that count downwards."""

DEPTHS: tuple[Triple, ...] = tuple((a, b, c) for (a, b), c in product(_PLAN, DOWN))
"""Sets whose third coordinate counts downwards."""

DEGREES: tuple[tuple[str, str], ...] = (
    *(("longitude", "latitude"), ("long", "lat"), ("lon", "lat"), ("lng", "lat")),
)
"""Names of coordinates in degrees."""

_SIDES_FIRST = (
    *("{}inc", "{}increment", "d{}", "{}size", "size{}", "{}blocksize", "blocksize{}", "{}length"),
    *("length{}", "{}len", "dim{}", "{}dim", "{}dimension", "{}width", "block{}", "{}block"),
)

SIDES: tuple[tuple[Triple, ...], ...] = (
    (*_axes(_SIDES_FIRST), ("_east", "_north", "_rl"), ("_east", "_north", "_z")),
    (
        *_axes(("_{}", "{}l", "l{}", "{}siz", "siz{}", "{}sz", "len{}", "delta{}", "{}span")),
        *(("eastsize", "northsize", "rlsize"), ("_easting", "_northing", "_elevation")),
        *(("_easting", "_northing", "_rl"), ("_east", "_north", "_elevation")),
    ),
)
"""Sets of names of the sides of blocks, tier by tier."""


def plain_name(name: object) -> str:
    """Return a column name without case, unit in brackets, spaces and underscores.

    An underscore at the beginning stays, because it sets Micromine's sides (``_EAST``) apart from
    its coordinates (``EAST``).

    Examples
    --------
    >>> plain_name("X_Centre (m)"), plain_name("_EAST")
    ('xcentre', '_east')
    """
    bare = re.sub(r"[(\[][^)\]]*[)\]]\s*$", "", str(name)).strip()
    plain = re.sub(r"[\s_\-.]+", "", bare).casefold()
    return f"_{plain}" if bare.startswith("_") and plain else plain


def coordinate_sets(names: Sequence[object]) -> list[Triple]:
    """Return the sets of coordinates that are whole among column names, of the first tier with any.

    Examples
    --------
    >>> coordinate_sets(["EAST", "NORTH", "RL", "_EAST", "_NORTH", "_RL"])
    [('east', 'north', 'rl')]
    """
    plain = {plain_name(name) for name in names}
    for tier in COORDINATES:
        found = [family for family in tier if plain.issuperset(family)]
        if found:
            return found
    return []


def side_sets(names: Sequence[object]) -> list[Triple]:
    """Return the sets of sides that are whole among column names, of the first tier with any.

    Examples
    --------
    >>> side_sets(["x", "y", "z", "XINC", "YINC", "ZINC"])
    [('xinc', 'yinc', 'zinc')]
    """
    plain = {plain_name(name) for name in names}
    for tier in SIDES:
        found = [family for family in tier if plain.issuperset(family)]
        if found:
            return found
    return []
