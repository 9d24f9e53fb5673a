"""Poses of all fault blocks, found together: cut-offs meet, outlines meet, priors for the rest.

Every round adds, for each joint, rows that bring cut-offs together across their common direction
(point to line, both ways), rows that bring the ends of cut-offs together along it if they are the
ore's outline, a weak prior against slip across the slip's direction, a prior that a fault's strike
looks the same way from both blocks, and one that layer-parallel shear is the same on both walls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from geounfold.faults.block_map import BlockMap, Pose
from geounfold.faults.cutoffs import LEVELS, MIDDLE, Cutoff, strike_of
from geounfold.faults.equations import WIDTH, Equations
from geounfold.faults.joints import Joint
from geounfold.faults.outline import AGREE, Mark, Outlines
from geounfold.geometry.mesh import Floats, Ints


@dataclass(frozen=True, kw_only=True)
class PoseRules:
    """Weights of the fit of poses; lengths in blocks, measured on 18 designed bodies.

    Parameters
    ----------
    normal : float
        Error of a cut-off across its direction, per ``along`` blocks of its length.
    along : float
        Blocks of cut-off that count as one observation.
    corner, single : float
        Error of the slip along the fault that an outline's two ends mark, and one end alone.
    rake : float
        Slip across the expected direction, as a share of the slip.
    expected : float
        Error of the cut-offs' places that is added to it.
    turn : float
        Turn of a block in the plane of its layers, radians.
    shear : float
        Change of layer-parallel shear across a fault, radians.
    rounds : int
        Most rounds of the fit.
    """

    normal: float = 0.35
    along: float = 6.0
    corner: float = 0.7
    single: float = 1.0
    rake: float = 0.2
    expected: float = 0.5
    turn: float = 0.03
    shear: float = 0.25
    rounds: int = 250


@dataclass(eq=False)
class JointView:
    """What the fit needs of a joint, computed once.

    Attributes
    ----------
    joint : Joint
        The joint.
    trees : list
        For foot and hanging block and each level: tree in the own flat plane and rows, or None.
    heads : list of (2,) float or None
        The fault's strike in the own flat plane of each block.
    leans : list of (2,) float
        Layer-parallel shear at the cut-off of each block.
    pairs : (k, 2) int
        Samples of the hanging and the foot block between which there is no slip across the slip's
        direction.
    slip : float
        Their median distance.
    given : bool
        Whether the slip's direction was given.
    welds : list of (k, 3) float
        Places that no fault parts, in the own flat space of each block.
    marks : list of Mark
        Where the outlines of both blocks meet the fault; empty if the model was cut off.
    used : int
        Number of marks used in the last round.
    agree : bool
        Whether the marks agreed in the last round.
    """

    joint: Joint
    trees: list[list[tuple[cKDTree, Ints] | None]]
    heads: list[Floats | None]
    leans: list[Floats]
    pairs: Ints
    slip: float
    given: bool
    welds: list[Floats]
    marks: list[Mark]
    used: int = 0
    agree: bool = True


@dataclass(frozen=True, eq=False)
class PoseFit:
    """The poses found.

    Attributes
    ----------
    poses : list of Pose
        Of every fault block.
    views : list of JointView
        Of every joint, with what became of its outline.
    covariance : (5 n, 5 n) float
        Of all poses.
    rounds : int
        Rounds done.
    """

    poses: list[Pose]
    views: list[JointView]
    covariance: Floats
    rounds: int


def view(
    joint: Joint,
    blocks: Sequence[BlockMap],
    up: Floats,
    direction: Floats | None,
    outlines: Outlines | None,
) -> JointView:
    """Return what the fit needs of a joint.

    Parameters
    ----------
    joint : Joint
        The joint.
    blocks : sequence of BlockMap
        The fault blocks.
    up : (3,) float
        Working units.
    direction : (3,) float or None
        Direction of the fault's slip, if it is known.
    outlines : Outlines or None
        The ore's outline; None if the model was cut off.
    """
    ends_ = ((joint.foot, joint.low), (joint.hanging, joint.high))
    strike = strike_of(joint.surface, joint.low.folded[::5], up)
    trees = [[_tree(cut, level) for level in range(len(LEVELS))] for _, cut in ends_]
    looks = [_look(blocks[b], cut, joint, strike) for b, cut in ends_]
    pairs, slip = _expected(joint, up, direction)
    welds = []
    if joint.weld is not None:
        carried = [blocks[b].carry(joint.weld) for b, _ in ends_]
        both = carried[0].there & carried[1].there
        welds = [c.flat[both] for c in carried]
    heads, leans = [look[0] for look in looks], [look[1] for look in looks]
    marks = [] if outlines is None else outlines.marks(joint, strike)
    return JointView(joint, trees, heads, leans, pairs, slip, direction is not None, welds, marks)


def _tree(cut: Cutoff, level: int) -> tuple[cKDTree, Ints] | None:
    rows = cut.rows(level)
    return None if len(rows) < 3 else (cKDTree(cut.flat[rows, :2]), rows)


def _look(
    block: BlockMap, cut: Cutoff, joint: Joint, strike: Floats
) -> tuple[Floats | None, Floats]:
    """Return the strike's direction in a block's flat plane, and its layer-parallel shear."""
    P = cut.folded[cut.rows(MIDDLE)]
    a, b = (block.carry(P + s * 0.7 * strike).flat for s in (1, -1))
    along = (a - b)[:, :2]
    size = np.linalg.norm(along, axis=1)
    ok = np.isfinite(size) & (size > 1e-9)
    head = None
    if ok.sum() >= 3:
        mean = (along[ok] / size[ok, None]).mean(axis=0)
        head = mean / np.linalg.norm(mean)
    rise = np.stack(
        [block.carry(P + d).level - block.carry(P - d).level for d in 0.5 * np.eye(3)], axis=1
    )
    normal = rise / np.maximum(np.linalg.norm(rise, axis=1, keepdims=True), 1e-12)
    ok = np.isfinite(normal).all(axis=1)
    if ok.sum() < 3:
        return head, np.zeros(2)
    d = block.carry(P[ok] + 0.5 * normal[ok]).flat - block.carry(P[ok] - 0.5 * normal[ok]).flat
    return head, np.nanmedian(d[:, :2] / np.maximum(d[:, 2:], 0.1), axis=0)


_AGREE = (
    2.5  # blocks by which two pairs of ends may differ in the slip along the fault that they mark
)

_MOST = 400  # samples of a cut-off that the prior on the slip's direction uses


def _expected(joint: Joint, up: Floats, direction: Floats | None) -> tuple[Ints, float]:
    """Return pairs of samples (hanging, foot) joined by slip in its expected direction only."""
    c, d = joint.high.rows(MIDDLE), joint.low.rows(MIDDLE)
    c, d = c[:: max(1, len(c) // _MOST)], d[:: max(1, len(d) // _MOST)]
    if min(len(c), len(d)) < 4:
        return np.zeros((0, 2), np.int64), 0.0
    P, Q = joint.high.folded[c], joint.low.folded[d]
    across = _across(joint, P, up, direction)
    apart = Q[None] - P[:, None]
    miss = np.abs((apart * across[:, None]).sum(axis=2))
    best = miss.argmin(axis=1)
    ok = miss[np.arange(len(c)), best] < 1.0
    if ok.sum() < 4:
        return np.zeros((0, 2), np.int64), 0.0
    size = np.linalg.norm(apart[np.arange(len(c)), best][ok], axis=1)
    return np.stack([c[ok], d[best[ok]]], axis=1), float(np.median(size))


def _across(joint: Joint, places: Floats, up: Floats, direction: Floats | None) -> Floats:
    """Return the direction in the fault, square to the slip, at places on it, (n, 3)."""
    n = joint.surface.normal[joint.surface.sides(places).face]
    if direction is None:
        d = n * (n @ up)[:, None] - up
        level = np.linalg.norm(d, axis=1) < 0.05
        d[level] = np.array([1.0, 0.0, 0.0]) - n[level] * n[level, :1]
    else:
        d = direction - n * (n @ direction)[:, None]
    out: Floats = np.cross(n, d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-12))
    return out


def solve_poses(
    blocks: Sequence[BlockMap],
    views: list[JointView],
    poses: list[Pose],
    groups: Sequence[int],
    rules: PoseRules | None = None,
) -> PoseFit:
    """Return the poses that join all fault blocks.

    Parameters
    ----------
    blocks : sequence of BlockMap
        The fault blocks.
    views : list of JointView
        Of every joint.
    poses : list of Pose
        First guess.
    groups : sequence of int
        First block of each block's group.
    rules : PoseRules, optional
        Weights.
    """
    rules = rules or PoseRules()
    share = np.array([len(block.points) for block in blocks], dtype=float)
    poses = list(poses)
    done = 0
    for done in range(1, rules.rounds + 1):
        equations = Equations(len(blocks))
        for v in views:
            _add_joint(equations, v, poses, rules, late=done > 5)
        equations.hold(poses, groups, share, rules.shear)
        step = equations.steps()
        damping = min(1.0, 0.3 / max(float(np.abs(step[:, 0]).max()), 1e-12))
        poses = [p.moved(damping * s) for p, s in zip(poses, step, strict=True)]
        if done > 9 and np.abs(step[:, 1:3]).max() < 1e-4:
            break
    return PoseFit(poses, views, equations.covariance(), done)


@dataclass(frozen=True, eq=False)
class _Wall:
    """One block's side of a joint, with its present pose.

    Attributes
    ----------
    block : int
        The fault block.
    pose : Pose
        Its pose.
    cut : Cutoff
        Its cut-off.
    trees : list
        As in JointView.
    """

    block: int
    pose: Pose
    cut: Cutoff
    trees: list[tuple[cKDTree, Ints] | None]

    @cached_property
    def placed(self) -> Floats:
        """The cut-off in the joint flat space, (n, 3)."""
        return self.pose.place(self.cut.flat)

    @cached_property
    def along(self) -> Floats:
        """Its tangents there, (n, 2)."""
        out: Floats = self.cut.tangent @ self.pose.turn.T
        return out

    def moves(self, flat: Floats, direction: Floats) -> tuple[int, Floats]:
        """Return the block, and the derivative of places along directions ((2,) or (n, 2))."""
        J = self.pose.jacobian(flat)
        rule = "kab,a->kb" if direction.ndim == 1 else "kab,ka->kb"
        out: Floats = np.einsum(rule, J, direction)
        return self.block, out


def _add_joint(
    equations: Equations,
    v: JointView,
    poses: Sequence[Pose],
    rules: PoseRules,
    *,
    late: bool,
) -> None:
    """Add a joint's rows; its outline's only in late rounds, once the blocks lie side by side."""
    j = v.joint
    low = _Wall(j.foot, poses[j.foot], j.low, v.trees[0])
    high = _Wall(j.hanging, poses[j.hanging], j.high, v.trees[1])
    if v.welds:
        _add_weld(equations, v, low, high)
    _add_lines(equations, rules, high, low)
    _add_lines(equations, rules, low, high)
    mid = np.concatenate([w.along[w.cut.rows(MIDDLE)] for w in (low, high)])
    if len(mid):
        axis = np.linalg.eigh(mid.T @ mid)[1][:, 1]
        v.used, v.agree = 0, True
        if late and v.marks and not v.welds:
            _add_corners(equations, v, rules, low, high, axis)
        _add_expected(equations, v, rules, low, high, axis)
    if not v.welds:
        _add_turn(equations, v, rules, low, high)
    _add_shear(equations, v, rules, low, high)


def _add_weld(equations: Equations, v: JointView, low: _Wall, high: _Wall) -> None:
    """Add rows that keep welded places together."""
    below, above = v.welds
    if not len(below):
        return
    off = high.pose.place(above)[:, :2] - low.pose.place(below)[:, :2]
    weight = np.full(len(off), 10 / (len(off) * 0.3**2))
    for k, axis in enumerate(np.eye(2)):
        equations.add(high.moves(above, axis), low.moves(below, axis), off[:, k], weight)


def _add_lines(equations: Equations, rules: PoseRules, moved: _Wall, against: _Wall) -> None:
    """Add rows that bring the samples of one cut-off onto the lines of the other."""
    for level, tree in enumerate(against.trees):
        rows = moved.cut.rows(level)
        if tree is None or len(rows) < 3:
            continue
        own = against.pose.unplace(moved.placed[rows])[:, :2]
        q = tree[1][tree[0].query(own)[1]]
        apart, along = moved.placed[rows, :2] - against.placed[q, :2], against.along[q]
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        off = (apart * normal).sum(axis=1)
        limit = max(1.5, 3 * float(np.median(np.abs(off))))
        ok = (np.abs((apart * along).sum(axis=1)) < 1.2) & (np.abs(off) < limit)
        if ok.sum() < 3:
            ok = np.abs(off) < limit
        rows, q, normal, off = rows[ok], q[ok], normal[ok], off[ok]
        weight = moved.cut.length[rows] / (rules.along * len(LEVELS) * 2 * rules.normal**2)
        weight = weight / np.sqrt(1 + (off / (3 * rules.normal)) ** 2)
        equations.add(
            moved.moves(moved.cut.flat[rows], normal),
            against.moves(against.cut.flat[q], normal),
            *(off, weight),
        )


def _add_corners(
    equations: Equations, v: JointView, rules: PoseRules, low: _Wall, high: _Wall, axis: Floats
) -> None:
    """Add rows that bring the outlines of both blocks together along the fault, if they agree."""
    used = [m for m in v.marks if not m.flaw]
    below = [low.pose.place(m.foot[None])[0, :2] for m in used]
    above = [high.pose.place(m.hanging[None])[0, :2] for m in used]
    off = [float((b - a) @ axis) for a, b in zip(below, above, strict=True)]
    if len(off) == 2 and abs(off[0] - off[1]) > AGREE:
        used, v.agree = [], False
    sd = rules.corner if len(used) == 2 else rules.single
    for m, o in zip(used, off, strict=False):
        equations.add(
            high.moves(m.hanging[None], axis),
            low.moves(m.foot[None], axis),
            *(np.array([o]), np.array([sd**-2])),
        )
    v.used = len(used)


def _add_expected(
    equations: Equations, v: JointView, rules: PoseRules, low: _Wall, high: _Wall, axis: Floats
) -> None:
    """Add the weak prior against slip across its expected direction."""
    if not len(v.pairs):
        return
    c, q = v.pairs.T
    sd = rules.rake * v.slip + (0.3 if v.given else rules.expected)
    if v.used and not v.given and not all(m.plane for m in v.marks if not m.flaw):
        sd = 30.0 if v.used == 2 else max(2 * sd, 6.0)  # the outline knows better
    off = (high.placed[c, :2] - low.placed[q, :2]) @ axis
    weight = 1 / (len(c) * sd**2 * np.sqrt(1 + (off / sd) ** 2))
    equations.add(high.moves(high.cut.flat[c], axis), low.moves(low.cut.flat[q], axis), off, weight)


def _add_turn(
    equations: Equations, v: JointView, rules: PoseRules, low: _Wall, high: _Wall
) -> None:
    """Add the prior that the fault's strike looks the same way from both blocks."""
    a, b = v.heads
    if a is None or b is None:
        return
    one = np.eye(WIDTH)[:1]
    p, q = low.pose.turn @ a, high.pose.turn @ b
    off = np.arctan2(p[0] * q[1] - p[1] * q[0], p @ q)
    equations.add((high.block, one), (low.block, one), np.array([off]), np.array([rules.turn**-2]))


def _add_shear(
    equations: Equations, v: JointView, rules: PoseRules, low: _Wall, high: _Wall
) -> None:
    """Add the prior that layer-parallel shear is the same on both walls."""
    off = high.pose.turn @ (high.pose.shear + v.leans[1])
    off = off - low.pose.turn @ (low.pose.shear + v.leans[0])
    for k in (0, 1):
        own, other = np.zeros((1, WIDTH)), np.zeros((1, WIDTH))
        own[0, 3:], other[0, 3:] = high.pose.turn[k], low.pose.turn[k]
        weight = np.array([rules.shear**-2])
        equations.add((high.block, own), (low.block, other), off[k : k + 1], weight)
