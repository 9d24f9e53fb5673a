"""Meshes with a known flat shape, and what each flattener may leave of them."""

from __future__ import annotations

import numpy as np

from geounfold.flattening import (
    FLATTENERS,
)
from geounfold.geometry.measures import lengths, unique_edges
from geounfold.geometry.mesh import TriMesh

# Largest relative edge error that each method may leave on an exactly developable mesh.  Measured
# on the cylinder, cone and slab: spring 1.3e-15, spring_dynamic 3.6e-7, arap 1.3e-5 (both
# stop by displacement), lscm 1.9e-13 (4.6e-11 on the largest half-cylinder).  The effect to tell
# it from: a spherical cap, which cannot be flat, leaves 4e-2 by every method.
# slim and scaf, which stop by displacement too, leave 1.4e-5; ufo 9.2e-8.  isomap's paths run along
# edges of a graph: it leaves 0.088; test_isomap.py shows that it does no harm.
EXACT = {
    "spring": 1e-12,
    "spring_dynamic": 1e-5,
    "arap": 1e-4,
    "lscm": 1e-9,
    "slim": 1e-4,
    "scaf": 1e-4,
    "mds": 1e-12,
    "ufo": 1e-6,
    "isomap": 0.1,
}

METHODS = sorted(FLATTENERS)


def grid(nx, ny):
    """Points of a grid and its triangles, counter-clockwise, diagonals alternating."""
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    index = i * ny + j
    a, b, c, d = (
        s.ravel() for s in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    )
    even = ((i + j)[:-1, :-1].ravel() % 2 == 0)[:, None]
    lower = np.where(even, np.c_[a, b, c], np.c_[a, b, d])
    upper = np.where(even, np.c_[a, c, d], np.c_[b, c, d])
    return np.c_[i.ravel(), j.ravel()].astype(float), np.concatenate([lower, upper])


def cylinder(n=13, m=9, radius=6.0, angle=2.0):
    """Ruling-aligned cylinder, its development by chords and by arcs."""
    S, F = grid(n, m)
    theta = S[:, 0] * angle / (n - 1)
    V = np.c_[radius * np.sin(theta), S[:, 1], radius * np.cos(theta)]
    chord = 2 * radius * np.sin(angle / (n - 1) / 2)
    return V, F[:, ::-1], np.c_[S[:, 0] * chord, S[:, 1]], np.c_[radius * theta, S[:, 1]]


def cap(n=17, opening=0.7):
    """Spherical cap of radius 1, cut from a square grid."""
    S, F = grid(n, n)
    P = (S / (n - 1) - 0.5) * 2 * opening / np.sqrt(2)
    r = np.linalg.norm(P, axis=1)
    scale = np.divide(np.sin(r), r, out=np.ones_like(r), where=r > 0)
    return np.c_[P * scale[:, None], np.cos(r)], F


def slab(n=9, m=7):
    S, F = grid(n, m)
    return np.c_[S * [1.0, 1.3], np.zeros(len(S))], F


def annulus():
    S, F = grid(9, 9)
    middle = (np.abs(S[F].mean(axis=1) - 4) < 1.2).all(axis=1)
    mesh = TriMesh(np.c_[S, 0.2 * np.sin(S[:, 0])], F).submesh(~middle)[0]
    return mesh.V, mesh.F


def edge_errors(mesh, uv):
    edges = unique_edges(mesh[1])
    return lengths(uv, edges) / lengths(mesh[0], edges) - 1


def nearly_closed():
    """A sphere open at a small hole: its springs crumple when they may."""
    S, F = grid(24, 9)
    theta, phi = S[:, 0] * 2 * np.pi / 24, 0.35 + S[:, 1] * 0.28
    ring = np.c_[np.sin(phi) * np.cos(theta), np.sin(phi) * np.sin(theta), np.cos(phi)]
    seam = []
    for j in range(8):
        a, b, c, d = 23 * 9 + j, j, j + 1, 23 * 9 + j + 1
        seam += [[a, b, c], [a, c, d]]
    top = [[i * 9, len(ring), ((i + 1) % 24) * 9] for i in range(24)]
    V = np.concatenate([ring, [[0, 0, 1.0]]])
    return V, np.concatenate([F, seam, top])
