"""A map given by a rule for single points, with the interface of a control mesh's map."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.working_frame import Frame
from geounfold.errors import InputError, OptionError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.mapping.carried import Carried, Returned, checked_points
from geounfold.methods.contract import Pointwise


class PointwiseMap:
    """A fitted unfolding without a control mesh: it carries points, but nothing about it is proved.

    Parameters
    ----------
    name : str
        Name of the method.
    frame : Frame
        Working frame.
    rule : Pointwise
        The map, in working units.
    blocks : (b, 3) float
        Blocks of the body, working units.  A point within half a block's diagonal of one is inside;
        a point farther away than the reach has no image.
    reach : float
        Distance past the body, in blocks, up to which points are carried.
    """

    coordinates = "tet"
    prisms = None

    def __init__(
        self, name: str, frame: Frame, rule: Pointwise, blocks: Floats, reach: float
    ) -> None:
        self.name = name
        self.frame = frame
        self.rule = rule
        self.reach = reach
        self._blocks = blocks
        steps = np.ones(3) if frame.sides is None else frame.sides
        self._half = float(np.linalg.norm(steps)) / 2

    @property
    def fault(self) -> str:
        """The reason why the map is not proved one-to-one."""
        return f"method {self.name} has no control mesh: nothing is proved"

    @cached_property
    def _folded(self) -> cKDTree:
        return cKDTree(self._blocks)

    @cached_property
    def _flat(self) -> cKDTree:
        points = self.rule.to_flat(self._blocks).points
        return cKDTree(points[np.isfinite(points).all(axis=1)])

    def carry(self, points: Floats, *, inverse: bool = False) -> Carried:
        """Carry points to the flat space, or back with ``inverse``.

        Parameters
        ----------
        points : (n, 3) float
            Folded points in the data's coordinates; with ``inverse`` unfolded points.  Empty rows
            (all NaN: no image) stay empty.
        inverse : bool
            True for the way from the flat space back to the folded one.

        Returns
        -------
        Carried
            ``inside``: within the body and over its surfaces; ``element`` is -1 everywhere.
            On the way back the stratigraphic coordinate is NaN.

        Raises
        ------
        InputError
            Points of another shape, or not finite; or the method has no inverse.
        """
        if inverse and not self.rule.way_back:
            raise InputError(f"method {self.name} has no way back: use --method sheet")
        P = np.ascontiguousarray(points, dtype=np.float64)
        there: Bools = np.ones(len(P), dtype=bool)
        if inverse and P.ndim == 2:
            there = np.logical_not(np.isnan(P).all(axis=1))
        P = checked_points(P[there])
        work = P / self.frame.scale if inverse else self.frame.to_work(P)
        tree = self._flat if inverse else self._folded
        distance = np.maximum(np.asarray(tree.query(work)[0], dtype=np.float64) - self._half, 0)
        if inverse:
            image = self.rule.to_folded(work)
            share, anchored = np.full(len(P), np.nan), np.ones(len(P), dtype=bool)
            out = self.frame.to_world(image)
        else:
            placed = self.rule.to_flat(work)
            share, anchored = placed.stratigraphic, placed.anchored
            out = placed.points * self.frame.scale
        good = np.isfinite(out).all(axis=1) & (distance <= self.reach)
        out[~good] = np.nan
        share = np.where(good, share, np.nan)
        inside = good & anchored & (distance == 0)
        return Carried(out, share, inside, good, _none(P), distance * self.frame.scale).spread(
            there
        )

    def returned(self, points: Floats, carried: Carried) -> Returned | None:
        """Return points (n, 3) carried back from their images; None if the map has no inverse."""
        if not self.rule.way_back:
            return None
        back = self.carry(carried.points, inverse=True)
        both = carried.placed & back.placed
        away = np.linalg.norm(back.points[both] - points[both], axis=1)
        return Returned(float(away.max(initial=0.0)), carried.placed & ~back.placed)

    def to_flat(self, points: Floats) -> Floats:
        """Return folded points (n, 3) in the flat space, same unit; NaN beyond the reach."""
        return self.carry(points).points

    def to_folded(self, points: Floats) -> Floats:
        """Return flat points (n, 3) in the folded space, the data's; NaN beyond the reach."""
        return self.carry(points, inverse=True).points

    def save(self, path: str | Path | BinaryIO) -> None:
        """Raise OptionError: only a control mesh can be saved."""
        raise OptionError(no_mesh(self.name, "its map cannot be saved"))


def no_mesh(method: str, what: str) -> str:
    """Return the error message for something that needs a control mesh."""
    return f"method {method} has no control mesh, so {what}: use --method sheet"


def _none(P: Floats) -> np.ndarray:
    return np.full(len(P), -1, dtype=np.int64)
