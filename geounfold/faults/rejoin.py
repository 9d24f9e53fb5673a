"""Fault blocks cut, unfolded one by one, and joined again in one flat space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from geounfold.body.fault_cells import FaultCells
from geounfold.body.fault_surface import FaultSurface, FaultWalls
from geounfold.body.prepare import BodyPoints, Cells
from geounfold.body.working_frame import Frame
from geounfold.errors import InputError
from geounfold.faults.block_map import BlockMap, Pose, posed
from geounfold.faults.consistent import consistent_poses
from geounfold.faults.cutoffs import cutoff, refined
from geounfold.faults.cutting import (
    CRUMB,
    FaultCut,
    blocks_of_cells,
    by_size,
    cut_blocks,
    joined_small,
)
from geounfold.faults.from_blocks import layer_normals, surfaces_between
from geounfold.faults.given import MOST, FaultsGiven
from geounfold.faults.joints import Joint, facing, first_poses
from geounfold.faults.moved import moved_onto_blocks
from geounfold.faults.outline import Outlines
from geounfold.faults.poses import PoseRules, view
from geounfold.faults.result import FaultFit, FaultResult
from geounfold.faults.settled import along_sd, settled_by
from geounfold.faults.slips import slips_of
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.methods import BodyFit

_APART = 10.0  # blocks between groups of fault blocks that no fault joins


class Faulting:
    """One run's faults: cuts the body, and joins the fault blocks once they are unfolded.

    Parameters
    ----------
    given : FaultsGiven
        What the user gave.
    """

    def __init__(self, given: FaultsGiven) -> None:
        self.given = given
        self.surfaces: tuple[FaultSurface, ...] = ()
        self.notes: list[str] = []
        self._pairs: tuple[tuple[int, int], ...] = ()
        self._frame: Frame | None = None
        self._points = np.zeros((0, 3))
        self._cut = FaultCut(*(np.zeros(0, np.int64),) * 3, 0)

    def cut(self, cells: Cells) -> Ints:
        """Return the fault block of each cell of a run (see `geounfold.body.prepare.prepare`).

        Raises
        ------
        InputError
            A surface misses the body or cuts nothing; too many fault blocks.
        """
        order = np.lexsort(cells.work.T[::-1])
        points = cells.work[order]
        self._frame, self._points = cells.frame, points
        self.surfaces = self.given.in_work(cells.frame)
        self._check_near(points)
        if self.given.blocks is None:
            self.surfaces, told = moved_onto_blocks(points, self.surfaces, cells.frame)
            self.notes += told
            self._cut = cut_blocks(points, self.surfaces, cells.frame, CRUMB)
            self._check_cut()
        else:
            none = np.zeros(len(self.surfaces), np.int64)
            own = blocks_of_cells(cells, self.given.blocks)[order]
            self._cut = FaultCut(by_size(own), np.zeros((0, 2), np.int64), none, 0)
        self._cut, told = joined_small(points, self._cut, cells.frame)
        self.notes += told
        if self._cut.count == 1:
            raise InputError(
                "there is one fault block: a body without faults is unfolded without "
                "--fault-blocks and --faults"
            )
        label = np.empty(len(points), np.int64)
        label[order] = self._cut.block
        return label

    def _check_near(self, points: Floats) -> None:
        """Raise InputError if a fault surface misses the body."""
        for surface in self.surfaces:
            least = float(surface.sides(points).distance.min())
            if least > 2.0:
                raise InputError(
                    f"fault {surface.name} misses the body: it lies at least {least:.3g} blocks "
                    "away; are its coordinates, unit and elevation those of the blocks?"
                )

    def _check_cut(self) -> None:
        """Raise InputError if a fault surface parts no blocks, or there are too many of these."""
        if self._cut.count > MOST:
            raise InputError(
                f"the faults cut the body into {self._cut.count} fault blocks; at most {MOST} can "
                "be joined: leave out the smaller faults"
            )
        for surface, crossed in zip(self.surfaces, self._cut.crossed.tolist(), strict=True):
            if not crossed and not self._parts(surface):
                raise InputError(
                    f"fault {surface.name} cuts nothing: no two fault blocks lie on its two "
                    "sides; leave it out, or extend it through the body"
                )
        if self._cut.count == 1:
            names = ", ".join(surface.name for surface in self.surfaces)
            raise InputError(
                f"the faults ({names}) cut nothing: the body stays in one piece around them; "
                "extend them through the body"
            )

    def _parts(self, surface: FaultSurface) -> bool:
        """Return whether fault blocks lie on both sides of a surface, near it."""
        seen = surface.sides(self._points)
        near = (seen.distance < 2.0) & ~seen.past
        return bool((near & (seen.signed > 0)).any() and (near & (seen.signed < 0)).any())

    @property
    def lacks_surfaces(self) -> bool:
        """Whether only fault blocks are given, between which surfaces are to be fitted."""
        return not self.surfaces

    def find_surfaces(self, bodies: Sequence[BodyPoints], fits: Sequence[BodyFit | None]) -> None:
        """Fit surfaces between the fault blocks.

        Parameters
        ----------
        bodies : sequence of BodyPoints
            The fault blocks.
        fits : sequence of BodyFit or None
            Each unfolded without walls, for the normals of its layers; None if it could not be.

        Raises
        ------
        InputError
            No two fault blocks end at a common surface.
        """
        frame = self._prepared_frame
        normals = np.full(self._points.shape, np.nan)
        for k, (body, fit) in enumerate(zip(bodies, fits, strict=True)):
            if fit is not None and fit.control is not None:
                rows = np.flatnonzero(self._cut.block == k)
                block = BlockMap(body.fitted, fit, frame.steps, 1.0)
                normals[rows] = layer_normals(block, self._points[rows])
        self.surfaces, self._pairs = surfaces_between(self._points, self._cut.block, frame, normals)
        if not self.surfaces:
            raise InputError(
                "no two fault blocks end at a common surface: are the ids of fault blocks, and "
                "not of layers or domains? Give the faults by --faults"
            )

    def walled(self, bodies: Sequence[BodyPoints]) -> list[BodyPoints]:
        """Return the fault blocks with the walls that bound each."""
        return [replace(b, walls=FaultWalls.around(b.fitted, self.surfaces)) for b in bodies]

    @property
    def _prepared_frame(self) -> Frame:
        if self._frame is None:
            raise TypeError("cut() comes first")
        return self._frame

    def cells(self) -> FaultCells:
        """Return what gives folded points their fault block."""
        sides = self._prepared_frame.sides
        side = 1.0 if sides is None else float(max(sides))
        return FaultCells(self._points, self._cut.block, self.surfaces, side)

    def join(
        self, fits: Sequence[BodyFit], bodies: Sequence[BodyPoints], reach: float
    ) -> tuple[list[BodyFit], FaultResult]:
        """Return the fits in one flat space, and what was found of the faults.

        Parameters
        ----------
        fits : sequence of BodyFit
            Of every fault block.
        bodies : sequence of BodyPoints
            Their points.
        reach : float
            Distance from a block to which its map carries, in blocks.
        """
        frame = self._prepared_frame
        up = frame.up_in_work()
        blocks = [
            BlockMap(body.fitted, fit, frame.steps, reach)
            for body, fit in zip(bodies, fits, strict=True)
        ]
        joints = self._joints(blocks, up)
        blocks, joints, poses, groups = first_poses(blocks, joints, up)
        outlines = Outlines(blocks, self.surfaces) if self.given.outline == "ore" else None
        views = [
            view(j, blocks, up, self.given.direction(j.surface.name, frame), outlines)
            for j in joints
        ]
        found, left_out = consistent_poses(blocks, views, poses, groups, frame)
        self.notes += left_out
        poses = _groups_apart(blocks, found.poses, groups)
        self._tell_groups(groups)
        faults = [
            FaultFit(
                fault=v.joint.surface.name,
                foot=v.joint.foot,
                hanging=v.joint.hanging,
                slips=slips_of(v.joint, blocks, poses, frame),
                turn=_turned(poses[v.joint.foot], poses[v.joint.hanging]),
                resolved_by=settled_by(v, poses, PoseRules()),
                along_sd=along_sd(v, poses, found.covariance),
            )
            for v in found.views
        ]
        body = FaultResult(
            cells=self.cells(),
            poses=tuple(poses),
            groups=tuple(groups),
            faults=tuple(faults),
            overlap=_overlap(blocks, poses),
            scale=frame.scale,
            notes=tuple(self.notes),
        )
        return [posed(b.fit, p) for b, p in zip(blocks, poses, strict=True)], body

    def _joints(self, blocks: Sequence[BlockMap], up: Floats) -> list[Joint]:
        """Return all pairs of blocks that end at one fault, one on each side."""
        out = []
        for number, surface in enumerate(self.surfaces):
            fine = refined(surface)
            only = self._pairs[number] if self._pairs else None
            cuts = [cutoff(block, fine) for block in blocks]
            for a, low in enumerate(cuts):
                for b, high in enumerate(cuts):
                    if low is None or high is None or low.side >= 0 or high.side <= 0:
                        continue
                    if only is not None and set(only) != {a, b}:
                        continue
                    if facing(low, high, fine, up):
                        out.append(Joint(a, b, number, fine, low, high, self._weld(a, b)))
        return out

    def _weld(self, a: int, b: int) -> Floats | None:
        """Return the places at which two blocks touch and no fault parts them; None without."""
        own = np.sort(self._cut.block[self._cut.weld], axis=1)
        rows = (own == sorted((a, b))).all(axis=1)
        if not rows.any():
            return None
        out: Floats = self._points[self._cut.weld[rows]].mean(axis=1)
        return out

    def _tell_groups(self, groups: Sequence[int]) -> None:
        """Note the fault blocks that no fault joins to the largest."""
        for start in sorted(set(groups))[1:]:
            own = [str(b) for b, g in enumerate(groups) if g == start]
            self.notes.append(
                f"fault block{'s' * (len(own) > 1)} {', '.join(own)} could not be joined to fault "
                "block 0: they have no cut-offs at a common fault; they lie beside it"
            )


def _turned(foot: Pose, hanging: Pose) -> float:
    """Return the turn of the hanging wall against the footwall, degrees within -180 to 180."""
    angle = (hanging.angle - foot.angle + np.pi) % (2 * np.pi) - np.pi
    return float(np.degrees(angle))


def _groups_apart(
    blocks: Sequence[BlockMap], poses: Sequence[Pose], groups: Sequence[int]
) -> list[Pose]:
    """Return poses with groups that no fault joins side by side along x."""
    out = list(poses)
    edge: float | None = None
    for start in sorted(set(groups)):
        own = [b for b, g in enumerate(groups) if g == start]
        xs = []
        for b in own:
            whole = blocks[b].fit.shell or blocks[b].fit.control
            if whole is not None:
                xs.append(out[b].place(whole.unfolded.V)[:, 0])
        low, high = float(min(x.min() for x in xs)), float(max(x.max() for x in xs))
        shift = 0.0 if edge is None else edge + _APART - low
        for b in own:
            out[b] = replace(out[b], shift=out[b].shift + np.array([shift, 0.0]))
        edge = high + shift
    return out


def _overlap(blocks: Sequence[BlockMap], poses: Sequence[Pose]) -> float:
    """Return the share of all blocks whose images lie in a block of another fault block."""
    images = []
    for block, pose in zip(blocks, poses, strict=True):
        layers = block.carry(block.points)
        images.append(pose.place(layers.flat[layers.there]))
    hit = 0
    for a, own in enumerate(images):
        inside: Bools = np.zeros(len(own), dtype=bool)
        for b, other in enumerate(blocks):
            if a == b or not len(images[b]):
                continue
            low, high = images[b].min(axis=0) - 1, images[b].max(axis=0) + 1
            rows = np.flatnonzero(((own > low) & (own < high)).all(axis=1) & ~inside)
            if not len(rows):
                continue
            # only images near an image of the other block can lie in it
            near = cKDTree(images[b]).query(own[rows], distance_upper_bound=1.8)[0] < 1.8
            rows = rows[near]
            back = other.map.carry(poses[b].unplace(own[rows]), inverse=True)
            away = other.tree.query(back.points[back.placed], p=np.inf)[0]
            inside[rows[back.placed]] |= away < 0.5
        hit += int(inside.sum())
    return hit / 2 / max(sum(len(i) for i in images), 1)
