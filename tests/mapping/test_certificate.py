"""The certificate: what it proves, and what it must not."""

import numpy as np
import pytest

import geounfold as gu
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import TetMesh
from geounfold.geometry.prisms import prism_tets
from geounfold.mapping.certificate import Gluing, certify, examine
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods.sheet.meshing import build
from geounfold.methods.sheet.meshing.build import MeshPlan
from geounfold.methods.sheet.meshing.prism_layers import FRACTIONS
from tests.shapes import slab

NONE = np.empty(0, np.int64)


def control(folded, unfolded, T):
    return ControlMesh(TetMesh(folded, T), TetMesh(unfolded, T), np.zeros(len(folded)))


def wound(turns, steps, closed=False):
    """A ring of wedges about the z axis that turns round it so many times, and its flat strip."""
    n = steps if closed else steps + 1
    angle = 2 * np.pi * turns * np.arange(n) / steps
    F = np.array([[0, 1 + k, 1 + (k + 1) % n] for k in range(steps)])
    plan = np.concatenate([[[0.0, 0.0]], np.stack([np.cos(angle), np.sin(angle)], axis=1)])
    V = np.concatenate([np.column_stack([plan, np.full(n + 1, z)]) for z in (0.0, 1.0)])
    return V, prism_tets(F, n + 1, 2)


def holding(V, T, points):
    """How many tetrahedra hold each point, by brute force over all of them."""
    count = np.zeros(len(points), dtype=int)
    for corners in V[T]:
        edges = (corners[1:] - corners[0]).T
        share = np.linalg.solve(edges, (points - corners[0]).T).T
        count += (share > 1e-9).all(axis=1) & (share.sum(axis=1) < 1 - 1e-9)
    return count


def test_a_bent_slab_is_proved():
    flat, T = slab(5, 5, 2)
    bent = flat + np.column_stack([0 * flat[:, 0], 0 * flat[:, 0], np.sin(flat[:, 0])])
    proof = certify(control(bent, flat, T), None, NONE)
    assert proof.injective
    assert proof["injective"] is True
    assert not proof.faults
    assert (proof.tetrahedra, proof.boundary_faces) == (len(T), 2 * 50 + 4 * 5 * 2 * 2)


@pytest.mark.parametrize("closed", [False, True])
def test_tetrahedra_that_wind_round_twice_are_all_upright_and_not_proved(closed):
    rng = np.random.default_rng(5)
    # 24 wedges of 25 or 30 degrees make 600 or 720 degrees.
    V, T = wound(600 / 360 if not closed else 2.0, 24, closed)
    assert (tet_volumes(V, T) > 0).all()
    flaws = examine(V, Gluing.of(T))
    assert not len(flaws.inverted)
    assert len(flaws.crossing)
    points = V.mean(axis=0) + rng.uniform(-0.6, 0.6, (400, 3)) * [1, 1, 0.5]
    assert holding(V, T, points).max() == 2
    assert not certify(control(V, V, T), None, NONE).injective


def test_what_winds_round_once_is_proved():
    rng = np.random.default_rng(5)
    V, T = wound(340 / 360, 24)
    assert examine(V, Gluing.of(T)).none
    points = V.mean(axis=0) + rng.uniform(-0.6, 0.6, (400, 3)) * [1, 1, 0.5]
    assert holding(V, T, points).max() == 1


def test_an_inverted_tetrahedron_is_named_with_its_place_and_blocks():
    flat, T = slab(3, 3, 1)
    folded = flat.copy()
    folded[5] += [0, 0, 1.5]  # an inner node of the lower layer, pushed through the upper one
    held = np.array([0, 0, -1])
    proof = certify(control(folded, flat, T), None, held)
    assert not proof.injective
    assert proof.inverted_folded > 0
    assert proof.inverted_unfolded == 0
    volumes = tet_volumes(folded, T)
    assert set(np.flatnonzero(volumes <= 0)) <= set(proof.elements)
    assert np.allclose(proof.folded, folded[T[proof.elements]].mean(axis=1))
    assert proof.blocks.sum() == 2 * (0 in proof.elements)
    said = proof.as_dict()
    assert said["faulty_elements"] == len(proof.elements) == len(said["flaws"])


def test_limbs_that_overlap_far_apart_are_found():
    # A long slab rolled up so far that its end lies in its beginning: 5 units of thickness 1
    # around a radius of 1 to 2, 400 degrees.
    flat, T = slab(19, 19, 1)
    angle = flat[:, 0] / 19 * np.radians(400)
    r = 1 + flat[:, 2]
    rolled = np.column_stack([r * np.sin(angle), flat[:, 1], r * np.cos(angle)])
    assert (tet_volumes(rolled, T) < 0).all() or (tet_volumes(rolled, T) > 0).all()
    turned = rolled if tet_volumes(rolled, T)[0] > 0 else rolled * [1, -1, 1]
    proof = certify(control(turned, flat, T), None, NONE)
    assert proof.crossing_folded > 0
    assert proof.crossing_unfolded == proof.inverted_folded == 0
    assert not proof.injective


def test_a_cavity_is_sound_and_a_body_within_a_body_is_not():
    V, T = slab(5, 5, 5)
    middle = V[T].mean(axis=1)
    inner = (np.abs(middle - 2.5) < 0.5).all(axis=1)
    hollow = certify(control(V, V, T[~inner]), None, NONE)
    assert hollow.injective
    within = np.concatenate([V, V * 0.1 + 2.4])  # a copy of a tenth of the size inside
    proof = certify(control(within, within, np.concatenate([T, T + len(V)])), None, NONE)
    assert proof.nested_folded == 1
    assert not proof.injective


def test_tetrahedra_glued_wrongly_are_found():
    V, T = slab(2, 2, 1)
    doubled = np.concatenate([T, T[:1]])
    assert len(Gluing.of(doubled).misglued)
    assert not certify(control(V, V, doubled), None, NONE).glued


@pytest.mark.slow
def test_upright_prisms_may_overlap_at_an_inner_hinge():
    """Offsets up to nine tenths of the focal distance, dipping there from one cell to the next.

    In early trials 8 blocks of a real body lay in two tetrahedra at an inner hinge, every volume
    positive in both spaces.  Here it is a hinge of radius 42 at a half-thickness of 40.
    """
    rng = np.random.default_rng(5)
    body = gu.simulate("sharp_hinge")
    u = gu.unfold(body.folded)
    assert u.certificate.injective
    fit = u.fits[0].sheet
    points = np.ascontiguousarray(u.frame.to_work(body.folded))
    foot = build.block_feet(fit.fitted, points, reach=10.0)
    columns = build._columns(fit.fitted, fit.horizons, foot, None, MeshPlan(_laid_flat))
    caps = build._focal_caps(columns.curvature[:, : columns.count], build._FOCAL)
    layers = columns.layers(build._offsets(columns, foot, caps), FRACTIONS)
    V, T = layers.folded, layers.tets()
    assert (tet_volumes(V, T) > 0).all()
    assert (tet_volumes(layers.unfolded, T) > 0).all()
    flaws = examine(V, gluing := Gluing.of(T))
    assert len(flaws.crossing)
    near = V[T[flaws.elements(gluing)]]
    share = rng.dirichlet(np.ones(4), (len(near), 40))
    inner = np.einsum("mij,mjk->mik", share, near).reshape(-1, 3)
    assert holding(V, T, inner).max() == 2


def _laid_flat(mesh, start):
    return gu.flatten(mesh, "spring", start=start)


@pytest.mark.parametrize("case", ["sim_case_1", "hole"])
def test_the_certificate_agrees_with_brute_force(case):
    """Points of every element's inside lie in that element alone, in both spaces."""
    rng = np.random.default_rng(5)
    u = gu.unfold(gu.simulate(case, blocks=4000).folded)
    assert u.certificate.injective
    T = u.map.whole.folded.T
    chosen = rng.choice(len(T), 60, replace=False)
    share = rng.dirichlet(np.ones(4), len(chosen))
    for space in (u.map.whole.folded, u.map.whole.unfolded):
        points = np.einsum("ij,ijk->ik", share, space.V[T[chosen]])
        assert (holding(space.V, T, points) == 1).all()
