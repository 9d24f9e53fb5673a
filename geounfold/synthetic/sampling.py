"""Blocks of a simulated body, gridded before or after folding."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geounfold.errors import OptionError
from geounfold.mesh import Floats, Ints
from geounfold.synthetic.body import Body, FoldSpec, Sheet

_CHUNK = 400_000  # candidates handled at a time: bounds the memory beside the result


def sample(name: str, spec: FoldSpec) -> Body:
    """Return a body's blocks, lattice order: x slowest, z fastest.

    Raises
    ------
    OptionError
        No block fits in the body, or the body is geometrically impossible (see Sheet).
    """
    sheet = Sheet(spec)
    chunks = _before(sheet) if spec.grid == "before" else _after(sheet)
    pairs = list(chunks)
    if not sum(len(truth) for _, truth in pairs):
        raise OptionError(f"no block of {name} lies in the body; make steps smaller")
    folded = np.concatenate([pair[0] for pair in pairs])
    truth = np.concatenate([pair[1] for pair in pairs])
    del pairs
    folded, truth = _damage(sheet, folded, truth)
    bottom, top = sheet.heights(truth[:, 0], truth[:, 1])
    return Body(name, folded, truth, bottom, top, np.array(spec.steps, float), sheet)


def _damage(sheet: Sheet, folded: Floats, truth: Floats) -> tuple[Floats, Floats]:
    """Return the blocks after some are lost and the others' centroids disturbed."""
    spec = sheet.spec
    rng = np.random.default_rng(spec.seed)
    if spec.missing:
        kept = rng.random(len(truth)) >= spec.missing
        folded, truth = folded[kept], truth[kept]
    if spec.noise:
        sides = spec.noise * np.array(spec.steps)
        folded = folded + (rng.standard_normal(folded.shape) * sides) @ sheet.lattice_axes
    return folded, truth


def _slabs(counts: tuple[int, int, int]) -> Iterator[tuple[int, int]]:
    """Return ranges of the first index that hold about _CHUNK lattice points each."""
    rows = max(1, _CHUNK // max(1, counts[1] * counts[2]))
    return ((i, min(i + rows, counts[0])) for i in range(0, counts[0], rows))


def _before(sheet: Sheet) -> Iterator[tuple[Floats, Floats]]:
    """Yield folded and true points of a grid that is regular before folding."""
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
        yield sheet.to_world(sheet.refold(local)), truth[kept]


def _indices(*counts: int) -> tuple[Ints, ...]:
    """Return lattice indices of a slab, the last fastest."""
    return tuple(g.ravel() for g in np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"))


def _after(sheet: Sheet) -> Iterator[tuple[Floats, Floats]]:
    """Yield folded and true points of a lattice that is regular after folding."""
    spec = sheet.spec
    turn = sheet.lattice_axes @ sheet.axes.T  # rows: lattice axes in the fold's own frame
    if spec.lattice_bearing == spec.azimuth and spec.lattice_plunge == spec.plunge:
        turn[1], turn[:, 1] = (0, 1, 0), (0, 1, 0)
    steps = np.array(spec.steps, float)
    box = sheet.fold_local(sheet.boundary()) @ turn.T / steps
    first = np.floor(box.min(axis=0)).astype(int) - 1
    counts = tuple((np.ceil(box.max(axis=0)).astype(int) + 1 - first).tolist())
    axes = [(np.arange(n) + f + 0.5) * h for n, f, h in zip(counts, first, steps, strict=True)]
    along = turn[1, 1] == 1 and spec.refold is None
    for i, j, k, truth in (_columns if along else _points)(sheet, axes, turn):
        kept = sheet.inside(truth)
        lattice = np.stack([axes[0][i[kept]], axes[1][j[kept]], axes[2][k[kept]]], axis=1)
        yield lattice @ sheet.lattice_axes + np.asarray(spec.offset, float), truth[kept]


_Candidates = Iterator[tuple[Ints, Ints, Ints, Floats]]


def _columns(sheet: Sheet, axes: list[Floats], turn: Floats) -> _Candidates:
    """Yield lattice indices and truths where one lattice axis is the fold axis: 2-D work."""
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
