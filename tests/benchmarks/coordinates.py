"""Table of what carries points inside the control mesh: tetrahedra, or its prisms' coordinates.

    python tests/benchmarks/coordinates.py [NAME ...] [--meshes 1.5 4 8 thesis] [-o TABLE.csv]

Each body is unfolded once per control mesh: those of the sheet method, by the side of their cells
in blocks (1.5 is the default), and the thesis's vertical prisms, where it takes the body.  Its
blocks are carried by every kind of coordinates over that same control mesh.  Columns:

  convex         share of the prisms that are strictly convex, so that Wachspress coordinates exist
  epsilon        mean epsilon(W, Y) (thesis, equation 2.4); epsilon(X, Y) on the dome, without truth
  rms            root mean square distance from the truth after the best rigid motion, in blocks
  stratigraphic  mean error of the stratigraphic coordinate times the thickness, in blocks
  away           largest distance of a block from where the tetrahedra carry it, in blocks
  jump           jump of the deformation gradient (Frobenius norm), root mean square over all faces
                 of the body's tetrahedra by area: what the map is not smooth by
  jump_between   the same over faces between prisms; those inside prisms are smooth
  least_volume   smallest volume ratio (determinant of the gradient) at a block
  forward, back  CPU time of carrying all blocks, and of carrying them back, over the tetrahedra's
                 in the same process; on the first mesh asked for
  unsolved       blocks that were not brought back

Two kinds are for comparison only.  ``wachspress_plane``, where every quadrilateral is plane when
folded, as in the thesis's mesh: Wachspress coordinates that are bilinear on them, which is not
what a split border has in the unfolded space.  ``wedge``: isoparametric coordinates of the wedge
with ruled sides, which are the Wachspress coordinates of the straight prism that it is the image
of; their sides are not the split ones either, so that they fit neither the certificate nor lone
tetrahedra.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

import geounfold as gu
from geounfold.geometry.measures import triangle_areas
from geounfold.mapping.distortion import deformation_gradients
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.unfolding.options import UnfoldOptions

BODIES = ("sim_case_1", "sim_case_2", "plunging", "steep", "recumbent", "lens", "refolded", "dome")
PLANE = 1e-9  # distance of a quadrilateral's corners from a plane, over the prism's size
NUDGE = 1e-6  # share of the way to a tetrahedron's middle: its side of a face
ROUNDS = 3  # of timing; the shortest counts
DEFAULT = ("1.5", "4", "8", "thesis")


def dome(radius=40.0, half=4.0, reach=0.6):
    """Return a spherical cap's blocks (n, 3) and their true stratigraphic coordinate (n,)."""
    side = np.arange(-radius, radius + 1)
    P = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3) + 0.25
    r = np.linalg.norm(P, axis=1)
    keep = (np.abs(r - radius) < half) & (P[:, 2] > np.cos(reach) * r)
    return P[keep], (r[keep] - radius) / (2 * half) + 0.5, 2 * half


def body_of(name):
    """Return folded points, truth or None, stratigraphic truth, thickness, side of a block."""
    if name == "dome":
        P, third, thickness = dome()
        return P, None, third, thickness, 1.0
    body = gu.simulate(name)
    side = float(np.prod(body.steps) ** (1 / 3))
    return body.folded, body.truth, body.stratigraphic, body.top - body.bottom, side


# -------------------------------------------------------------------------- isoparametric wedges


class WedgeMap:
    """The map by isoparametric coordinates of the prisms that an UnfoldingMap has."""

    def __init__(self, mapping):
        self.mapping, self.prisms = mapping, mapping.prisms

    def reference(self, points, prism):
        """Return parameters (n, 3) of working points in prisms: shares of b and c, height."""
        C = self.mapping.whole.folded.V[self.prisms.corners[prism]]
        q = np.full((len(points), 3), [1 / 3, 1 / 3, 0.5])
        for _ in range(20):
            values, slopes = wedge(q)
            J = np.einsum("nia,nib->nab", C, slopes)
            off = points - np.einsum("ni,nij->nj", values, C)
            q += np.linalg.solve(J, off[..., None])[..., 0]
            if np.abs(off).max() < 1e-11:
                return q
        raise RuntimeError("the wedges' parameters were not found")

    def carry(self, points):
        """Return what UnfoldingMap.carry does, with the wedges' places."""
        carried = self.mapping.carry(points)
        prism = self.prisms.prism[carried.element]
        rows = np.flatnonzero((carried.element >= 0) & (prism >= 0))
        values, _ = wedge(self.reference(self.mapping.frame.to_work(points[rows]), prism[rows]))
        corners, whole = self.prisms.corners[prism[rows]], self.mapping.whole
        image = np.einsum("ni,nij->nj", values, whole.unfolded.V[corners])
        carried.points[rows] = image * self.mapping.frame.scale
        carried.stratigraphic[rows] = (values * whole.stratigraphic[corners]).sum(axis=1)
        return carried

    def gradients(self, points, element):
        """Return the deformation gradients at working points (n, 3, 3)."""
        J = deformation_gradients(self.mapping.whole)[element]
        prism = self.prisms.prism[element]
        rows = np.flatnonzero(prism >= 0)
        J[rows] = self.at(self.reference(points[rows], prism[rows]), prism[rows])
        return J

    def at(self, q, prism):
        """Return the deformation gradients at parameters q (n, 3) of prisms."""
        _, slopes = wedge(q)
        corners, whole = self.prisms.corners[prism], self.mapping.whole
        before, after = (
            np.einsum("nia,nib->nab", V[corners], slopes)
            for V in (whole.folded.V, whole.unfolded.V)
        )
        return after @ np.linalg.inv(before)


def wedge(q):
    """Return the products of a triangle's and a segment's coordinates (n, 6), and derivatives."""
    u, v, t = q.T
    flat = np.stack([1 - u - v, u, v], axis=1)
    turn = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    values = np.concatenate([flat * (1 - t)[:, None], flat * t[:, None]], axis=1)
    slopes = np.zeros((len(q), 6, 3))
    slopes[:, :3, :2] = turn * (1 - t)[:, None, None]
    slopes[:, 3:, :2] = turn * t[:, None, None]
    slopes[:, :3, 2], slopes[:, 3:, 2] = -flat, flat
    return values, slopes


# ---------------------------------------------------------------------------------------- figures


def inner_faces(T):
    """Return the faces (k, 3) that two tetrahedra of T share, and which two (k, 2)."""
    faces = np.sort(T[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    order = np.lexsort(faces.T)
    same = np.flatnonzero((faces[order][1:] == faces[order][:-1]).all(axis=1))
    pairs = np.stack([order[same], order[same + 1]], axis=1) // 4
    return faces[order[same]], pairs


def jumps(mapping, prisms):
    """Return the rms jump of the gradient over all inner faces, and over those between prisms."""
    V, T = mapping.control.folded.V, mapping.control.folded.T
    faces, pairs = inner_faces(T)
    middle = V[faces].mean(axis=1)
    area = triangle_areas(V, faces)
    sides = []
    for element in pairs.T:
        near = middle + NUDGE * (V[T[element]].mean(axis=1) - middle)
        J = deformation_gradients(mapping.control)[element]
        if mapping.prisms is not None:
            J = mapping.gradients(mapping.frame.to_world(near), element)
        sides.append(J)
    square = ((sides[0] - sides[1]) ** 2).sum(axis=(1, 2))
    owner = prisms.prism[pairs]
    between = (owner[:, 0] != owner[:, 1]) | (owner < 0).any(axis=1)
    return tuple(
        float(np.sqrt(np.average(square[rows], weights=area[rows])))
        for rows in (np.ones(len(area), bool), between)
    )


def wedge_jumps(mapping):
    """Return the same for wedges, over their own sides (at the middle of each)."""
    prisms, found = WedgeMap(mapping), []
    body = mapping.prisms.rows.max(axis=1) < len(mapping.control.folded.T)
    corners = mapping.prisms.corners[body]
    sides = (
        ((0, 1, 2), (1 / 3, 1 / 3, 0.0)),
        ((3, 4, 5), (1 / 3, 1 / 3, 1.0)),
        ((0, 1, 3, 4), (0.5, 0.0, 0.5)),
        ((1, 2, 4, 5), (0.5, 0.5, 0.5)),
        ((0, 2, 3, 5), (0.0, 0.5, 0.5)),
    )
    V = mapping.control.folded.V
    for face, place in sides:
        key = np.full((len(corners), 4), -1)
        key[:, : len(face)] = np.sort(corners[:, face], axis=1)
        J = prisms.at(np.tile(place, (len(corners), 1)), np.flatnonzero(body))
        ring = (0, 1, 3, 2) if len(face) == 4 else face
        ring = [face[k] for k in ring] if len(face) == 4 else list(face)
        a, b = V[corners[:, ring[1]]] - V[corners[:, ring[0]]], V[corners[:, ring[-1]]]
        area = np.linalg.norm(np.cross(a, b - V[corners[:, ring[0]]]), axis=1)
        found.append((key, J, area * (1.0 if len(face) == 4 else 0.5)))
    key, J, area = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort(key.T)
    same = np.flatnonzero((key[order][1:] == key[order][:-1]).all(axis=1))
    one, two = order[same], order[same + 1]
    square = ((J[one] - J[two]) ** 2).sum(axis=(1, 2))
    between = float(np.sqrt(np.average(square, weights=area[one])))
    V, T = mapping.control.folded.V, mapping.control.folded.T
    faces, _ = inner_faces(T)
    whole = triangle_areas(V, faces).sum()
    return between * float(np.sqrt(area[one].sum() / whole)), between


def shortest(run, rounds):
    """Return the least CPU seconds of a run in some rounds, and what it returned."""
    if not rounds:
        return np.nan, run()
    taken, out = np.inf, None
    for _ in range(rounds):
        start = time.process_time()
        out = run()
        taken = min(taken, time.process_time() - start)
    return taken, out


def plane_sides(corners):
    """Return whether every quadrilateral of prisms (n, 6, 3) is plane."""
    size = np.ptp(corners, axis=1).max(axis=1)
    for a, b in ((0, 1), (1, 2), (0, 2)):
        e = corners[:, [b, a + 3, b + 3]] - corners[:, [a]]
        normal = np.cross(e[:, 0], e[:, 1])
        off = np.einsum("ni,ni->n", e[:, 2], normal) / np.linalg.norm(normal, axis=1)
        if (np.abs(off) > PLANE * size).any():
            return False
    return True


def options_of(mesh):
    """Return the options that make a control mesh by its name in the table."""
    chosen = UnfoldOptions(allow_uncertified=True)
    if mesh == "thesis":
        return replace(chosen, method="thesis")
    return replace(chosen, sheet_options=replace(chosen.sheet_options, mesh_cell=float(mesh)))


def rows_of(name, mesh, rounds):
    """Yield the table's rows of one body and control mesh, timed in so many rounds, or in none."""
    X, W, third, thickness, side = body_of(name)
    u = gu.unfold(X, options_of(mesh))
    plain = u.map
    maps = {
        kind: UnfoldingMap(plain.frame, plain.control, plain.shell, plain.reach, coordinates=kind)
        for kind in ("tet", "wachspress", "mvc")
    }
    prisms = maps["mvc"].prisms
    convex = float(maps["wachspress"].prisms.rational.mean())
    if plane_sides(plain.whole.folded.V[prisms.corners]):
        maps["wachspress_plane"] = UnfoldingMap(
            plain.frame, plain.control, plain.shell, plain.reach, coordinates="wachspress"
        )
        rational = np.ones(len(prisms.corners), bool)
        maps["wachspress_plane"].prisms = replace(prisms, rational=rational)
    base = None
    for kind in (*maps, "wedge"):
        mapping = maps["mvc"] if kind == "wedge" else maps[kind]
        mapping.carry(X[:100])
        forward, carried = shortest(lambda m=mapping: m.carry(X), rounds)
        back, returned = shortest(
            lambda m=mapping, c=carried: m.carry(c.points, inverse=True), rounds
        )
        if kind == "wedge":
            mapper = WedgeMap(mapping)
            carried, forward, back = mapper.carry(X), np.nan, np.nan
            jump, between = wedge_jumps(mapping)
            J = mapper.gradients(plain.frame.to_work(X), carried.element)
        else:
            jump, between = jumps(mapping, maps["mvc"].prisms)
            J = mapping.gradients(X, carried.element)
        base = base or (forward, back, carried.points)
        error = gu.epsilon(X if W is None else W, carried.points)
        yield {
            "body": name,
            "mesh": mesh,
            "coordinates": kind,
            "blocks": len(X),
            "prisms": len(maps["mvc"].prisms.corners),
            "convex": convex,
            "proved_tetrahedra": u.certificate.injective,
            "epsilon": error.mean(),
            "rms": np.nan if W is None else gu.aligned_rms(carried.points, W) / side,
            "stratigraphic": (np.abs(carried.stratigraphic - third) * thickness).mean() / side,
            "away": np.linalg.norm(carried.points - base[2], axis=1).max() / side,
            "jump": jump,
            "jump_between": between,
            "least_volume": float(np.linalg.det(J).min()),
            "forward": forward / base[0],
            "back": back / base[1],
            "unsolved": returned.unsolved if kind != "wedge" else 0,
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=BODIES)
    parser.add_argument("--meshes", nargs="+", default=DEFAULT)
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    table = []
    for name in args.names:
        for mesh in args.meshes:
            try:
                rows = list(rows_of(name, mesh, ROUNDS if mesh == args.meshes[0] else 0))
            except gu.GeounfoldError as error:
                sys.stdout.write(f"{name} {mesh}: {type(error).__name__}: {error}\n")
                continue
            table += rows
            for row in rows:
                sys.stdout.write(" ".join(f"{k}={_shown(v)}" for k, v in row.items()) + "\n")
            sys.stdout.flush()
            if args.output:  # after every mesh: a run that is cut short leaves what it has
                frame = pd.DataFrame(table)
                frame.to_csv(args.output, index=False, float_format="%.4g", lineterminator="\n")
    return 0


def _shown(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    sys.exit(main())
