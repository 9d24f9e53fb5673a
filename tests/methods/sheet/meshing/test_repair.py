"""The rungs that mend a control mesh: untangling, bounded slopes, tents, pinched footprints."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import check_grad

import geounfold as gu
from geounfold.geometry.measures import tet_volumes
from geounfold.geometry.mesh import TriMesh
from geounfold.geometry.prisms import prism_tets
from geounfold.geometry.untangle import _Problem, _rest_shapes, untangle
from geounfold.mapping.certificate import Gluing, examine
from geounfold.methods.sheet.meshing import build
from geounfold.methods.sheet.meshing.build import MeshPlan
from geounfold.methods.sheet.meshing.footprint import footprint
from geounfold.methods.sheet.meshing.prism_layers import FRACTIONS, bounded_slope
from geounfold.methods.sheet.meshing.repair import climb
from geounfold.methods.sheet.meshing.tents import with_tents
from tests.shapes import plane, slab


def test_untangling_moves_few_vertices_and_turns_all_upright():
    V, T = slab(11, 11, 3)
    spoiled = V.copy()
    bad = np.array([144 + 12 * 5 + 5, 144 + 12 * 5 + 6])
    spoiled[bad] += [0.0, 0.3, 1.7]  # pushed through the layer above, which is 1 away
    inverted = tet_volumes(spoiled, T) <= 0
    assert inverted.any()
    mended = untangle(spoiled, T, V, np.unique(T[inverted]))
    assert (tet_volumes(mended, T) > 0).all()
    assert examine(mended, Gluing.of(T)).none
    moved = (mended != spoiled).any(axis=1)
    # One ring around the elements at fault, of 576 vertices.
    assert moved.sum() < 150
    assert np.abs(mended - V).max() < 0.5


def test_the_foldover_energy_has_the_gradient_it_says():
    rng = np.random.default_rng(11)
    V, T = slab(2, 2, 2)
    spoiled = V + 0.4 * rng.normal(size=V.shape)  # some inverted, some not
    volumes = tet_volumes(spoiled, T)
    assert (volumes < 0).any()
    assert (volumes > 0).any()
    problem = _Problem(spoiled, T, _rest_shapes(V, T), np.arange(len(V)))
    x = spoiled.ravel()
    error = check_grad(
        lambda y: problem._energy(y, 0.3)[0], lambda y: problem._energy(y, 0.3)[1], x
    )
    # Finite differences of step 1.5e-8 in an energy of some thousands.
    assert error < 1e-5 * np.linalg.norm(problem._energy(x, 0.3)[1])


def test_slopes_are_bounded_and_never_raised():
    rng = np.random.default_rng(11)
    U, F = plane(14, 14)
    values = rng.uniform(1, 9, len(U))
    out = bounded_slope(values, U, F, 0.5)
    assert (out <= values).all()
    edges = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    rise = np.abs(out[edges[:, 0]] - out[edges[:, 1]])
    length = np.linalg.norm(U[edges[:, 0]] - U[edges[:, 1]], axis=1)
    assert (rise <= 0.5 * length + 1e-12).all()
    # The largest such field: a lone low node makes a cone.
    lone = np.full(len(U), 9.0)
    lone[112] = 1.0  # the middle node
    cone = bounded_slope(lone, U, F, 0.5)
    along = U[:, 1] == U[112, 1]
    assert cone[along] == pytest.approx(1 + 0.5 * np.abs(U[along, 0] - U[112, 0]))


def test_cells_that_touch_in_a_corner_are_joined():
    """Two clouds of feet whose cells, without dilation, meet in one corner."""
    rng = np.random.default_rng(11)
    first = rng.uniform(0, 6, (400, 2))
    prints = footprint(np.concatenate([first, first - 6.0]), 0.0, 1.0, 0)
    T = prism_tets(prints.F, len(prints.U), 2)
    assert Gluing.of(T).sound
    ringed = footprint(np.concatenate([first, first - 6.0]), 0.0, 1.0, 0, rings=2)
    assert np.array_equal(ringed.F, prints.F)
    assert np.allclose(ringed.U, prints.U)
    assert len(ringed.ring.F)
    whole = np.concatenate([ringed.F, ringed.ring.F])
    nodes = np.concatenate([ringed.U, ringed.ring.U])
    assert Gluing.of(prism_tets(whole, len(nodes), 2)).sound
    # The ring is past the footprint, two cells wide.
    assert nodes.max(axis=0) == pytest.approx(prints.U.max(axis=0) + 2)


@pytest.fixture(scope="module")
def plunging():
    body = gu.simulate("plunging", width=200.0)
    return gu.unfold(body.folded, reach=0.0)


def columns_of(u):
    fit = u.fits[0].sheet
    points = np.ascontiguousarray(u.frame.to_work(u.folded))
    foot = build.block_feet(fit.fitted, points, reach=10.0)

    def flat(mesh: TriMesh, start):
        return gu.flatten(mesh, "spring", start=start)

    return build._columns(fit.fitted, fit.horizons, foot, None, MeshPlan(flat, shell=0.0)), points


def test_tents_hold_blocks_just_outside_and_stay_proved(plunging):
    columns, _ = columns_of(plunging)
    offsets = np.full((2, columns.count), 4.2)  # half the thickness is 5
    laid = columns.lay_out(columns.surround(columns.layers(offsets, FRACTIONS)))
    top = laid.folded[laid.node == laid.node[columns.count // 2]]  # one column, from the bottom up
    outward = (top[-1] - top[-2]) / np.linalg.norm(top[-1] - top[-2])
    lost = top[-1] + np.outer([0.2, 0.5], outward) + [[0.1, 0.2, 0.0], [-0.3, 0.1, 0.0]]
    more, left = with_tents(laid, lost)
    assert not len(left)
    assert len(more.shell)
    gluing = Gluing.of(more.all_tets)
    assert gluing.sound
    assert examine(more.folded, gluing).none
    assert examine(more.unfolded, gluing).none
    assert np.array_equal(more.folded[: laid.inner], laid.folded)


def test_a_few_blocks_in_the_shell_are_taken_into_the_body(plunging):
    columns, _ = columns_of(plunging)
    columns = replace(columns, reach=3.0)
    offsets = np.full((2, columns.count), np.abs(columns.high).max() + 0.6)
    laid = columns.lay_out(columns.surround(columns.layers(offsets, FRACTIONS)))
    rows = np.array([5, 700])
    places = laid.folded[laid.shell[rows]].mean(axis=1)
    more = laid.taking_in(rows)
    assert len(more.T) == len(laid.T) + 2
    assert len(more.shell) == len(laid.shell) - 2
    assert more.inner > laid.inner
    assert more.T.max() < more.inner
    # The same tetrahedra in the same places, in both spaces.
    assert np.allclose(more.folded[more.T[-2:]].mean(axis=1), places)
    assert tet_volumes(more.folded, more.all_tets).sum() == pytest.approx(
        tet_volumes(laid.folded, laid.all_tets).sum()
    )
    assert examine(more.unfolded, Gluing.of(more.all_tets)).none


def test_the_ladder_records_what_every_rung_gave(plunging):
    columns, points = columns_of(plunging)

    def rung(offset):
        return columns, columns.layers(np.full((2, columns.count), offset), FRACTIONS)

    # 40 blocks are past the focal distance of the hinges (12 blocks): turned inside out.  Where
    # that is so, offsets fall back to the horizons, 5 blocks away.
    climbed = climb([("far", lambda: rung(40.0)), ("near", lambda: rung(5.6))], points)
    assert climbed.proved
    first, second = climbed.rungs
    assert (first.name, second.name) == ("far", "blended")
    assert first.inverted_folded > 0
    assert second.flaws == second.lost == 0
    assert climbed.laid.layers.up.max() < 40
    assert (climbed.laid.layers.up > columns.high).all()


def test_what_cannot_be_proved_is_given_back_unproved(plunging):
    columns, points = columns_of(plunging)
    # Every other normal looks down: whatever the offsets, prisms are twisted.
    twisted = replace(columns, normal=columns.normal * (-1.0) ** np.arange(len(columns.P))[:, None])
    layers = twisted.layers(np.full((2, columns.count), 5.0), FRACTIONS)
    climbed = climb([("twisted", lambda: (twisted, layers))], points)
    assert not climbed.proved
    assert [rung.name for rung in climbed.rungs] == ["twisted", "blended", "untangled", "shrunk"]
    assert all(rung.flaws > 0 for rung in climbed.rungs)
