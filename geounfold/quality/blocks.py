"""Distortion of each block, and statistics of it over an unfolding."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import Floats, Ints
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.distortion import deformation_gradients, distortion, edge_change
from geounfold.quality.neighbour_distances import (
    CACHED,
    NEIGHBOURS,
    epsilon,
    lattice_epsilon,
    neighbours,
)
from geounfold.quality.statistics import Statistics
from geounfold.quality.truth import distance_ratios

_SIDES = 6  # neighbours that share a face with a block of a lattice
_PLANE = 1e-9  # share of the largest variance below which neighbours count as lying in a plane


@dataclass(frozen=True, eq=False)
class BlockQuality:
    """Distortion at each block: columns of the unfolded table.

    Attributes
    ----------
    volume_ratio, stretch_min, stretch_max, shear : (n,) float
        Of the deformation at the block (`mapping.distortion.Distortion`).
    nmd_error : (n,) float
        epsilon(X, Y) of the block (`epsilon`).
    """

    volume_ratio: Floats
    nmd_error: Floats
    stretch_min: Floats
    stretch_max: Floats
    shear: Floats

    def columns(self) -> dict[str, Floats]:
        """Return the columns by name, in the order of the table."""
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
        The tetrahedron that maps each block; -1 for a block without an image.  Such a block has
        NaN figures and is not counted as a neighbour.
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit.
    k : int
        Number of neighbours for epsilon.
    gradients : (p, 3, 3) float, optional
        Deformation gradients at the p blocks that have an image; by default their tetrahedra's.
    lattice : ((n, 3) int, (3,) float), optional
        Lattice cell of each block and the cells' sides, for `lattice_epsilon`.

    Raises
    ------
    InputError
        Shapes do not agree, or `elements` holds a number that is not a tetrahedron's.
    ControlMeshError
        A tetrahedron that maps blocks has no volume, or no thickness when unfolded.
    """
    rows = np.asarray(elements)
    count = len(control.folded.T)
    if rows.shape != (len(folded),):
        raise InputError(f"elements must have shape ({len(folded)},), but have {rows.shape}")
    if rows.size and not -1 <= rows.min() <= rows.max() < count:
        raise InputError(
            f"elements must be -1 to {count - 1}, but are {rows.min()} to {rows.max()}"
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
    """Quality of an unfolding, measured without a truth.

    Attributes
    ----------
    blocks : BlockQuality
        Distortion at each block.
    nmd : Statistics
        epsilon(X, Y) over the blocks; 0 for the folded body itself.
    shear : Statistics
        Layer-parallel shear over the blocks.
    volume_change : Statistics
        |volume_ratio - 1| over the blocks.
    edge_change : Statistics
        |relative change of length| over the control mesh's edges.
    volume_folded, volume_unfolded : float
        Signed volume of the control mesh in both spaces. The mesh reaches past the blocks: this
        is not the body's volume.
    inverted_folded, inverted_unfolded : int
        Tetrahedra whose volume is not positive.  For a map without a control mesh: 0, and the
        number of blocks whose deformation gradient has a determinant that is not positive.
    sample : int or None
        Number of blocks that ``nmd`` is taken over, if ``blocks`` holds none.
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
    sample: int | None = None

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain dicts and numbers, without the columns of blocks.

        ``nmd`` also has the number of blocks it is taken over (``sample``).  These are all blocks
        with an image, so the sampling error of its mean (``standard_error``) is 0.
        """
        own = [name for name in self.__dataclass_fields__ if name not in ("blocks", "sample")]
        out = {name: getattr(self, name) for name in own}
        plain = {k: asdict(v) if isinstance(v, Statistics) else v for k, v in out.items()}
        plain["nmd"] |= {
            "sample": self.sample or int(np.isfinite(self.blocks.nmd_error).sum()),
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
        The body's tetrahedra and the shell around them; ``elements`` are numbers of these.
    elements, folded, unfolded, k, gradients, lattice
        As for `block_quality`.

    Raises
    ------
    InputError, ControlMeshError
        As for `block_quality`.
    """
    blocks = block_quality(whole, elements, folded, unfolded, k, gradients, lattice)
    placed = np.asarray(elements) >= 0
    over_blocks = (
        Statistics.of(blocks.nmd_error[placed]),
        Statistics.of(blocks.shear[placed]),
        Statistics.of(np.abs(blocks.volume_ratio[placed] - 1)),
    )
    return of_mesh(control, blocks, over_blocks)


def of_mesh(
    control: ControlMesh,
    blocks: BlockQuality,
    over_blocks: tuple[Statistics, Statistics, Statistics],
    sample: int | None = None,
) -> Quality:
    """Return the quality of an unfolding from that of its blocks, and its control mesh.

    Parameters
    ----------
    control : ControlMesh
        The body's tetrahedra.
    blocks : BlockQuality
        That of each block.
    over_blocks : three Statistics
        ``nmd``, ``shear`` and ``volume_change``.
    sample : int, optional
        As the attribute.
    """
    nmd, shear, volume_change = over_blocks
    before = tet_volumes(control.folded.V, control.folded.T)
    after = tet_volumes(control.unfolded.V, control.unfolded.T)
    return Quality(
        blocks=blocks,
        nmd=nmd,
        shear=shear,
        volume_change=volume_change,
        edge_change=Statistics.of(np.abs(edge_change(control.folded, control.unfolded))),
        volume_folded=float(before.sum()),
        volume_unfolded=float(after.sum()),
        inverted_folded=int(np.count_nonzero(before <= 0)),
        inverted_unfolded=int(np.count_nonzero(after <= 0)),
        sample=sample,
    )


def assess_points(folded: Floats, unfolded: Floats, volume: float, k: int = NEIGHBOURS) -> Quality:
    """Return the quality of an unfolding without a control mesh, from each block's neighbours.

    The deformation gradient at a block is the least-squares linear map from the offsets of its k
    neighbours to the offsets of their images.

    Parameters
    ----------
    folded, unfolded : (n, 3) float
        The blocks in both spaces, in the same unit.  A block without an image is NaN when
        unfolded, has NaN figures and is not counted as a neighbour.
    volume : float
        Volume of a block.
    k : int
        Number of neighbours.

    Raises
    ------
    InputError
        There are too few points with an image.
    ControlMeshError
        A block's neighbours lie in one plane across the layers when unfolded.
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
    """Return the least-squares linear map of each point's neighbourhood, (n, 3, 3).

    If a point's neighbours lie in a plane, the map takes the plane's unit normal to the unit
    normal of its image.

    Parameters
    ----------
    X, Y : (n, 3) float
        Points in both spaces.
    ids : (n, k) int
        Rows of each point's neighbours.
    """
    C, D = np.empty((len(X), 3, 3)), np.empty((len(X), 3, 3))
    for start in range(0, len(X), CACHED):
        rows = slice(start, start + CACHED)
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
