"""Fault surfaces drawn as users draw them: beside the blocks, too large, too short, in parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from scipy.spatial import cKDTree

from geounfold.errors import OptionError
from geounfold.geometry.measures import face_normals, unit
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.synthetic.faulted.body import FaultedBody, Surface

_Variant = Callable[[FaultedBody, Surface, int], Surface]


def _mean_normal(surface: Surface) -> Floats:
    out: Floats = face_normals(*surface).sum(axis=0)
    return out / np.linalg.norm(out)


def _off(body: FaultedBody, surface: Surface, k: int, blocks: float) -> Surface:
    """Shift a surface across itself; surfaces of odd number go the other way."""
    V, F = surface
    sign = -1.0 if k % 2 else 1.0
    return V + sign * blocks * body.step * _mean_normal(surface), F


def _rough(body: FaultedBody, surface: Surface, k: int) -> Surface:
    """Move every vertex by a random vector, 0.3 blocks along each axis."""
    V, F = surface
    rng = np.random.default_rng([k, 5])
    return V + 0.3 * body.step * rng.standard_normal(V.shape), F


def _border(F: Ints) -> Ints:
    """Return border edges (k, 2), directed as their triangles have them."""
    edges = F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, group, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    out: Ints = edges[count[group.ravel()] == 1]
    return out


def _far(body: FaultedBody, surface: Surface, k: int) -> Surface:
    """Move the border outwards by thirty blocks, in the surface's mean plane."""
    V, F = surface
    edges = _border(F)
    outward = np.cross(V[edges[:, 1]] - V[edges[:, 0]], _mean_normal(surface))
    total = np.zeros_like(V)
    for end in (0, 1):
        np.add.at(total, edges[:, end], outward)
    at = np.unique(edges)
    V = V.copy()
    V[at] += 30 * body.step * unit(total[at])
    return V, F


def _along(body: FaultedBody, surface: Surface) -> tuple[Floats, float, float]:
    """Return places of triangles along strike, and the range of those that cut the body."""
    V, F = surface
    n = _mean_normal(surface)
    strike = np.array([-n[1], n[0], 0.0]) / np.hypot(n[0], n[1])
    middle = V[F].mean(axis=1)
    place = middle @ strike
    distance = np.asarray(cKDTree(body.folded).query(middle)[0])
    cut = place[distance < body.step] if distance.min() < body.step else place
    return place, float(cut.min()), float(cut.max())


def _taken(surface: Surface, keep: Bools) -> Surface:
    used, F = np.unique(surface[1][keep], return_inverse=True)
    return surface[0][used], F.reshape(-1, 3)


def _short(body: FaultedBody, surface: Surface, k: int) -> Surface:
    """End the surface inside the body: a tenth of its trace is missing at both ends."""
    place, low, high = _along(body, surface)
    tenth = 0.1 * (high - low)
    return _taken(surface, (place > low + tenth) & (place < high - tenth))


def _parts(body: FaultedBody, surface: Surface, k: int) -> Surface:
    """Divide the surface along strike into three; the middle one's triangles are turned over.

    The first two overlap by two blocks; a gap of one block parts the last two.
    """
    place, low, high = _along(body, surface)
    third = (high - low) / 3
    a, b, h = low + third, high - third, body.step
    V: list[Floats] = []
    F: list[Ints] = []
    ranges = ((-np.inf, a + h), (a - h, b), (b + h, np.inf))
    for n, (first, last) in enumerate(ranges):
        keep: Bools = (place > first) & (place < last)
        if not keep.any():
            continue
        piece = _taken(surface, keep)
        shift = sum(map(len, V))
        F.append(shift + (piece[1][:, ::-1] if n == 1 else piece[1]))
        V.append(piece[0])
    return np.concatenate(V), np.concatenate(F)


def _coarse(body: FaultedBody, surface: Surface, k: int) -> Surface:
    """Join vertices in cubes of four blocks, so that triangles are about four blocks large."""
    V, F = surface
    cell = np.floor(V / (4 * body.step)).astype(np.int64)
    _, group, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    middle = np.stack([np.bincount(group, V[:, axis]) for axis in range(3)], axis=1)
    joined = group[F]
    a, b, c = joined.T
    joined = joined[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(joined, axis=1), axis=0, return_index=True)
    return middle / count[:, None], joined[np.sort(first)]


_VARIANTS: dict[str, _Variant] = {
    "off_half": lambda body, surface, k: _off(body, surface, k, 0.5),
    "off_one": lambda body, surface, k: _off(body, surface, k, 1.0),
    "rough": _rough,
    "far": _far,
    "short": _short,
    "parts": _parts,
    "coarse": _coarse,
}

VARIANTS: Mapping[str, _Variant] = MappingProxyType(_VARIANTS)
"""Ways to draw a body's fault surfaces, by name; read-only."""


def drawn_otherwise(body: FaultedBody, variant: str) -> FaultedBody:
    """Return a body whose fault surfaces are drawn as users draw them; its truth stays.

    Parameters
    ----------
    body : FaultedBody
        The body with exact surfaces.
    variant : str
        ``off_half`` and ``off_one``: shifted across by half a block or one block.
        ``rough``: vertices off by 0.3 blocks. ``far``: thirty blocks past the body.
        ``short``: ends inside the body. ``parts``: three parts with an overlap and a gap.
        ``coarse``: triangles of four blocks.

    Raises
    ------
    OptionError
        The variant is unknown; the message lists the valid ones.
    """
    if variant not in VARIANTS:
        raise OptionError(f"no variant is named {variant!r}; valid: {', '.join(VARIANTS)}")
    change = VARIANTS[variant]
    surfaces = {
        name: change(body, surface, k) for k, (name, surface) in enumerate(body.surfaces.items())
    }
    return body.with_surfaces(surfaces)
