"""How good an unfolding is: neighbour distances, distortion, and distance from a truth.

The thesis's measure (NMD and epsilon, equations 2.2 to 2.5) is nearly blind to folds: a body left
as it is scores 0 against itself and less than many real unfoldings against the truth.  It is
therefore given together with what doing nothing would score, and with measures that see folds.

All lengths are in the unit of the points given; ratios are unfolded over folded (or answer over
truth), so that 1 is no change.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from scipy.spatial import cKDTree

from geounfold.control import ControlMesh
from geounfold.distortion import deformation_gradients, distortion, edge_change
from geounfold.errors import InputError
from geounfold.geometry import lengths, tet_volumes
from geounfold.lattice_neighbours import lattice_nmd
from geounfold.mesh import Floats, Ints
from geounfold.threads import cores, over_slices, slices

NEIGHBOURS = 26
"""Neighbours per point: those of a block inside a lattice that share a face, edge or corner."""

_CHUNK = 1 << 16  # points whose neighbours are sought at once: 28 MB beside the answer
_CACHED = 1 << 11  # points whose distances are summed at once: they stay in the cache
_PAIRS = 100_000  # pairs that the far distances are sampled with
_SIDES = 6  # neighbours that share a face with a block of a lattice
_PLANE = 1e-9  # of the largest variance: less than this across a plane is none
_ALONG = 0.95  # cosine from which a pair of neighbours counts as lying along an axis (18 degrees)


@dataclass(frozen=True)
class Statistics:
    """Mean, standard deviation, 95th percentile and maximum of a set of values."""

    mean: float
    std: float
    p95: float
    max: float

    @classmethod
    def of(cls, values: Floats) -> Statistics:
        """Summarise values of any shape.

        Raises
        ------
        InputError
            No values, or some that are not finite.

        Examples
        --------
        >>> Statistics.of(np.array([1.0, 3.0]))
        Statistics(mean=2.0, std=1.0, p95=2.9, max=3.0)
        """
        values = np.asarray(values, dtype=np.float64)
        if values.size == 0:
            raise InputError("there are no values to summarise")
        if not np.isfinite(values).all():
            bad = int(np.count_nonzero(~np.isfinite(values)))
            raise InputError(f"{bad} of {values.size} values are not finite")
        p95 = float(np.percentile(values, 95))
        return cls(float(values.mean()), float(values.std()), p95, float(values.max()))


# --------------------------------------------------------------------------- neighbour distances


def _cloud(points: Floats, name: str = "points") -> Floats:
    """Return points as contiguous (n, 3) floats, or raise InputError."""
    P = np.ascontiguousarray(points, dtype=np.float64)
    if P.ndim != 2 or P.shape[1] != 3:
        raise InputError(f"{name} must have shape (n, 3), but have {P.shape}")
    if not np.isfinite(P).all():
        bad = int(np.flatnonzero(~np.isfinite(P).all(axis=1))[0])
        raise InputError(f"{name}: row {bad} is not finite: {P[bad]}")
    return P


def _same_rows(a: Floats, b: Floats, names: str) -> None:
    if len(a) != len(b):
        raise InputError(f"{names} must pair row by row, but have {len(a)} and {len(b)} rows")


def neighbours(points: Floats, k: int = NEIGHBOURS) -> Ints:
    """Return the k nearest neighbours of each point, itself left out.

    Parameters
    ----------
    points : (n, 3) float
        Points, in any length unit; n > k.
    k : int
        Number of neighbours.

    Returns
    -------
    (n, k) int
        Row numbers, nearest first; of equally near ones, any, but always the same.

    Raises
    ------
    InputError
        Wrong shape, values that are not finite, k < 1 or too few points.

    Examples
    --------
    >>> neighbours(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), k=2).tolist()
    [[1, 2], [0, 2], [1, 0]]
    """
    P = _cloud(points)
    _check_neighbours(len(P), k)
    tree = cKDTree(P)
    out = np.empty((len(P), k), dtype=np.int64)
    for rows in slices(len(P), _CHUNK):
        out[rows] = _nearest(tree, rows, k)
    return out


def _check_neighbours(count: int, k: int) -> None:
    """Raise InputError where points cannot have k neighbours."""
    if k < 1:
        raise InputError(f"the number of neighbours must be at least 1, but is {k}")
    if count <= k:
        raise InputError(f"{k} neighbours need more than {k} points, but there are {count}")


def _nearest(tree: cKDTree, rows: slice | Ints, k: int) -> Ints:
    """Return the k nearest neighbours of some of a tree's points, (m, k)."""
    found = np.asarray(tree.query(tree.data[rows], k=k + 1, workers=cores())[1], dtype=np.int64)
    numbers = np.arange(rows.start, rows.stop) if isinstance(rows, slice) else rows
    return _without_self(found, numbers)


def _without_self(found: Ints, rows: Ints) -> Ints:
    """Drop each row's own number; among coincident points it need not come first."""
    itself = found == rows[:, None]
    if itself[:, 0].all():
        first: Ints = found[:, 1:]
        return first
    # Where more points coincide than were asked for, the row itself may be missing: drop any.
    itself[~itself.any(axis=1), 0] = True
    others: Ints = found[~itself].reshape(len(found), -1)
    return others


def nmd(points: Floats, neighbours: Ints) -> Floats:
    """Return the neighbour mean distance of each point (thesis, equation 2.2).

    Parameters
    ----------
    points : (n, 3) float
        Points, in any length unit.
    neighbours : (n, k) int
        Row numbers of each point's neighbours.

    Returns
    -------
    (n,) float
        Mean distance to the neighbours, in the points' unit.

    Raises
    ------
    InputError
        Wrong shapes, values that are not finite or row numbers out of range.

    Examples
    --------
    >>> nmd(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), np.array([[1, 2], [0, 2], [1, 0]]))
    array([2. , 1.5, 2.5])
    """
    P, N = _cloud(points), np.asarray(neighbours)
    if N.ndim != 2 or len(N) != len(P) or N.shape[1] == 0:
        raise InputError(f"neighbours must have shape ({len(P)}, k), but have {N.shape}")
    if not 0 <= N.min() <= N.max() < len(P):
        raise InputError(f"neighbours name rows {N.min()}..{N.max()}, but there are {len(P)}")
    return _mean_distance(np.ascontiguousarray(P.T), np.arange(len(P)), N)


def _mean_distance(axes: Floats, rows: Ints, ids: Ints) -> Floats:
    """Return the mean distance from points in some rows (m,) to their neighbours (m, k).

    ``axes`` (3, n) are the points' columns.
    """
    out = np.empty(len(rows))

    def work(part: slice) -> None:
        square: Floats = np.zeros(ids[part].shape)
        for axis in axes:
            square += (axis[ids[part]] - axis[rows[part], None]) ** 2
        out[part] = np.sqrt(square, out=square).mean(axis=1)

    over_slices(work, len(rows), _CACHED)
    return out


def epsilon(
    A: Floats, B: Floats, k: int = NEIGHBOURS, mode: Literal["reference", "own"] = "reference"
) -> Floats:
    """Return the relative change of the neighbour mean distance (thesis, equation 2.4).

    ``|NMD(A_i) - NMD(B_i)| / NMD(A_i)``: its rows are the distribution of equation 2.3, their sum
    is equation 2.5.  It tells neither stretching from shrinking nor a fold from none.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference and other cloud, row by row the same points, *in the same unit*.
    k : int
        Number of neighbours.
    mode : "reference" or "own"
        Whether B keeps the neighbours found in A, or each cloud has its own.

    Returns
    -------
    (n,) float
        Dimensionless, not negative.

    Raises
    ------
    InputError
        Unequal shapes, an unknown mode, too few points, or coincident points in A.

    Examples
    --------
    >>> A = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> epsilon(A, 2 * A, k=2)
    array([1., 1., 1.])
    """
    A, B = _cloud(A, "A"), _cloud(B, "B")
    _same_rows(A, B, "A and B")
    if mode not in ("reference", "own"):
        raise InputError(f"mode must be 'reference' or 'own', but is {mode!r}")
    if mode == "own":
        return _change(nmd(A, neighbours(A, k)), nmd(B, neighbours(B, k)), k)
    _check_neighbours(len(A), k)
    return _change(*_kept_neighbours(A, B, np.arange(len(A)), k), k)


def _change(before: Floats, after: Floats, k: int) -> Floats:
    """Return the relative change of mean distances, (n,)."""
    if not before.all():
        raise InputError(f"point {int(np.argmin(before))} of A coincides with its {k} neighbours")
    return np.abs(before - after) / before


def _kept_neighbours(A: Floats, B: Floats, rows: Ints, k: int) -> tuple[Floats, Floats]:
    """Return the mean distance of some points (m,) to their neighbours in A, in A and in B.

    The neighbours of a part of them at a time: memory does not grow with their number.
    """
    before, after = np.empty(len(rows)), np.empty(len(rows))
    if len(rows):
        tree = cKDTree(A)
        a, b = np.ascontiguousarray(A.T), np.ascontiguousarray(B.T)
        for part in slices(len(rows), _CHUNK):
            ids = _nearest(tree, rows[part], k)
            before[part] = _mean_distance(a, rows[part], ids)
            after[part] = _mean_distance(b, rows[part], ids)
    return before, after


def lattice_epsilon(A: Floats, B: Floats, cells: Ints, sides: Floats, k: int) -> Floats:
    """Return `epsilon` of blocks on a lattice, (n,): exact, many times faster than by a tree.

    Of equally near neighbours the mean counts; a tree takes any.  So the answer depends neither
    on the order of the rows nor on how the body lies in space.

    Parameters
    ----------
    A, B : (n, 3) float
        As for `epsilon`.
    cells : (n, 3) int
        Lattice cell of each block of A.
    sides : (3,) float
        Sides of a cell, in any unit.
    k : int
        Number of neighbours.

    Raises
    ------
    InputError
        As `epsilon` does.
    """
    A, B = _cloud(A, "A"), _cloud(B, "B")
    _same_rows(A, B, "A and B")
    _check_neighbours(len(A), k)
    found = lattice_nmd(cells, sides, (A, B), k)
    if found is None:
        return epsilon(A, B, k)
    before, after = found
    lonely = np.flatnonzero(np.isnan(before))
    before[lonely], after[lonely] = _kept_neighbours(A, B, lonely, k)
    return _change(before, after, k)


# ------------------------------------------------------------------------------ against a truth


def aligned_rms(Y: Floats, W: Floats) -> float:
    """Return the root mean square distance of Y from W after the best rigid motion.

    The motion is a proper rotation and a translation (Kabsch 1976), so that a mirrored answer
    scores badly, as it should.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth, row by row the same points, in the same unit.

    Returns
    -------
    float
        In the points' unit.

    Raises
    ------
    InputError
        Unequal shapes, no points, or values that are not finite.

    Examples
    --------
    >>> W = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3]])
    >>> bool(aligned_rms(W @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + 5, W) < 1e-12)
    True
    >>> round(aligned_rms(W * [1, 1, -1], W), 2)
    0.67
    """
    Y, W = _cloud(Y, "Y"), _cloud(W, "W")
    _same_rows(Y, W, "Y and W")
    if not len(Y):
        raise InputError("there are no points to align")
    a, b = Y - Y.mean(axis=0), W - W.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return float(np.sqrt(((a @ (left @ proper @ right) - b) ** 2).sum(axis=1).mean()))


def random_pairs(n: int, count: int = _PAIRS, seed: int = 0) -> Ints:
    """Return `count` random pairs of different row numbers below n >= 2, (count, 2) int."""
    if n < 2:
        raise InputError(f"pairs need at least 2 points, but there are {n}")
    rng = np.random.default_rng(seed)
    first = rng.integers(0, n, count)
    return np.stack([first, (first + rng.integers(1, n, count)) % n], axis=1)


def distance_ratios(A: Floats, B: Floats, pairs: Ints) -> Floats:
    """Return the distance between paired points in B over that in A.

    Over far pairs (`random_pairs`) this sees a fold that near neighbours hide.

    Parameters
    ----------
    A, B : (n, 3) float
        Reference and other cloud, in the same unit.
    pairs : (m, 2) int
        Row numbers.

    Returns
    -------
    (m,) float
        1 where the distance is kept; pairs that coincide in A are left out.

    Raises
    ------
    InputError
        Unequal shapes, or no pair with a distance in A.
    """
    A, B = _cloud(A, "A"), _cloud(B, "B")
    _same_rows(A, B, "A and B")
    before, after = lengths(A, pairs), lengths(B, pairs)
    apart = before > 0
    if not apart.any():
        raise InputError("no pair of points has a distance to compare with")
    return after[apart] / before[apart]


def spacing_ratios(
    Y: Floats, W: Floats, k: int = NEIGHBOURS
) -> tuple[float | None, float | None, float | None]:
    """Return how much the spacing along each axis of the truth was stretched.

    The median, over neighbours in W whose line lies within 18 degrees of the axis, of their
    distance in Y over that in W.  It does not depend on how Y is turned.

    Parameters
    ----------
    Y, W : (n, 3) float
        Answer and truth, in the same unit.
    k : int
        Number of neighbours looked at.

    Returns
    -------
    tuple of 3
        1 where the spacing is true; None for an axis that no neighbours lie along (a body one
        block thick has none across).
    """
    Y, W = _cloud(Y, "Y"), _cloud(W, "W")
    _same_rows(Y, W, "Y and W")
    ids = neighbours(W, k)
    pairs = np.stack([np.repeat(np.arange(len(W)), k), ids.ravel()], axis=1)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    step = W[pairs[:, 1]] - W[pairs[:, 0]]
    along = np.abs(step) > _ALONG * np.linalg.norm(step, axis=1, keepdims=True)

    def median(axis: int) -> float | None:
        chosen = pairs[along[:, axis]]
        return float(np.median(distance_ratios(W, Y, chosen))) if len(chosen) else None

    return median(0), median(1), median(2)


@dataclass(frozen=True)
class TruthQuality:
    """An unfolding compared with the truth, and what doing nothing would have scored.

    Attributes
    ----------
    epsilon_truth : Statistics
        epsilon(W, Y): neighbours of the truth W, kept in the answer Y.
    epsilon_folded : Statistics
        epsilon(X, Y): neighbours of the folded body X; needs no truth, and 0 for doing nothing.
    epsilon_nothing : Statistics
        epsilon(W, X): the score of leaving the body folded.
    rms, rms_nothing : float
        Root mean square distance of Y, and of X, from W after the best proper rotation.
    spacing : tuple of 3 float or None
        See `spacing_ratios`.
    distances : Statistics
        |ratio - 1| of distances between far points, answer over truth.
    distances_nothing : Statistics
        The same for the folded body.
    """

    epsilon_truth: Statistics
    epsilon_folded: Statistics
    epsilon_nothing: Statistics
    rms: float
    rms_nothing: float
    spacing: tuple[float | None, float | None, float | None]
    distances: Statistics
    distances_nothing: Statistics

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain dicts and numbers."""
        return asdict(self)


def compare_with_truth(X: Floats, Y: Floats, W: Floats, k: int = NEIGHBOURS) -> TruthQuality:
    """Compare the unfolded body Y with its truth W, and with the folded body X.

    Parameters
    ----------
    X, Y, W : (n, 3) float
        Folded, unfolded and true points, row by row the same, in the same unit.
    k : int
        Number of neighbours.

    Returns
    -------
    TruthQuality
        Figures of the answer beside those of doing nothing.

    Raises
    ------
    InputError
        Unequal shapes, too few points, values that are not finite.
    """
    far = random_pairs(len(W))
    return TruthQuality(
        epsilon_truth=Statistics.of(epsilon(W, Y, k)),
        epsilon_folded=Statistics.of(epsilon(X, Y, k)),
        epsilon_nothing=Statistics.of(epsilon(W, X, k)),
        rms=aligned_rms(Y, W),
        rms_nothing=aligned_rms(X, W),
        spacing=spacing_ratios(Y, W, k),
        distances=Statistics.of(np.abs(distance_ratios(W, Y, far) - 1)),
        distances_nothing=Statistics.of(np.abs(distance_ratios(W, X, far) - 1)),
    )


# ------------------------------------------------------------------------------------ torn blocks

SUSPECT = 1.0
"""Neighbour distance error from which a block is looked at for being torn from its neighbours.

Measured: at most 0.52 on 28 sound unfoldings whose limbs keep apart.  Where limbs all but touch,
blocks have some of their 26 neighbours on the other limb and go above it, rightly.
"""

TORN = 4.0
"""A block is torn from one that it touches where they come to lie so many times farther apart.

Flexural slip alone draws neighbours apart by up to the change of heading in radians: 2.2 times at
220 degrees between the limbs, 3.3 at a full turn.
"""

_TOUCH = 1.3  # times the distance to the nearest: blocks face to face, not edge to edge (1.41)


def torn_blocks(folded: Floats, unfolded: Floats, sides: Floats | None, suspects: Ints) -> Ints:
    """Return those of some blocks that came to lie far from a block that they touch.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        Blocks in both spaces, the former along the lattice's axes where it has one; same unit.
    sides : (3,) float or None
        Sides of the blocks, in that unit; None where they are not known.
    suspects : (k,) int
        Rows to look at.
    """
    if not len(suspects):
        return suspects
    even = folded if sides is None else folded / sides
    count = min(7, len(even))
    distance, near = cKDTree(even).query(even[suspects], k=count, workers=cores())
    distance, near = np.asarray(distance)[:, 1:], np.asarray(near, dtype=np.int64)[:, 1:]
    touching = distance <= _TOUCH * distance[:, :1]
    before = np.linalg.norm(folded[near] - folded[suspects, None], axis=2)
    after = np.linalg.norm(unfolded[near] - unfolded[suspects, None], axis=2)
    out: Ints = suspects[(touching & (after > TORN * before)).any(axis=1)]
    return out


# ---------------------------------------------------------------------------- of an unfolding


@dataclass(frozen=True, eq=False)
class BlockQuality:
    """Distortion at each block, (n,) each: the columns of the unfolded table.

    Attributes
    ----------
    volume_ratio, stretch_min, stretch_max, shear : (n,) float
        Of the tetrahedron or prism that carried the block, there (see Distortion).
    nmd_error : (n,) float
        epsilon(X, Y) of the block (see `epsilon`).
    """

    volume_ratio: Floats
    nmd_error: Floats
    stretch_min: Floats
    stretch_max: Floats
    shear: Floats

    def columns(self) -> dict[str, Floats]:
        """Return the columns by name, in the order in which tables have them."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def block_quality(
    control: ControlMesh,
    elements: Ints,
    folded: Floats,
    unfolded: Floats,
    k: int = NEIGHBOURS,
    gradients: Floats | None = None,
    lattice: tuple[Ints, Floats] | None = None,
) -> BlockQuality:
    """Return the distortion at each block.

    Parameters
    ----------
    control : ControlMesh
        The map.
    elements : (n,) int
        The tetrahedron that carried each block; -1 for a block without an image, whose figures
        are NaN and which is no other block's neighbour.
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit.
    k : int
        Number of neighbours of epsilon.
    gradients : (p, 3, 3) float, optional
        Deformation gradients at the p blocks that have an image; by default their tetrahedra's.
    lattice : ((n, 3) int, (3,) float), optional
        Lattice cell of each block, and the cells' sides: see `lattice_epsilon`.

    Raises
    ------
    InputError
        Shapes that do not agree, or a row of `elements` that names no tetrahedron.
    ControlMeshError
        A tetrahedron that carries blocks has no volume, or no thickness when unfolded.
    """
    rows = np.asarray(elements)
    count = len(control.folded.T)
    if rows.shape != (len(folded),):
        raise InputError(f"elements must have shape ({len(folded)},), but have {rows.shape}")
    if rows.size and not -1 <= rows.min() <= rows.max() < count:
        raise InputError(
            f"elements name {rows.min()}..{rows.max()}, but there are {count} tetrahedra"
        )
    placed = rows >= 0
    some = slice(None) if placed.all() else placed
    X, Y = folded[some], unfolded[some]
    error = (
        epsilon(X, Y, k)
        if lattice is None
        else lattice_epsilon(X, Y, lattice[0][some], lattice[1], k)
    )
    if gradients is None:
        used = np.flatnonzero(np.bincount(rows[some], minlength=count))
        number = np.zeros(count, dtype=np.int64)
        number[used] = np.arange(len(used))
        back = number[rows[some]]
        d = distortion(deformation_gradients(control, used))
    else:
        d, back = distortion(gradients), np.arange(len(gradients))

    def spread(values: Floats) -> Floats:
        out = np.full(len(rows), np.nan)
        out[some] = values
        return out

    return BlockQuality(
        volume_ratio=spread(d.volume_ratio[back]),
        nmd_error=spread(error),
        stretch_min=spread(d.stretch_min[back]),
        stretch_max=spread(d.stretch_max[back]),
        shear=spread(d.shear[back]),
    )


@dataclass(frozen=True, eq=False)
class Quality:
    """How good an unfolding is, without a truth.

    Attributes
    ----------
    blocks : BlockQuality
        Distortion at each block.
    nmd : Statistics
        epsilon(X, Y) over the blocks; doing nothing scores 0.
    shear : Statistics
        Layer-parallel shear over the blocks.
    volume_change : Statistics
        |volume_ratio - 1| over the blocks.
    edge_change : Statistics
        |relative change of length| over the control mesh's edges.
    volume_folded, volume_unfolded : float
        Signed volume of the control mesh in both spaces.
    inverted_folded, inverted_unfolded : int
        Tetrahedra whose volume is not positive; for a map without a control mesh, blocks whose
        neighbours' images are turned inside out.
    """

    blocks: BlockQuality
    nmd: Statistics
    shear: Statistics
    volume_change: Statistics
    edge_change: Statistics
    volume_folded: float
    volume_unfolded: float
    inverted_folded: int
    inverted_unfolded: int

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain dicts and numbers, without the blocks' columns.

        ``nmd`` also tells over how many blocks it is taken (``sample``): all that have an image,
        so that its mean has no ``standard_error`` of sampling.
        """
        out = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "blocks"}
        plain = {k: asdict(v) if isinstance(v, Statistics) else v for k, v in out.items()}
        plain["nmd"] |= {
            "sample": int(np.isfinite(self.blocks.nmd_error).sum()),
            "standard_error": 0.0,
        }
        return plain


def assess(
    control: ControlMesh,
    whole: ControlMesh,
    elements: Ints,
    folded: Floats,
    unfolded: Floats,
    k: int = NEIGHBOURS,
    gradients: Floats | None = None,
    lattice: tuple[Ints, Floats] | None = None,
) -> Quality:
    """Return the quality of an unfolding, over the blocks that have an image.

    Parameters
    ----------
    control : ControlMesh
        The body's tetrahedra.
    whole : ControlMesh
        Those and the shell around them, which ``elements`` name.
    elements, folded, unfolded, k, gradients, lattice
        As for `block_quality`, errors too.
    """
    blocks = block_quality(whole, elements, folded, unfolded, k, gradients, lattice)
    placed = np.asarray(elements) >= 0
    before = tet_volumes(control.folded.V, control.folded.T)
    after = tet_volumes(control.unfolded.V, control.unfolded.T)
    return Quality(
        blocks=blocks,
        nmd=Statistics.of(blocks.nmd_error[placed]),
        shear=Statistics.of(blocks.shear[placed]),
        volume_change=Statistics.of(np.abs(blocks.volume_ratio[placed] - 1)),
        edge_change=Statistics.of(np.abs(edge_change(control.folded, control.unfolded))),
        volume_folded=float(before.sum()),
        volume_unfolded=float(after.sum()),
        inverted_folded=int(np.count_nonzero(before <= 0)),
        inverted_unfolded=int(np.count_nonzero(after <= 0)),
    )


def assess_points(folded: Floats, unfolded: Floats, volume: float, k: int = NEIGHBOURS) -> Quality:
    """Return the quality of an unfolding without a control mesh, by each block's neighbours.

    The deformation gradient at a block is the linear map that takes the offsets of its k
    neighbours nearest to their images, in the least squares.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit; those without an image are NaN when unfolded,
        have NaN figures and are no other block's neighbours.
    volume : float
        Of one block.
    k : int
        Number of neighbours.

    Raises
    ------
    InputError
        Too few points with an image.
    ControlMeshError
        Neighbours that lie in one plane across the layers when unfolded.
    """
    placed = np.isfinite(unfolded).all(axis=1)
    X, Y = folded[placed], unfolded[placed]
    ids = neighbours(X, k)
    d = distortion(neighbour_gradients(X, Y, ids))
    pairs = np.stack([np.repeat(np.arange(len(X)), _SIDES), ids[:, :_SIDES].ravel()], axis=1)

    def spread(values: Floats) -> Floats:
        out = np.full(len(folded), np.nan)
        out[placed] = values
        return out

    changed = epsilon(X, Y, k)
    return Quality(
        blocks=BlockQuality(
            volume_ratio=spread(d.volume_ratio),
            nmd_error=spread(changed),
            stretch_min=spread(d.stretch_min),
            stretch_max=spread(d.stretch_max),
            shear=spread(d.shear),
        ),
        nmd=Statistics.of(changed),
        shear=Statistics.of(d.shear),
        volume_change=Statistics.of(np.abs(d.volume_ratio - 1)),
        edge_change=Statistics.of(np.abs(distance_ratios(X, Y, pairs) - 1)),
        volume_folded=volume * len(X),
        volume_unfolded=float(volume * d.volume_ratio.sum()),
        inverted_folded=0,
        inverted_unfolded=int(np.count_nonzero(d.volume_ratio <= 0)),
    )


def neighbour_gradients(X: Floats, Y: Floats, ids: Ints) -> Floats:
    """Return the linear map (n, 3, 3) of each point's neighbourhood, in the least squares.

    Where the neighbours lie in a plane, the plane's normal is taken to its image's unit normal.

    Parameters
    ----------
    X, Y : (n, 3) float
        Points in both spaces.
    ids : (n, k) int
        Each point's neighbours.
    """
    C, D = np.empty((len(X), 3, 3)), np.empty((len(X), 3, 3))
    for start in range(0, len(X), _CACHED):
        rows = slice(start, start + _CACHED)
        a, b = X[ids[rows]] - X[rows, None], Y[ids[rows]] - Y[rows, None]
        C[rows] = np.einsum("nki,nkj->nij", a, a)
        D[rows] = np.einsum("nki,nkj->nij", b, a)
    value, axes = np.linalg.eigh(C)
    flat = value[:, 0] < _PLANE * value[:, 2]
    inverse = np.where(flat, 0.0, 1 / np.where(flat, 1.0, value[:, 0]))
    weights = np.column_stack([inverse, 1 / value[:, 1:]])
    J: Floats = D @ np.einsum("nik,nk,njk->nij", axes, weights, axes)
    if flat.any():
        e, part = axes[flat], J[flat]
        normal = np.cross(e[:, :, 1], e[:, :, 2])
        image = np.cross(
            np.einsum("nij,nj->ni", part, e[:, :, 1]), np.einsum("nij,nj->ni", part, e[:, :, 2])
        )
        image /= np.linalg.norm(image, axis=1, keepdims=True)
        J[flat] = part + image[:, :, None] * normal[:, None, :]
    return J
