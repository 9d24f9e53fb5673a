"""Blocks of a faulted body: a lattice laid over the final body, sub-blocks, or random points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.synthetic.faulted.body import FaultedBody
from geounfold.synthetic.faulted.recipe import FaultedSpec, blocks_of
from geounfold.synthetic.faulted.surfaces import fault_surface

_SLAB = 400_000  # candidates handled at a time: bounds the memory beside the result
_SPARE = 2  # blocks around the body's samples


class _Blocks(NamedTuple):
    """Final places without offset, flat places, sides of the faults, and block sides."""

    folded: Floats
    truth: Floats
    sides: Bools
    sizes: Floats

    def take(self, rows: Bools | Ints) -> _Blocks:
        return _Blocks(self.folded[rows], self.truth[rows], self.sides[rows], self.sizes[rows])


def _joined(parts: list[_Blocks]) -> _Blocks:
    return _Blocks(
        np.concatenate([part.folded for part in parts]),
        np.concatenate([part.truth for part in parts]),
        np.concatenate([part.sides for part in parts]),
        np.concatenate([part.sizes for part in parts]),
    )


def sample(name: str, spec: FaultedSpec) -> FaultedBody:
    """Return the body of a recipe; equal recipes give equal bodies, bit for bit.

    Blocks are in the order of the lattice, z fastest.

    Raises
    ------
    OptionError
        No block lies in the body.
    """
    if spec.grid == "scattered":
        blocks = _scattered(spec)
    elif spec.sub_blocks > 1:
        blocks = _sub_blocked(spec)
    else:
        blocks = _lattice(spec, np.array(spec.steps, float))[1]
    if not len(blocks.folded):
        raise OptionError(f"no block of {name} lies in the body; make steps smaller")
    offset = np.array(spec.offset, float)
    fault_block, sides = _by_size(blocks.sides)
    surfaces, slips = {}, {}
    for k, fault in spec.faults_by_index.items():
        surfaces[fault.name], slips[fault.name] = fault_surface(spec, k, blocks.folded, sides)
    return FaultedBody(
        name=name,
        folded=blocks.folded + offset,
        truth=blocks.truth,
        fault_block=fault_block,
        sizes=blocks.sizes,
        surfaces=surfaces,
        slips=slips,
        spec=spec,
    )


def _by_size(sides: Bools) -> tuple[Ints, Bools]:
    """Return fault blocks (n,) of equal sides (n, faults), 0 for the largest, and their sides."""
    found, block, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    rank = np.empty(len(count), np.int64)
    rank[order] = np.arange(len(count))
    return rank[block.ravel()], found[order]


def _box(spec: FaultedSpec) -> tuple[Floats, Floats]:
    """Return corners, in the lattice's axes, of a box around the final body."""
    share = np.linspace(-0.1, 1.1, 60)  # a wandering outline leaves the rectangle
    u, v, side = (g.ravel() for g in np.meshgrid(share, share, [-1.0, 0.0, 1.0], indexing="ij"))
    u, v = u * spec.length, v * spec.width
    kept = spec.in_outline(u, v)
    W = np.stack([u, v, side * spec.half_thickness(u, v)], axis=1)[kept]
    X = spec.forward(W)[0] @ spec.lattice_axes.T
    return X.min(axis=0), X.max(axis=0)


def _lattice(spec: FaultedSpec, steps: Floats) -> tuple[Ints, _Blocks]:
    """Return cells (n, 3) of a lattice whose middles lie in the body, and their blocks."""
    low, high = _box(spec)
    spare = _SPARE * np.array(spec.steps, float)
    first = np.floor((low - spare) / steps).astype(int)
    counts = np.ceil((high + spare) / steps).astype(int) - first
    names = [fault.name for fault in spec.faults]
    rows = max(1, _SLAB // int(counts[1] * counts[2]))
    cells, parts = [], []
    for start in range(0, int(counts[0]), rows):
        shape = (min(rows, int(counts[0]) - start), int(counts[1]), int(counts[2]))
        cell = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape), axis=1)
        cell = cell + first + [start, 0, 0]
        block = _read(spec, (cell + 0.5) * steps @ spec.lattice_axes, steps, names)
        cells.append(cell[block[1]])
        parts.append(block[0])
    return np.concatenate(cells), _joined(parts)


def _read(spec: FaultedSpec, X: Floats, sizes: Floats, names: list[str]) -> tuple[_Blocks, Bools]:
    """Return the blocks among final points (n, 3), and which points they are, (n,)."""
    W, kept, sides = spec.back(X)
    kept = kept & spec.holds(W) & spec.in_model(X)
    blocks = _Blocks(X, W, blocks_of(sides, names), np.broadcast_to(sizes, X.shape))
    return blocks.take(kept), kept


def _sub_blocked(spec: FaultedSpec) -> _Blocks:
    """Return whole blocks, and sub-blocks where a limit of the body or a fault cuts a block."""
    n = spec.sub_blocks
    fine = np.array(spec.steps, float) / n
    cells, small = _lattice(spec, fine)
    parents = cells // n
    low = parents.min(axis=0)
    shape = tuple((parents.max(axis=0) - low + 1).tolist())
    keys = np.ravel_multi_index(tuple((parents - low).T), shape)
    found, group, count = np.unique(keys, return_inverse=True, return_counts=True)
    block, _ = _by_size(small.sides)
    mixed = np.zeros(len(found), bool)
    first = np.full(len(found), -1)
    first[group] = block  # one of the parent's sub-blocks
    mixed[group[block != first[group]]] = True
    place = np.stack(np.unravel_index(found, shape), axis=1) + low
    names = [fault.name for fault in spec.faults]
    middles = (place + 0.5) * np.array(spec.steps) @ spec.lattice_axes
    whole, kept = _read(spec, middles, np.array(spec.steps, float), names)
    good = (count == n**3) & ~mixed & kept
    joined = _joined([whole.take(good[kept]), small.take(~good[group])])
    order = np.rint(joined.folded @ spec.lattice_axes.T / fine * 2).astype(np.int64)
    return joined.take(np.lexsort(order.T[::-1]))


def _scattered(spec: FaultedSpec) -> _Blocks:
    """Return random points, one per volume of a block; folds and faults keep volumes."""
    low = np.array([-0.1 * spec.length, -0.1 * spec.width, -spec.thickness])
    extent = np.array([1.2 * spec.length, 1.2 * spec.width, 2 * spec.thickness])
    rng = np.random.default_rng([spec.seed, 2])
    W = low + extent * rng.random((round(float(np.prod(extent)) / spec.step**3), 3))
    W = W[spec.holds(W)]
    X, sides = spec.forward(W)
    names = [fault.name for fault in spec.faults]
    sizes = np.broadcast_to(np.array(spec.steps, float), X.shape)
    return _Blocks(X, W, blocks_of(sides, names), sizes).take(spec.in_model(X))
