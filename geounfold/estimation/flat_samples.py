"""The samples of an estimate: those with a grade that lie in the body, in the unfolded space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import pandas as pd

from geounfold.drillholes.tables import ALIASES
from geounfold.errors import InputError
from geounfold.estimation.kriging import hole_numbers
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.grade_values import GradeRules, grade_of
from geounfold.io.messages import listing
from geounfold.io.packages.names import plain_name
from geounfold.io.result_columns import frame_points
from geounfold.mapping.carried import Carried, checked_points

_BESIDE = 0.5 - 1e-9  # blocks; a sample in the middle of the next cell lies at 0.5


class Carries(Protocol):
    """An object that carries points to the unfolded space, such as an UnfoldingMap."""

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Return the images of the points."""
        ...


@dataclass(frozen=True, eq=False)
class FlatSamples:
    """Samples that have a grade and an image in the unfolded space.

    Attributes
    ----------
    points : (n, 3) float
        Unfolded coordinates, in the map's unit.
    folded : (n, 3) float
        Folded coordinates, as given.
    grades : (n,) float
        Values of the grade, in its column's unit.
    holes : (n,) int or None
        Number of each sample's hole; None if the holes are not known.
    stratigraphic : (n,) float
        Stratigraphic height: 0 at the bottom, 1 at the top.
    rows : (n,) int
        Row of each sample in the table given, from 0.
    given : int
        Number of samples given.
    without_grade : int
        Number left out because the grade or a coordinate is missing.
    outside : int
        Number left out because they lie outside the map.
    wall_rock : int
        Number left out because they lie outside the body.
    beside : int
        Number of those within half a block of it: of blocks that are whole or absent, some of the
        body's own samples lie there.
    let_in : int
        Number used although they lie outside the body, within the soft boundary.
    lines : tuple of str
        What is unusual about the values of the grade.
    values : dict
        How many values are declared missing, below detection, no numbers, negative; the cap.
    """

    points: Floats
    folded: Floats
    grades: Floats
    holes: Ints | None
    stratigraphic: Floats
    rows: Ints
    given: int
    without_grade: int
    outside: int
    wall_rock: int = 0
    beside: int = 0
    let_in: int = 0
    lines: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)

    def facts(self) -> dict[str, Any]:
        """Return the counts of samples given, used and left out, for a summary."""
        return {
            "given": self.given,
            "used": len(self.grades),
            "without_grade": self.without_grade,
            "outside_map": self.outside,
            "outside_body": self.wall_rock,
            "outside_body_within_half_a_block": self.beside,
            "soft_boundary": self.let_in,
            "values": dict(self.values),
        }

    def warnings(self, grade: str) -> list[str]:
        """Return one line for each group of samples left out."""
        lines = list(self.lines)
        if self.without_grade:
            lines.append(f"{self.without_grade} of {self.given} samples have no {grade}: left out")
        if self.outside:
            lines.append(f"{self.outside} of {self.given} samples lie outside the map: left out")
        if self.wall_rock:
            lines.append(
                f"{self.wall_rock} of {self.given} samples lie outside the body (wall rock): left "
                f"out{self._let_in_by()}"
            )
        if self.let_in:
            lines.append(
                f"{self.let_in} of {self.given} samples lie outside the body, within the soft "
                "boundary: used"
            )
        return lines

    def _let_in_by(self) -> str:
        """Return how to let in samples outside the body."""
        if not self.beside:
            return "; --soft-boundary B lets in those within B blocks"
        share = self.beside / self.wall_rock
        return (
            f"; {self.beside} of them ({share:.0%}) lie within half a block of it, where the edges "
            "of whole blocks cut off samples of the body too: --soft-boundary 0.5 lets these in"
        )


def flat_samples(
    carrier: Carries,
    samples: pd.DataFrame,
    *,
    grade: str,
    hole: str | None = None,
    rules: GradeRules | None = None,
    soft_boundary: float | None = None,
    source: str = "the samples",
) -> FlatSamples:
    """Return the samples that have a grade and an image, in the unfolded space.

    Parameters
    ----------
    carrier : UnfoldingMap or PointwiseMap
        Carries the samples.
    samples : DataFrame
        Coordinates, the grade and, if known, the hole.
    grade, hole : str
        Columns.
    rules : GradeRules, optional
        How the values of the grade are read.
    soft_boundary : float, optional
        Largest distance from the body, in blocks, of the samples that are used; 0 for those in the
        body alone. Without, all samples with an image are used.
    source : str, optional
        Name of the samples, for messages.

    Raises
    ------
    InputError
        The column is missing, fewer than half of its values are numbers, or no sample is left.
    """
    P = frame_points(samples)
    rules = rules or GradeRules()
    rules.check_columns([grade], source)
    values, lines, facts = grade_of(_column(samples, grade), source, rules)
    graded: Bools = np.isfinite(values)
    holes = _holes(samples, hole)
    there = graded & np.isfinite(P).all(axis=1)
    rows = np.flatnonzero(there)
    if not len(rows):
        raise InputError(f"no sample has a value of '{grade}' and coordinates")
    carried = carrier.carry(checked_points(P[rows]))
    inside = np.isfinite(carried.points).all(axis=1)
    used, soft, beside = inside, np.zeros(len(rows), dtype=bool), 0
    if soft_boundary is not None:
        own, off = in_body(carrier, P[rows], carried), body_distance(carrier, P[rows], carried)
        near = own | (off <= soft_boundary)
        used, soft = inside & near, inside & near & ~own
        beside = int(np.count_nonzero(inside & ~near & (off < _BESIDE)))
    if not used.any():
        raise _none_used(carrier, P[rows], carried)
    kept = rows[used]
    return FlatSamples(
        points=carried.points[used],
        folded=P[kept],
        grades=values[kept],
        holes=None if holes is None else holes[kept],
        stratigraphic=carried.stratigraphic[used],
        rows=kept,
        given=len(samples),
        without_grade=int(len(samples) - len(rows)),
        outside=int(np.count_nonzero(~inside)),
        wall_rock=int(np.count_nonzero(inside & ~used)),
        beside=beside,
        let_in=int(np.count_nonzero(soft)),
        lines=tuple(lines),
        values=facts,
    )


def in_body(carrier: Any, points: Floats, carried: Carried) -> Bools:
    """Return which points (n, 3) lie in the body, of a map with or without its blocks."""
    if hasattr(carrier, "in_body"):
        found: Bools = carrier.in_body(points, carried)
        return found
    return carried.inside


def body_distance(carrier: Any, points: Floats, carried: Carried) -> Floats:
    """Return how far points (n, 3) lie from the body, in blocks, (n,)."""
    if hasattr(carrier, "body_distance"):
        found: Floats = carrier.body_distance(points, carried)
        return found
    return np.asarray(carried.distance / carrier.frame.scale)


def _none_used(carrier: Any, points: Floats, carried: Carried) -> InputError:
    """Return the error for samples of which none can be used."""
    blocks = body_distance(carrier, points, carried)
    cells, length = getattr(carrier, "body", None), carried.distance
    if cells is not None:
        length = cells.gap(carrier.frame.to_work(points)) * carrier.frame.scale
    nearest = int(np.argmin(length))
    place = ", ".join(f"{c:.10g}" for c in points[nearest])
    return InputError(
        f"none of the {len(points)} samples lies in the body: the nearest, at ({place}), is "
        f"{length[nearest]:.6g} ({blocks[nearest]:.3g} blocks) away from it; check that samples "
        "and blocks have the same coordinates and unit, or let samples in by --soft-boundary B, "
        "up to the map's reach"
    )


def _column(frame: pd.DataFrame, name: str) -> pd.Series:
    where = [k for k, column in enumerate(frame.columns) if str(column) == name]
    if len(where) != 1:
        what = "no" if not where else "more than one"
        raise InputError(
            f"the samples have {what} column '{name}'; columns: {listing(frame.columns)}"
        )
    return frame.iloc[:, where[0]]


def _holes(frame: pd.DataFrame, name: str | None) -> Ints | None:
    """Return the number of each sample's hole; None if no single column names the hole."""
    if name is None:
        aliases = ALIASES["assay"]["hole"]
        found = [str(column) for column in frame.columns if plain_name(column) in aliases]
        if len(found) != 1:
            return None
        name = found[0]
    return hole_numbers(_column(frame, name).to_numpy(dtype=object))
