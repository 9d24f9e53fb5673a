"""Run the members of an unfolding and measure how far they spread."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geounfold.backends.progress import told
from geounfold.errors import GeounfoldError
from geounfold.geometry.mesh import Floats
from geounfold.methods.contract import PreparedBody
from geounfold.methods.sheet.members.flat_places import FlatPlaces
from geounfold.methods.sheet.members.kinds import (
    Base,
    hull_level,
    in_cell,
    left_out,
    no_slip,
    pin_line,
    rim,
    sides,
    stiffness,
)
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.result import SheetResult
from geounfold.methods.sheet.sharpening.lattice_sites import scatter
from geounfold.methods.sheet.stages import case_of, parameters
from geounfold.quality.uncertainty import Spread, laid_on

FITTED: dict[str, Callable[[Base, int], FittedSheet | None]] = {
    "in_cell": in_cell,
    "stiffness": stiffness,
    "rim": rim,
    "sides": sides,
    "left_out": left_out,
    "hull_level": hull_level,
}
"""Kinds of members that fit a mid surface, by name, in the order in which they are run."""

DERIVED: dict[str, Callable[[Base, Floats], Floats]] = {"pin_line": pin_line, "slip": no_slip}
"""Kinds that follow from the answer's mid surface; they cost nothing and are always measured."""

LEAST_MEMBERS = len(FITTED)
"""Least number of members: one of each kind that is fitted."""

ONCE = ("sides", "hull_level")
"""Kinds that are not drawn: a second member would equal the first."""

MOST_POINTS = 12_000
"""Largest number of blocks whose spread is measured; an evenly spread part if there are more."""


def schedule(count: int) -> list[tuple[str, int]]:
    """Return kind and seed of every member of a run of ``count``.

    Examples
    --------
    >>> [kind for kind, _ in schedule(8)][-3:]
    ['hull_level', 'in_cell', 'stiffness']
    """
    drawn = [name for name in FITTED if name not in ONCE]
    out = [(name, 0) for name in FITTED]
    while len(out) < count:
        k = len(out) - len(FITTED)
        out.append((drawn[k % len(drawn)], 1 + k // len(drawn)))
    return out[:count]


def run_members(body: PreparedBody, result: SheetResult, count: int) -> Spread:
    """Return how far the members of one body spread.

    Parameters
    ----------
    body : PreparedBody
        What the answer was fitted to.
    result : SheetResult
        The answer.
    count : int
        Number of members that are fitted.
    """
    unit = 1 if body.coarse is None else body.coarse.merge
    trial = result.finish.trial
    points = body.blocks
    if len(points) > MOST_POINTS:
        points = points[scatter(points) < MOST_POINTS / len(points)]
    places = FlatPlaces.of(trial.fitted, points, parameters)
    steps = np.ones(3) if body.frame.steps is None else body.frame.steps
    case = case_of(body, result.medial, unit, lambda: None)  # the sites used are those of the trial
    base = Base(case, trial, steps, places)
    flat = places.place(trial.fitted)
    moved: dict[str, list[Floats]] = {name: [] for name in (*FITTED, *DERIVED)}
    failed: list[str] = []
    for name, make in DERIVED.items():
        moved[name].append(laid_on(make(base, flat), flat) - flat)
    plan = schedule(count)
    for k, (name, seed) in enumerate(plan):
        told(k / len(plan))
        try:
            fitted = FITTED[name](base, seed)
        except GeounfoldError:
            fitted = None
        if fitted is None:
            failed.append(name)
            continue
        moved[name].append(laid_on(places.place(fitted), flat) - flat)
    return Spread.of(points, moved, failed, noise_variance(body))


def noise_variance(body: PreparedBody) -> float:
    """Return the variance of the blocks' places about their lattice, mean over the axes.

    It is 0 on an exact lattice, and without one, because the places of scattered points are theirs.
    The phases of the places within their cells give it: their mean vector has the length
    exp(-(2 pi s / side)^2 / 2) if s is the standard deviation of normal noise.
    """
    sides = body.frame.sides
    if sides is None or body.frame.steps is not None:
        return 0.0
    length = np.abs(np.exp(2j * np.pi * body.blocks / sides).mean(axis=0))
    return float(np.mean(-2 * np.log(length) * (sides / (2 * np.pi)) ** 2))
