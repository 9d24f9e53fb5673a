"""Coordinates that were rounded in an export: put back on their lattice, or refused.

Programs that write six or seven digits cut a northing of 6,815,763.75 to 6815760 or 6815764. Blocks
then lie up to half a unit of the last digit off their lattice, and several may share one place.
"""

from __future__ import annotations

import numpy as np

from geounfold.body.check import count_duplicates
from geounfold.body.lattice import TOLERANCE
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats

_MOST_PLANES = 20_000  # distinct values along an axis; more are no planes of blocks
_SHARED = 0.05  # share of the blocks on a place with another, from which blocks are lost
_LONG = 1e4  # coordinates in last digits from which the digits may have been too few
_OFF = 0.75  # last digits from the steps of least squares; half of one from the true steps
_DIGITS = range(7, -7, -1)  # powers of ten tried as the last digit


def unrounded(points: Floats) -> Floats:
    """Return points with rounded coordinates put back on their lattice; else the points given.

    A coordinate counts as rounded if its distinct values lie within half a unit of the last digit
    of equal steps, but farther from them than blocks may lie off a lattice.

    Parameters
    ----------
    points : (n, 3) float
        Finite coordinates, along whose axes the lattice lies.

    Raises
    ------
    InputError
        Rounding put several blocks on one place.

    Examples
    --------
    >>> k = np.stack(np.meshgrid(*[np.arange(24)] * 3, indexing="ij"), -1).reshape(-1, 3)
    >>> exact = 6815001.25 + 2.5 * k
    >>> found = unrounded(np.rint(exact))
    >>> np.abs(np.rint(exact) - exact).max().item(), bool(np.abs(found - exact).max() < 0.1)
    (0.25, True)
    """
    _check_shared(points)
    found = [_on_steps(column) for column in points.T]
    if any(axis is None for axis in found):
        return points
    axes = [axis for axis in found if axis is not None]
    off = [worst for _, worst in axes]
    if max(off) <= TOLERANCE:
        return points
    return np.stack([column for column, _ in axes], axis=1)


def _last_digit(values: Floats) -> float:
    """Return the largest power of ten of which all values are multiples; 0 if none is."""
    for power in _DIGITS:
        digit = 10.0**power
        if np.abs(values - np.rint(values / digit) * digit).max() <= 1e-9 * np.abs(values).max():
            return digit
    return 0.0


def _on_steps(values: Floats) -> tuple[Floats, float] | None:
    """Return values put on equal steps and the largest move in steps; None if they fit none."""
    planes, row = np.unique(values, return_inverse=True)
    digit = _last_digit(planes) if len(planes) <= _MOST_PLANES else 0.0
    if len(planes) < 3:
        return values, 0.0
    if len(planes) > _MOST_PLANES or not digit:
        return None
    fits = [_steps(planes, step) for step in (np.diff(planes).mean(), np.median(np.diff(planes)))]
    fitted, step = min(fits, key=lambda fit: float(np.abs(planes - fit[0]).max()))
    off = float(np.abs(planes - fitted).max())
    if off > _OFF * digit or step < digit or planes[-1] - planes[0] > 3 * len(planes) * step:
        return None
    return (fitted if off > TOLERANCE * step else planes)[row], off / step


def _steps(planes: Floats, step: float) -> tuple[Floats, float]:
    """Return the equal steps nearest to rising values, and the step, from a rough one.

    They are infinite if two values fall on one step.
    """
    fitted, start = planes, 0.0
    for _ in range(3):
        place = np.rint((planes - planes[0] - start) / step)
        if (np.diff(place) < 1).any():
            return np.full(len(planes), np.inf), float(step)
        step, start = np.polyfit(place, planes - planes[0], 1)
        fitted = start + step * place + planes[0]
    return fitted, float(step)


def _check_shared(points: Floats) -> None:
    """Raise InputError if blocks share places because their coordinates have too few digits."""
    if count_duplicates(points) < _SHARED * len(points):
        return
    count = np.unique(points, axis=0, return_counts=True)[1]
    if (count == count[0]).all():  # rows that all are there twice are copies
        return
    for axis in range(3):
        planes = np.unique(points[:, axis])
        digit = _last_digit(planes)
        if not digit or len(planes) < 3 or np.abs(planes).max() < _LONG * digit:
            continue
        if np.median(np.diff(planes)) <= 3 * digit:
            raise InputError(
                f"{len(points) - len(count)} of {len(points)} blocks lie on a place with another: "
                f"all {'xyz'[axis]} are multiples of {digit:g} (such as {planes[0]:.15g}), "
                "so their last digits were rounded off; export the coordinates again with more "
                "digits"
            )
