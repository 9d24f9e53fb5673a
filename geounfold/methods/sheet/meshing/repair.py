"""From offsets to a control mesh that is proved one-to-one: the rungs and the result of each.

Every rung lays the prisms out and examines them like the certificate: exact volumes in both spaces,
and a boundary that does not cross itself.  The first rung without a flaw is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from geounfold.backends.igl import TetIndex
from geounfold.backends.progress import told
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.untangle import untangle
from geounfold.mapping.certificate import Gluing, SpaceFlaws, examine
from geounfold.methods.sheet.meshing.prism_columns import Columns, Laid
from geounfold.methods.sheet.meshing.prism_layers import (
    Layers,
    bounded_slope,
    neighbour_mean,
    shrink,
)
from geounfold.methods.sheet.meshing.shell import less
from geounfold.methods.sheet.meshing.tents import with_tents

_BLEND = 0.6  # largest slope of the offsets where they change from one to the other
_MOVABLE = 0.03  # largest share of the vertices that is untangled
_FEW = 0.002  # largest share of the blocks in the shell that is taken into the body
_TENTS = 0.02  # largest share of the blocks that tents are raised over
_SHRINKS = (6, 40, 400_000)
"""Steps of shrinking: least, most, and the product of steps and tetrahedra between.

Of 140 random and field bodies two needed it, one and two steps; 40 made refusals of large bodies
take 70 s.  A lode of 1,661 blocks that touches another, with 10,464 tetrahedra, needs 17.
"""
_TRIMS = 8  # rounds of trimming before the shell is given up


@dataclass(frozen=True)
class Rung:
    """Result of one rung of the ladder.

    Attributes
    ----------
    name : str
        constant, capped or refined for prisms as laid out; blended, untangled or shrunk for mended
        ones.
    inverted_folded, inverted_unfolded, crossing_folded, crossing_unfolded, unglued : int
        Flaws of the body's tetrahedra: number inverted, pairs of border faces that cross, and
        vertices and tetrahedra at which the mesh is no manifold.
    outside, lost : int or None
        Blocks outside the tetrahedra, and blocks outside the shell too; None if not counted.
    steps : int
        Steps of blending or shrinking; for untangling, vertices of flawed tetrahedra at its start.
    """

    name: str
    inverted_folded: int
    inverted_unfolded: int
    crossing_folded: int
    crossing_unfolded: int
    unglued: int
    outside: int | None = None
    lost: int | None = None
    steps: int = 0

    @property
    def flaws(self) -> int:
        """Number of flaws left."""
        return (
            self.inverted_folded
            + self.inverted_unfolded
            + self.crossing_folded
            + self.crossing_unfolded
            + self.unglued
        )


@dataclass(frozen=True, eq=False)
class Climbed:
    """Result of the ladder: the prisms taken, whether they are proved, and all rungs tried."""

    columns: Columns
    laid: Laid
    proved: bool
    rungs: tuple[Rung, ...]


@dataclass(frozen=True, eq=False)
class _Exam:
    gluing: Gluing
    folded: SpaceFlaws
    unfolded: SpaceFlaws

    @classmethod
    def of(cls, folded: Floats, unfolded: Floats, T: Ints) -> _Exam:
        gluing = Gluing.of(T)
        return cls(gluing, examine(folded, gluing), examine(unfolded, gluing))

    @property
    def passed(self) -> bool:
        return self.gluing.sound and self.folded.none and self.unfolded.none

    @property
    def vertices(self) -> Ints:
        """Vertices of the flawed tetrahedra."""
        found = [self.gluing.misglued]
        found += [f.elements(self.gluing) for f in (self.folded, self.unfolded)]
        bad = self.gluing.T[np.concatenate(found)].ravel()
        return bad if self.gluing.closed else np.concatenate([bad, self.gluing.pinched])

    def rung(self, name: str, steps: int = 0) -> Rung:
        return Rung(
            name,
            len(self.folded.inverted),
            len(self.unfolded.inverted),
            len(self.folded.crossing),
            len(self.unfolded.crossing),
            len(self.gluing.misglued) + (0 if self.gluing.closed else len(self.gluing.pinched)),
            steps=steps,
        )


def climb(
    rungs: Iterable[tuple[str, Callable[[], tuple[Columns, Layers]]]],
    points: Floats,
    count: int | None = None,
) -> Climbed:
    """Return the first rung's prisms that are proved and hold every block.

    The shell may hold some of the blocks.  If no rung holds all of them, the proved prisms that
    lose the fewest blocks are returned; if none is proved, those with the fewest flaws are mended.

    Parameters
    ----------
    rungs : iterable of (name, callable)
        Rungs in the order in which they are tried; each callable returns columns and offsets on
        them.  Of several rungs of one name, each reaches farther than the one before; it is not
        tried if that could not be proved or mended.
    points : (n, 3) float
        The blocks, working units.
    count : int, optional
        Number of blocks of the body, if ``points`` are those at its surface alone.
    """
    count = count or len(points)
    records: list[Rung] = []
    held: list[tuple[int, int, int, Columns, Laid]] = []
    flawed: list[tuple[int, int, Columns, Layers, _Exam]] = []
    hopeless: set[str] = set()
    for number, (name, make) in enumerate(rungs):
        told(1 - 0.5**number)
        if name in hopeless:
            continue
        columns, layers = make()
        laid, exam = _proved(columns, layers)
        records.append(exam.rung(name))
        if laid is None:
            flawed.append((records[-1].flaws, len(flawed), columns, layers, exam))
            sound = [mesh.layers for _, _, _, other, mesh in held if other is columns]
            near = sound[-1] if sound else columns.bare(layers)
            columns, laid, rung = _blended(columns, layers, near, exam)
            if laid is None and not held:
                records.append(rung)
                _, _, columns, layers, exam = flawed[-1]
                laid, rung = _untangled(columns, layers, exam)
            records.append(rung)
        if laid is None:
            hopeless.add(name)
            continue
        laid, outside, lost = _covering(laid, points, count)
        records[-1] = replace(records[-1], outside=outside, lost=lost)
        held.append((lost, outside, len(held), columns, laid))
        if not lost:
            break
    if held:
        columns, laid = min(held, key=lambda found: found[:3])[3:]
        return Climbed(columns, laid, True, tuple(records))
    _, _, columns, layers, exam = min(flawed, key=lambda found: found[:2])
    return _shrunk(columns, layers, exam, records, points, count)


def _blended(
    columns: Columns, layers: Layers, near: Layers, exam: _Exam
) -> tuple[Columns, Laid | None, Rung]:
    """Return prisms with smaller offsets around the flaws.

    Empty columns there are left out.  None if a round leaves as many flaws as the one before: of
    30 calls on field bodies, 11 came to an end in the first round, and the others' flaws stayed
    from the second or third on.
    """
    mean, n = neighbour_mean(layers.F, len(layers.P)), len(layers.P)
    back = np.zeros(n, dtype=bool)
    low = np.minimum([near.up, near.down], [layers.up, layers.down])
    laid, step, fewest = None, 0, math.inf
    while laid is None and (left := exam.rung("blended").flaws) < fewest:
        step, fewest = step + 1, left
        touched = np.unique(exam.vertices % n)
        columns = columns.narrowed(touched)
        back[touched] = True
        back = np.asarray(mean @ back > 0) | back
        wanted = np.where(back, low, [layers.up, layers.down])
        slopes = [bounded_slope(q, columns.prints.U, layers.F, _BLEND) for q in wanted]
        offsets, F = np.maximum(slopes, low), columns.prints.F
        laid, exam = _proved(columns, replace(layers, F=F, up=offsets[0], down=offsets[1]))
    return columns, laid, exam.rung("blended", step)


def _covering(laid: Laid, points: Floats, count: int) -> tuple[Laid, int, int]:
    """Return the prisms extended to hold a few points that lie outside them.

    Tents are raised over points outside the shell, and tetrahedra of the shell that hold points
    become the body's.  If many points are outside, those in the shell stay there.  Also returned:
    the number of points outside the body's tetrahedra, and of those in no tetrahedron.  ``count``:
    number of blocks of the body.
    """
    missed = points[TetIndex(laid.folded, laid.T).locate(points) < 0]
    if not len(missed):
        return laid, 0, 0
    lost = missed[_in_shell(laid, missed) < 0]
    if len(lost) <= _TENTS * count:
        laid, left = with_tents(laid, lost)
        lost = lost[left]
    if len(missed) > _FEW * count:
        return laid, len(missed), len(lost)
    held = _in_shell(laid, missed)
    return laid.taking_in(np.unique(held[held >= 0])), len(lost), len(lost)


def _in_shell(laid: Laid, points: Floats) -> Ints:
    """Return the shell's tetrahedron that holds each point (k, 3), -1 for none."""
    if not len(laid.shell):
        return np.full(len(points), -1)
    return TetIndex(laid.folded, laid.shell).locate(points)


def _untangled(columns: Columns, layers: Layers, exam: _Exam) -> tuple[Laid | None, Rung]:
    """Return the prisms with as few vertices moved as possible; None if flaws are left."""
    laid = columns.lay_out(columns.surround(layers)).without_shell()
    bad = np.unique(exam.vertices)
    if len(bad) > _MOVABLE * laid.inner:
        return None, exam.rung("untangled")
    folded = untangle(laid.folded, laid.T, laid.unfolded, bad)
    if (tet_volumes(folded, laid.T) <= 0).any():
        return None, exam.rung("untangled", len(bad))
    unfolded = untangle(laid.unfolded, laid.T, folded, bad)
    proved, exam = _proved(columns, layers, (folded, unfolded))
    return proved, exam.rung("untangled", len(bad))


def _shrunk(
    columns: Columns,
    layers: Layers,
    exam: _Exam,
    records: list[Rung],
    points: Floats,
    count: int,
) -> Climbed:
    """Return prisms with offsets shrunk until they are proved; unchanged if they never are."""
    first, mean = layers, neighbour_mean(layers.F, len(layers.P))
    least, most, work = _SHRINKS
    shrinks = max(least, min(most, work // len(exam.gluing.T)))
    for step in range(1, shrinks + 1):
        layers = shrink(layers, np.unique(exam.vertices % len(layers.P)), mean)
        laid, exam = _proved(columns, layers)
        if laid is not None:
            laid, outside, lost = _covering(laid, points, count)
            records.append(replace(exam.rung("shrunk", step), outside=outside, lost=lost))
            return Climbed(columns, laid, True, tuple(records))
    records.append(exam.rung("shrunk", shrinks))
    laid = columns.lay_out(columns.surround(first)).without_shell()
    return Climbed(columns, laid, False, tuple(records))


def _proved(
    columns: Columns, layers: Layers, body: tuple[Floats, Floats] | None = None
) -> tuple[Laid | None, _Exam]:
    """Return the prisms with as much of their shell as can be proved; None if they are not proved.

    Also returned: the examination of the body's tetrahedra, or of the whole if that passed.
    """
    around = columns.surround(layers)
    laid = columns.lay_out(around, body)
    whole = _Exam.of(laid.folded, laid.unfolded, laid.all_tets)
    if whole.passed:
        return laid, whole
    inner = laid.without_shell()
    alone = _Exam.of(inner.folded, inner.unfolded, inner.T)
    if not alone.passed:
        return None, alone
    for _ in range(_TRIMS):
        touched = np.zeros(len(around.whole.P), dtype=bool)
        touched[laid.node[whole.vertices]] = True
        around = less(around, touched)
        if around.none:
            break
        laid = columns.lay_out(around, body)
        whole = _Exam.of(laid.folded, laid.unfolded, laid.all_tets)
        if whole.passed:
            return laid, alone
    return inner, alone
