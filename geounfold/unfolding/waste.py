"""Domains that are probably the rest of a model, which is no body to unfold."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from geounfold.body.lattice import measure_lattice
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.messages import counted, shown
from geounfold.io.packages.names import plain_name
from geounfold.io.selection.mixed import left_out

_WORDS = re.compile(
    "0+|-1|-9+|wst|was|waste(rock)?|(host|country|wall)?rock|host|country|wall|air|void|sky|water|"
    "topo|overburden|cover|soil|out|outside|outer|exterior|bg|backgr(ound)?|others?|rest|default|"
    "barren|unmineralised|unmineralized|undef(ined)?|unassigned|unk(nown)?|ud|no(ne|nore|ore)?|"
    "false|esteril|sterile|gangue|gangart|caja|encajante|encaixante|abraum|nebengestein|taub"
)
"""Names that mean waste, in the words of mining packages and of five languages."""

_CORNER = 0.05
"""Share of the model's sides within which a block is at a corner: that of a parent block in a
model of 10 a side, whose corner has sub-blocks."""


def waste_domains(codes: Ints, names: Sequence[str], points: Floats) -> dict[str, str]:
    """Return the domains that are probably waste, with the reason.

    One is called so. One has blocks in all eight corners of the box of the model, in which there
    are other domains too: it is what the model was filled up with.

    Parameters
    ----------
    codes : (n,) int
        Domain of each row; -1 for none.
    names : sequence of str
        Names of the domains.
    points : (n, 3) float
        Centroids.

    Examples
    --------
    >>> waste_domains(np.array([0, 1]), ["AIR", "LODE"], np.zeros((2, 3)))
    {'AIR': 'its name means waste'}
    """
    there = np.unique(codes[codes >= 0])
    if len(there) < 2:
        return {}
    found = {}
    filling = set(_in_all_corners(codes, points))
    for code in there.tolist():
        name = names[code]
        if _WORDS.fullmatch(name.strip()) or _WORDS.fullmatch(plain_name(name)):
            found[name] = "its name means waste"
        elif code in filling:
            found[name] = "it fills all corners of the model around the others"
    return found


def _in_all_corners(codes: Ints, points: Floats) -> Iterator[int]:
    """Yield the domains with a block near every corner of the box of all rows that have one."""
    rows = (codes >= 0) & np.isfinite(points).all(axis=1)
    points, codes = points[rows], codes[rows]
    if not len(points):
        return
    lattice = measure_lattice(points)
    X = points - points.mean(axis=0)
    if lattice is not None:
        X = X @ lattice.axes.T
    low, high = X.min(axis=0), X.max(axis=0)
    margin = _CORNER * (high - low)
    down, up = X <= low + margin, X >= high - margin
    near = (down | up).all(axis=1)
    corner = (up[near] * np.array([1, 2, 4])).sum(axis=1)
    at = np.unique(np.stack([codes[near], corner], axis=1), axis=0)
    which, count = np.unique(at[:, 0], return_counts=True)
    yield from which[count == 8].tolist()


def waste_told(column: str, found: dict[str, str], blocks: dict[str, int]) -> str:
    """Return the warning on such domains, given why and their numbers of blocks."""
    if not found:
        return ""
    named = " and ".join(
        f"{shown(name)} ({counted(blocks[name], 'block')}; {why})" for name, why in found.items()
    )
    one = len(found) == 1
    verb, it = ("is unfolded as a body", "it") if one else ("are unfolded as bodies", "them")
    rest = f'"{left_out(column, list(found))}"'
    return f"{column} {named} {verb} too: leave {it} out by --where {rest}"
