"""A company's own comparison: every arm at the samples of left-out holes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError
from geounfold.estimation import flat_samples, hole_numbers, score
from geounfold.gain.arms import ARMS, Places, places_of
from geounfold.gain.assessment import Assessment, assessed, points_in_body, spacing_of
from geounfold.gain.trial import Trial, Tried
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.grade_values import GradeRules, grade_rules
from geounfold.io.messages import counted

DRAWS = 2000
"""Draws of holes with replacement, from which the intervals come."""

_FEWEST_HOLES = 10


@dataclass(frozen=True, eq=False)
class HolesStudy:
    """Errors of every arm for one or several grades.

    Attributes
    ----------
    errors : DataFrame
        A row for each grade and arm: holes and samples, rmse, bias, slope and correlation of the
        estimates at samples of left-out holes, gain (1 - RMSE unfolded / RMSE of the arm) with low
        and high, between which 95 % of the gains over holes drawn with replacement lie, and the
        fitted nugget and ranges.
    assessments : dict of Assessment
        What was to be expected, by grade.
    lines : tuple of str
        What was left out, one sentence each.
    """

    errors: pd.DataFrame
    assessments: Mapping[str, Assessment]
    lines: tuple[str, ...]

    def verdicts(self) -> list[str]:
        """Return a sentence for each grade: which arm the left-out holes favour, and how surely."""
        out = []
        for grade, part in self.errors.groupby("grade", sort=False):
            others = part[part["arm"] != "unfolded"]
            best = others.iloc[int(np.argmin(others["rmse"].to_numpy()))].to_dict()
            gain, low, high = (float(best[name]) for name in ("gain", "low", "high"))
            sure = "" if low > 0 or high < 0 else "; the holes do not tell them apart"
            word = "less" if gain >= 0 else "more"
            out.append(
                f"{grade}: unfolded has {np.abs(gain):.1%} {word} error than the best other arm, "
                f"{best['arm']} (gain {low:.1%} to {high:.1%}){sure}"
            )
        return out

    def facts(self) -> dict[str, Any]:
        """Return the figures for a summary."""
        return {
            "verdicts": self.verdicts(),
            "errors": self.errors.to_dict(orient="records"),
            "expected": {grade: found.facts() for grade, found in self.assessments.items()},
            "left_out": list(self.lines),
        }


def study_holes(
    unfolding: Any,
    samples: pd.DataFrame,
    grades: Sequence[str],
    *,
    hole: str | None = None,
    values: GradeRules | Mapping[str, Any] | None = None,
    progress: Any = None,
) -> HolesStudy:
    """Compare kriging in folded, stratigraphic and unfolded coordinates on holes that are left out.

    Every arm has the same samples, the same automatic fit of a variogram, and the 24 nearest
    samples in units of the ranges, no more than 6 of a hole. Each sample is estimated without its
    own hole.

    Parameters
    ----------
    unfolding : Unfolding or UnfoldingMap
        The body's map.
    samples : DataFrame
        Folded composites with coordinates, grades and hole.
    grades : sequence of str
        Columns of the grades.
    hole : str, optional
        Column of the holes; found by name.
    values : GradeRules or mapping, optional
        How values are read.
    progress : callable, optional
        Called with the name of every stage.

    Raises
    ------
    InputError
        A column is missing, holes are unknown or fewer than ten, or no sample lies in the body.
    """
    if not grades:
        raise OptionError("study_holes needs a grade")
    carrier = getattr(unfolding, "map", unfolding)
    rows: list[dict[str, Any]] = []
    told: dict[str, Assessment] = {}
    lines: list[str] = []
    for grade in grades:
        if progress is not None:
            progress(f"cross-validating {grade}")
        flat = flat_samples(
            carrier, samples, grade=grade, hole=hole, rules=grade_rules(values), soft_boundary=0.0,
            source=str(samples.attrs.get("source", "the samples")),
        )  # fmt: skip
        lines += [f"{grade}: {line}" for line in flat.warnings(grade)]
        if flat.holes is None:
            raise InputError("the holes are not known: give the name of the samples' hole column")
        own, there = places_of(carrier, flat.folded)
        numbers, v = hole_numbers(flat.holes[there]), flat.grades[there]
        check_enough_holes(grade, int(numbers.max()) + 1, "with samples in the body")
        found = _tried(own, numbers, v)
        rows += _rows(grade, found, v, numbers)
        targets = places_of(carrier, points_in_body(carrier, flat.folded))[0]
        told[grade] = assessed(own, numbers, v, targets, found["unfolded"].model, flat)
    return HolesStudy(pd.DataFrame(rows), told, tuple(dict.fromkeys(lines)))


def check_enough_holes(grade: str, count: int, which: str) -> None:
    """Raise InputError if so many holes are too few for a comparison that leaves out each in turn.

    ``which`` names the holes that were counted.
    """
    if count < _FEWEST_HOLES:
        raise InputError(
            f"{grade}: {counted(count, 'hole')} {which}, but a comparison that leaves out whole "
            f"holes needs {_FEWEST_HOLES}; assess foretells the gain from three holes on"
        )


def _tried(own: Places, holes: Ints, values: Floats) -> Mapping[str, Tried]:
    """Return the estimates of every arm at all samples, from the other holes."""
    everything = np.arange(len(values))
    trial = Trial(values, holes, everything, everything)
    nothing = own.kept(np.zeros(len(own), dtype=bool))
    return trial.arms(own, nothing, spacing_of(own.flat, holes))


def _rows(
    grade: str, found: Mapping[str, Tried], values: Floats, holes: Ints
) -> list[dict[str, Any]]:
    """Return the row of each arm, with the interval of its gain over holes drawn again."""
    back = np.column_stack([found[arm].back for arm in ARMS])
    there = np.isfinite(back).all(axis=1)  # the same samples for every arm
    count = int(holes.max()) + 1
    square = (back[there] - values[there, None]) ** 2
    sums = np.column_stack(
        [np.bincount(holes[there], column, minlength=count) for column in square.T]
    )
    draw = np.random.default_rng(0).multinomial(count, np.full(count, 1 / count), DRAWS)
    drawn = np.sqrt(draw.astype(np.float64) @ sums)
    rmse = np.sqrt(sums.sum(axis=0))
    last = ARMS.index("unfolded")
    rows = []
    for k, arm in enumerate(ARMS):
        got, model = score(values[there], back[there, k]), found[arm].model
        low, high = np.quantile(1 - drawn[:, last] / drawn[:, k], [0.025, 0.975]).tolist()
        rows.append(
            {
                "grade": grade, "arm": arm, "holes": int((np.bincount(holes[there]) > 0).sum()),
                "samples": got.count, "rmse": got.rmse, "bias": got.bias, "slope": got.slope,
                "correlation": got.correlation, "gain": float(1 - rmse[last] / rmse[k]),
                "low": low, "high": high, "nugget": model.nugget / model.sill,
                "range_along": model.ranges[0], "range_across": model.ranges[2],
            }
        )  # fmt: skip
    return rows
