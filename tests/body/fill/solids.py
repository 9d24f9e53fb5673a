"""Closed surfaces whose volumes are known."""

import numpy as np

_FACES = np.array(
    [
        *([0, 3, 1], [0, 2, 3], [4, 7, 6], [4, 5, 7], [0, 5, 4], [0, 1, 5]),
        *([2, 7, 3], [2, 6, 7], [0, 6, 2], [0, 4, 6], [1, 7, 5], [1, 3, 7]),
    ]
)


def box(corner, sides, cell=None):
    """A box with outward triangles; with ``cell``, its sides are cut into squares of that length.

    Corners are numbered x + 2 y + 4 z; the first two triangles are its lower face.
    """
    at = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)], dtype=float)
    if cell is None:
        return np.array(corner) + at * sides, _FACES
    V, F = [], []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        n, m = round(sides[i] / cell), round(sides[j] / cell)
        nodes = np.stack(np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij"), -1)
        a = (np.arange(n)[:, None] * (m + 1) + np.arange(m)).ravel()
        quads = np.concatenate(
            [np.stack(t, 1) for t in ((a, a + m + 1, a + m + 2), (a, a + m + 2, a + 1))]
        )
        for high in (0, 1):
            place = np.zeros(((n + 1) * (m + 1), 3))
            place[:, [i, j]] = nodes.reshape(-1, 2) * cell
            place[:, axis] = high * sides[axis]
            F.append((quads if high else quads[:, ::-1]) + sum(map(len, V)))
            V.append(place + corner)
    return np.concatenate(V), np.concatenate(F)


def ball(parts):
    """A unit ball of ``parts`` rings: inscribed triangles, outward."""
    polar = np.pi * np.arange(1, parts) / parts
    turn = 2 * np.pi * np.arange(2 * parts) / (2 * parts)
    ring = np.stack(
        [np.outer(np.sin(polar), f(turn)) for f in (np.cos, np.sin)]
        + [np.repeat(np.cos(polar)[:, None], len(turn), axis=1)],
        axis=-1,
    ).reshape(-1, 3)
    V = np.concatenate([[[0.0, 0, 1]], ring, [[0.0, 0, -1]]])
    k = np.arange(len(turn))
    after = (k + 1) % len(turn)
    F = [np.stack([0 * k, 1 + k, 1 + after], 1)]
    for r in range(parts - 2):
        a, b = 1 + r * len(turn), 1 + (r + 1) * len(turn)
        F += [np.stack([a + k, b + k, b + after], 1), np.stack([a + k, b + after, a + after], 1)]
    a = 1 + (parts - 2) * len(turn)
    F.append(np.stack([a + k, 0 * k + len(V) - 1, a + after], 1))
    return V, np.concatenate(F)


def joined(*meshes):
    """Several meshes as one (V, F)."""
    first = np.cumsum([0, *(len(V) for V, _ in meshes)])
    return (
        np.concatenate([V for V, _ in meshes]),
        np.concatenate([np.asarray(F) + k for (_, F), k in zip(meshes, first[:-1], strict=True)]),
    )
