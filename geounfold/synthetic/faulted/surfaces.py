"""Surfaces of faults in final space, bent and torn by later events, and the true slip on them."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.synthetic.faulted.body import Surface, TrueSlip
from geounfold.synthetic.faulted.events import Fault, FoldEvent, TipFault
from geounfold.synthetic.faulted.recipe import FaultedSpec, Sides, blocks_of

_SIDE = 0.8  # of a triangle, in blocks
_PAST = 9.0  # blocks by which a surface reaches past the body
_NEAR = 12.0  # blocks from the surface: the part of the body that sets its extent


def fault_surface(spec: FaultedSpec, k: int, X: Floats, sides: Bools) -> tuple[Surface, TrueSlip]:
    """Return a fault's surface in final space and the slip at its vertices.

    Parameters
    ----------
    spec : FaultedSpec
        The recipe.
    k : int
        Index of the fault among the events.
    X : (n, 3) float
        Blocks in final space, without offset.
    sides : (fault blocks, faults) bool
        Sides of the faults on which each fault block lies.
    """
    fault = spec.faults_by_index[k]
    V, F = _grid(fault, *_extent(spec, k, fault, X), _SIDE * spec.step)
    if fault.within:
        F = F[spec.exists(k, V)[F].all(axis=1)]
    slip = _true_slip(spec, k, fault, V, sides)
    for j in range(k + 1, len(spec.events)):
        V, F = _through(spec, j, V, F)
    V, F = _compact(V, F)
    return (V + np.array(spec.offset, float), F), slip


def _extent(spec: FaultedSpec, k: int, fault: Fault, X: Floats) -> tuple[Floats, Floats]:
    """Return lowest and highest places along strike and down dip that the surface covers."""
    P, reached, _ = spec.back(X[:: max(1, len(X) // 4000)], stop=k + 1)
    place = fault.coordinates(P[reached])
    place = place[np.abs(place[:, 2]) < _NEAR * spec.step, :2]
    past = _PAST * spec.step
    low, high = place.min(axis=0) - past, place.max(axis=0) + past
    if isinstance(fault, TipFault):
        high[0] = min(high[0], fault.tip)
    return low, high


def _grid(fault: Fault, low: Floats, high: Floats, side: float) -> Surface:
    """Return the surface at the time of the fault; normals point into the hanging wall."""
    count = np.maximum(np.ceil((high - low) / side).astype(int) + 1, 2)
    a, b = (np.linspace(x, y, int(n)) for x, y, n in zip(low, high, count, strict=True))
    along, down = (g.ravel() for g in np.meshgrid(a, b, indexing="ij"))
    number = np.arange(np.prod(count)).reshape(count)
    p, q = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    r, s = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    return fault.surface(along, down), np.concatenate(
        [np.stack([p, r, q], axis=1), np.stack([p, s, r], axis=1)]
    )


def _true_slip(spec: FaultedSpec, k: int, fault: Fault, V: Floats, blocks: Bools) -> TrueSlip:
    """Return both places of the rock at the surface's vertices that lie in the layer."""
    W, kept, sides = spec.before(V, k, 0)
    kept = kept & spec.holds(W) & spec.exists(k, V)
    known: Sides = {name: side[kept] for name, side in sides.items()}
    walls, later = [], []
    inside = np.ones(int(kept.sum()), bool)
    for hanging, P in ((False, V[kept]), (True, fault.forward(V[kept]))):
        here = known | {fault.name: np.full(len(P), hanging)}
        X, every = spec.forward(P, k + 1, here)
        inside &= spec.in_model(X)
        walls.append(X + np.array(spec.offset, float))
        later.append(blocks_of(every, [other.name for other in spec.faults]))
    own = [other.name for other in spec.faults].index(fault.name)
    same = inside & np.delete(later[0] == later[1], own, axis=1).all(axis=1)
    ids = np.stack([_block(side[same], blocks) for side in later], axis=1)
    return TrueSlip(W[kept][same], walls[0][same], walls[1][same], ids)


def _block(sides: Bools, blocks: Bools) -> Ints:
    """Return the fault block (n,) of points by their sides (n, faults); -1 for none."""
    equal = (sides[:, None] == blocks).all(axis=2)
    return np.where(equal.any(axis=1), equal.argmax(axis=1), -1)


def _through(spec: FaultedSpec, j: int, V: Floats, F: Ints) -> Surface:
    """Return the surface after event ``j``: bent by a fold, torn by a fault."""
    event = spec.events[j]
    if isinstance(event, FoldEvent):
        reached: Bools = event.reaches(V)
        V, F = _compact(V, F[reached[F].all(axis=1)])
        return event.forward(V), F
    hanging = spec.hanging(j, V[F].mean(axis=1))
    corner = np.stack([F.ravel(), np.repeat(hanging, 3)], axis=1)
    used, F = np.unique(corner, axis=0, return_inverse=True)
    P = V[used[:, 0]]
    return np.where(used[:, 1:] == 1, event.forward(P), P), F.reshape(-1, 3)


def _compact(V: Floats, F: Ints) -> Surface:
    """Return the surface without the vertices that no triangle has."""
    used, F = np.unique(F, return_inverse=True)
    return V[used], F.reshape(-1, 3)
