"""Blocks of a simulated body, gridded before or after folding, or scattered."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.synthetic.body import Body, Sheet
from geounfold.synthetic.fold_spec import FoldSpec, volume

_CHUNK = 400_000  # candidates handled at a time: bounds the memory beside the result


class _Blocks(NamedTuple):
    """Blocks of a body: folded and true centroids, and sides, (n, 3) each."""

    folded: Floats
    truth: Floats
    sizes: Floats

    def take(self, rows: Bools | Ints) -> _Blocks:
        return _Blocks(*(part[rows] for part in self))


def sample(name: str, spec: FoldSpec) -> Body:
    """Return a body made of blocks.

    Blocks of a lattice are in its order, x slowest and z fastest. Sub-blocks are in the order of
    their centroids, scattered points in none.

    Parameters
    ----------
    name : str
        The body's name.
    spec : FoldSpec
        The body's recipe.

    Raises
    ------
    OptionError
        No block fits in the body, or the body is geometrically impossible (see Sheet).
    """
    sheet = Sheet(spec)
    make = {"before": _before, "after": _after, "scattered": _scattered}[spec.grid]
    chunks = list((_sub_blocked if spec.sub_blocks > 1 else make)(sheet))
    if not sum(len(chunk.truth) for chunk in chunks):
        raise OptionError(f"no block of {name} lies in the body; make steps smaller")
    blocks = _Blocks(*(np.concatenate(parts) for parts in zip(*chunks, strict=True)))
    del chunks
    folded, truth, sizes = _damage(sheet, blocks)
    bottom, top = sheet.heights(truth[:, 0], truth[:, 1])
    return Body(name, folded, truth, bottom, top, np.array(spec.steps, float), sizes, sheet)


def _damage(sheet: Sheet, blocks: _Blocks) -> _Blocks:
    """Return the blocks without the missing ones, and with noise added to the centroids."""
    spec = sheet.spec
    rng = np.random.default_rng(spec.seed)
    if spec.missing:
        blocks = blocks.take(rng.random(len(blocks.truth)) >= spec.missing)
    if spec.noise:
        shifts = rng.standard_normal(blocks.folded.shape) * (spec.noise * blocks.sizes)
        blocks = blocks._replace(folded=blocks.folded + shifts @ sheet.lattice_axes)
    return blocks


def _same(spec: FoldSpec, folded: Floats, truth: Floats) -> _Blocks:
    """Return blocks of equal sides, the recipe's ``steps``."""
    return _Blocks(folded, truth, np.broadcast_to(np.array(spec.steps, float), truth.shape))


def _scattered(sheet: Sheet) -> Iterator[_Blocks]:
    """Yield random points, one per volume of a block, denser in two corners of the sheet.

    Folding keeps volumes, so it does not change the density of points.
    """
    spec = sheet.spec
    rng = np.random.default_rng([spec.seed, 1])
    wanted = round(volume(spec) / float(np.prod(spec.steps)))
    reach = spec.shape.reach()
    for _ in range(1000):
        if not wanted:
            return
        a, b, c, chance = rng.random((4, 4 * wanted + 1000))
        truth = np.stack([a * spec.length, b * spec.width, (2 * c - 1) * reach], axis=1)
        share = (1 + np.sin(2 * np.pi * a) * np.cos(np.pi * b)) / 2  # 0 sparse, 1 dense
        kept = sheet.inside(truth) & (chance <= spec.density ** (share - 1))
        truth = truth[kept][:wanted]
        wanted -= len(truth)
        yield _same(spec, sheet.fold(truth), truth)
    raise OptionError("the body fills too little of its length and width to scatter points in it")


def _slabs(counts: tuple[int, int, int]) -> Iterator[tuple[int, int]]:
    """Return ranges of the first index that hold about _CHUNK lattice points each."""
    rows = max(1, _CHUNK // max(1, counts[1] * counts[2]))
    return ((i, min(i + rows, counts[0])) for i in range(0, counts[0], rows))


def _before(sheet: Sheet) -> Iterator[_Blocks]:
    """Yield blocks of a grid that is regular before folding."""
    spec = sheet.spec
    extents = (spec.length, spec.width, 2 * spec.shape.reach())
    nu, nv, nw = (int(x / h + 1e-9) for x, h in zip(extents, spec.steps, strict=True))
    u = (np.arange(nu) + 0.5) * spec.steps[0]
    v = (np.arange(nv) + 0.5) * spec.steps[1]
    w = (np.arange(max(1, nw)) - (max(1, nw) - 1) / 2) * spec.steps[2]
    section = sheet.slip.fold(np.repeat(u, len(w)), np.tile(w, nu)).reshape(nu, len(w), 2)
    for lo, hi in _slabs((nu, nv, len(w))):
        i, j, k = _indices(hi - lo, nv, len(w))
        truth = np.stack([u[lo + i], v[j], w[k]], axis=1)
        kept = sheet.inside(truth)
        x, z = section[lo + i[kept], k[kept]].T
        local = np.stack([x, truth[kept, 1], z], axis=1)
        yield _same(spec, sheet.to_world(sheet.refold(local)), truth[kept])


def _indices(*counts: int) -> tuple[Ints, ...]:
    """Return lattice indices of a slab, the last fastest."""
    return tuple(g.ravel() for g in np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"))


def _after(sheet: Sheet) -> Iterator[_Blocks]:
    """Yield blocks of a lattice that is regular after folding."""
    steps = np.array(sheet.spec.steps, float)
    for cells, truth in _inside(sheet, steps):
        yield _same(sheet.spec, _centroids(sheet, cells, steps), truth)


def _sub_blocked(sheet: Sheet) -> Iterator[_Blocks]:
    """Yield parent blocks that lie wholly in the body, and smaller blocks near its surface.

    A block lies in the body if its middle and those of all smallest blocks in it do.
    """
    spec = sheet.spec
    steps = np.array(spec.steps, float)
    fine = steps / spec.sub_blocks
    cells, truth = (np.concatenate(part) for part in zip(*_inside(sheet, fine), strict=True))
    found = []
    side = spec.sub_blocks
    while side > 1:
        blocks, group, count = _grouped(cells // side)
        centroids = _centroids(sheet, blocks, fine * side)
        middles, whole = sheet.unfold(centroids)
        whole &= (count == side**3) & sheet.inside(middles)
        sizes = np.broadcast_to(fine * side, (len(blocks), 3))
        found.append(_Blocks(centroids, middles, sizes).take(whole))
        left = ~whole[group]
        cells, truth = cells[left], truth[left]
        side //= 2
    sizes = np.broadcast_to(fine, (len(cells), 3))
    found.append(_Blocks(_centroids(sheet, cells, fine), truth, sizes))
    out = _Blocks(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
    place = np.rint((out.folded - spec.offset) @ sheet.lattice_axes.T / fine * 2)
    yield out.take(np.lexsort(place.T[::-1]))


def _grouped(cells: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the distinct rows of cells (n, 3), each row's index among them, and their counts."""
    low = cells.min(axis=0, initial=0)
    shape = tuple((cells.max(axis=0, initial=0) - low + 1).tolist())
    keys, group, count = np.unique(
        np.ravel_multi_index(tuple((cells - low).T), shape), return_inverse=True, return_counts=True
    )
    return np.stack(np.unravel_index(keys, shape), axis=1) + low, group, count


def _centroids(sheet: Sheet, cells: Ints, steps: Floats) -> Floats:
    """Return world coordinates (n, 3) of the middles of lattice cells (n, 3)."""
    out: Floats = (cells + 0.5) * steps @ sheet.lattice_axes + np.asarray(sheet.spec.offset, float)
    return out


def _inside(sheet: Sheet, steps: Floats) -> Iterator[tuple[Ints, Floats]]:
    """Yield the cells (n, 3) of a lattice whose middles lie in the body, and their truth."""
    spec = sheet.spec
    turn = sheet.lattice_axes @ sheet.axes.T  # rows: lattice axes in the fold's own frame
    if spec.lattice_bearing == spec.azimuth and spec.lattice_plunge == spec.plunge:
        turn[1], turn[:, 1] = (0, 1, 0), (0, 1, 0)
    box = sheet.fold_local(sheet.boundary()) @ turn.T / steps
    first = np.floor(box.min(axis=0)).astype(int) - 1
    counts = tuple((np.ceil(box.max(axis=0)).astype(int) + 1 - first).tolist())
    axes = [(np.arange(n) + f + 0.5) * h for n, f, h in zip(counts, first, steps, strict=True)]
    along = turn[1, 1] == 1 and spec.refold is None
    for i, j, k, truth in (_columns if along else _points)(sheet, axes, turn):
        kept = sheet.inside(truth)
        yield np.stack([i[kept], j[kept], k[kept]], axis=1) + first, truth[kept]


_Candidates = Iterator[tuple[Ints, Ints, Ints, Floats]]


def _columns(sheet: Sheet, axes: list[Floats], turn: Floats) -> _Candidates:
    """Yield lattice indices and truths, computed in 2-D because a lattice axis is the fold axis."""
    x, y, z = axes
    xz = x[:, None, None] * turn[0, [0, 2]] + z[:, None] * turn[2, [0, 2]]
    uw, found = sheet.slip.unfold(xz.reshape(-1, 2))
    uw, found = uw.reshape(len(x), len(z), 2), found.reshape(len(x), len(z))
    rows = np.flatnonzero((y >= 0) & (y <= sheet.spec.width))
    for lo, hi in _slabs((len(x), len(rows), len(z))):
        hit = np.broadcast_to(found[lo:hi, None], (hi - lo, len(rows), len(z)))
        i, j, k = np.nonzero(hit)
        i, j = i + lo, rows[j]
        yield i, j, k, np.stack([uw[i, k, 0], y[j], uw[i, k, 1]], axis=1)


def _points(sheet: Sheet, axes: list[Floats], turn: Floats) -> _Candidates:
    """Yield lattice indices and truths of any lattice, point by point."""
    x, y, z = axes
    for lo, hi in _slabs((len(x), len(y), len(z))):
        i, j, k = _indices(hi - lo, len(y), len(z))
        local = np.stack([x[lo + i], y[j], z[k]], axis=1) @ turn
        if sheet.spec.refold is None:
            near = (local[:, 1] >= 0) & (local[:, 1] <= sheet.spec.width)
            i, j, k, local = i[near], j[near], k[near], local[near]
        truth, found = sheet.unfold_local(local)
        yield lo + i[found], j[found], k[found], truth[found]
