"""The cross-check of meshes: against solids with a truth, on whole bodies, and where it fails."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import geounfold as gu
from geounfold.comparison.crosscheck import PRISM, CrossCheckOptions
from geounfold.comparison.crosscheck._meshes import border, farthest, figures, fill, without_unused
from geounfold.comparison.crosscheck._places import Carrier, Follower, border_places
from geounfold.errors import MissingDependencyError, OptionError
from geounfold.geometry.measures import boundary_faces, tet_volumes
from geounfold.geometry.mesh import TetMesh, TriMesh
from geounfold.mapping.control_mesh import ControlMesh
from tests.shapes import rotation, slab

TETGEN = find_spec("tetgen") is not None
needs_tetgen = pytest.mark.skipif(not TETGEN, reason="TetGen (extra tetgen) is not installed")
MESHERS = ["tetwild", pytest.param("tetgen", marks=needs_tetgen)]
OPTIONS = CrossCheckOptions()


def control(folded, unfolded, T):
    return ControlMesh(TetMesh(folded, T), TetMesh(unfolded, T), np.zeros(len(folded)))


BOX, BOX_T = slab(8, 6, 4, (2.0, 2.0, 1.5))
SURFACE = border(TetMesh(BOX, BOX_T))
LINEAR = np.array([[0.9, 0.2, 0.1], [-0.1, 1.1, 0.0], [0.05, 0.0, 1.0]])
TURN = rotation(11)


@pytest.fixture(scope="module")
def filled():
    """Return the box filled by each mesher."""
    names = ["tetwild", "tetgen"] if TETGEN else ["tetwild"]
    return {name: fill(name, SURFACE, OPTIONS)[0] for name in names}


@pytest.mark.parametrize("name", MESHERS)
def test_meshers_fill_a_box_with_upright_tetrahedra(filled, name):
    found = figures(name, filled[name], SURFACE, 10.0, 0.0)
    # TetGen keeps the border; fTetWild may move it by the envelope: 0.1 over an area of 720 in
    # a volume of 1152, 6 percent at the very most, and 0.1 percent measured.
    bound = {"tetwild": 0.005, "tetgen": 1e-12}[name]
    assert found.volume_difference == pytest.approx(0, abs=bound)
    assert found.volume == pytest.approx(1_152_000, rel=bound)
    assert found.volume == pytest.approx(found.boundary_volume, rel=1e-12)
    assert found.inverted == 0
    assert max(found.hausdorff_to, found.hausdorff_from) <= OPTIONS.envelope + 1e-9
    assert 0 < found.dihedral_min <= found.dihedral_median <= found.dihedral_max < 180
    assert 0 < found.radius_ratio_min <= found.radius_ratio_median <= 1


@pytest.mark.parametrize("name", [PRISM, *MESHERS])
@pytest.mark.parametrize("interior", ["harmonic", "arap"])
def test_insides_follow_a_motion_and_harmonic_ones_a_linear_map(filled, name, interior):
    rng = np.random.default_rng(11)
    # Linear maps are harmonic, and the cotangent Laplacian is exact on them; motions have no
    # energy.  A border within the envelope goes with the closest place: 0.1 off at most.
    matrix = LINEAR if interior == "harmonic" else TURN
    image = BOX @ matrix.T + [3.0, -2.0, 1.0]
    mesh = TetMesh(BOX, BOX_T) if name == PRISM else filled[name]
    unfolded, _ = Follower(mesh, control(BOX, image, BOX_T)).unfolded(interior)
    points = rng.uniform([1, 1, 1], [15, 11, 5], size=(500, 3))
    carrier = Carrier(mesh, points)
    assert carrier.found.all()
    off = np.linalg.norm(carrier.carry(unfolded) - points @ matrix.T - [3.0, -2.0, 1.0], axis=1)
    # ARAP stops where no vertex moves by more than 1e-4; what is left is ten times that.
    bound = 0.12 if name == "tetwild" else {"harmonic": 1e-9, "arap": 1e-3}[interior]
    assert off.max() < bound


def test_harmonic_heights_in_a_bend_are_logarithmic():
    # A bend of radii 6 to 14 unfolded by flexural slip, height r - 10.  The harmonic height is
    # 8 ln(r / 6) / ln(14 / 6) - 4, 0.82 above the true one at r = 10, away from the rims: what
    # a harmonic inside differs by, whatever the mesh.
    V, T = slab(32, 24, 16, (0.125, 1.25, 0.5))
    r, angle = V[:, 2] + 6, V[:, 0] - 2
    folded = np.column_stack([r * np.sin(angle), V[:, 1], r * np.cos(angle)])
    flat = np.column_stack([r * angle, V[:, 1], r - 10])
    mesh = TetMesh(folded, T)
    assert (tet_volumes(folded, T) > 0).all()
    unfolded, _ = Follower(mesh, control(folded, flat, T)).unfolded("harmonic")
    middle = (np.abs(angle) < 0.05) & (np.abs(V[:, 1] - 15) < 1)
    truth = 8 * np.log(r[middle] / 6) / np.log(14 / 6) - 4
    # The rims, 15 units or 2 radians away, hold the true height: their influence has fallen to
    # exp(-15 pi / 8) = 0.003 of it.  The rest is the elements' size, 0.5 across.
    assert unfolded.V[middle, 2] == pytest.approx(truth, abs=0.03)
    assert (unfolded.V - flat)[middle, 2].max() == pytest.approx(0.82, abs=0.03)


def test_border_places_are_those_of_the_map():
    image = np.column_stack([BOX[:, 0] + np.sin(BOX[:, 1]), BOX[:, 1], 2 * BOX[:, 2]])
    held = np.unique(boundary_faces(BOX_T)[0])
    # 1e-12: barycentric coordinates at a corner.
    found = border_places(BOX[held], control(BOX, image, BOX_T))
    assert found == pytest.approx(image[held], abs=1e-12)


def test_a_mesh_without_inner_vertices_is_its_border():
    V, T = slab(2, 2, 1)
    image = V @ LINEAR.T
    for interior in ("harmonic", "arap"):
        found, _ = Follower(TetMesh(V, T), control(V, image, T)).unfolded(interior)
        assert found.V == pytest.approx(image, abs=1e-12)


def test_vertices_of_no_tetrahedron_do_not_count():
    # Control meshes that were mended may have some; to libigl they make the system singular.
    V = np.concatenate([[[50.0, 50.0, 50.0]], BOX, [[9.0, 9.0, 9.0]]])
    mesh = without_unused(TetMesh(V, BOX_T + 1))
    assert mesh.V.tolist() == BOX.tolist()
    assert mesh.T.tolist() == BOX_T.tolist()
    found, _ = Follower(mesh, control(V, V @ LINEAR.T, BOX_T + 1)).unfolded("harmonic")
    assert found.V == pytest.approx(BOX @ LINEAR.T, abs=1e-9)


def test_distances_between_borders_are_one_sided():
    bump = BOX.copy()
    top = np.flatnonzero(bump[:, 2] == 6)
    bump[top[len(top) // 2], 2] += 1.5
    raised = TriMesh(bump, SURFACE.F)
    # From the bump's tip straight down 1.5; from the plane no place is farther than the foot.
    assert farthest(raised, SURFACE) == pytest.approx(1.5)
    assert 0 < farthest(SURFACE, raised) < 1.5
    assert farthest(SURFACE, SURFACE) < 1e-12


@pytest.fixture(scope="module")
def body():
    return gu.simulate("sim_case_1", blocks=1000).folded


@pytest.fixture(scope="module")
def unfolding(body):
    return gu.unfold(body)


@pytest.fixture(scope="module")
def check(unfolding):
    return gu.crosscheck(unfolding)


def test_a_body_agrees_with_its_cross_check(check, unfolding):
    assert [mesh.mesh for mesh in check.meshes] == [PRISM, *OPTIONS.chosen()]
    assert check.warnings == []
    assert check.block == unfolding.frame.scale
    assert check.volume == pytest.approx(unfolding.quality.volume_folded, rel=1e-12)
    # The control mesh reaches around the hull.
    assert check.volume > check.hull_volume > 0
    hull = unfolding.summary()["hull"]
    assert (check.hull_volume, check.blocks_volume) == (hull["volume"], hull["blocks_volume"])
    for mesh in check.meshes:
        assert abs(mesh.volume_difference) < 0.01
        assert len(check.grids[mesh.mesh].T) == mesh.tetrahedra
        volume = tet_volumes(check.grids[mesh.mesh].V, check.grids[mesh.mesh].T).sum()
        assert volume == pytest.approx(mesh.volume, rel=1e-9)
    for places in check.places:
        assert places.rms < 0.25
        assert places.rms_same_interior < 0.05
        assert places.blocks == len(unfolding.folded)
        assert places.outside == 0
        apart = check.differences[f"{places.mesh}_{places.interior}"]
        assert np.sqrt(np.mean(apart**2)) == pytest.approx(places.rms)
        assert unfolding.folded[apart.argmax()].tolist() == list(places.worst)
        parts = (places.along_layers, places.across_layers)
        assert np.hypot(*parts) == pytest.approx(places.rms)


def test_figures_go_into_a_table_and_into_json(check, unfolding):
    table = check.table
    assert len(table) == 2 * len(check.meshes)
    assert not table.duplicated(["mesh", "interior"]).any()
    assert (table.error == "").all()
    told = json.loads(json.dumps(check.as_dict(), allow_nan=False))
    assert [row["mesh"] for row in told["meshes"]] == [mesh.mesh for mesh in check.meshes]
    assert told["warnings"] == []
    summary = check.added_to(unfolding.summary())
    assert summary["crosscheck"]["volume"] == check.volume
    assert summary["warnings"] == unfolding.summary()["warnings"]


def test_disagreement_is_a_warning_of_the_summary_too(check, unfolding):
    tight = replace(OPTIONS, volume_bound=1e-9, border_bound=1e-6, position_bound=1e-6)
    said = replace(check, options=tight).added_to(unfolding.summary())["warnings"]
    text = "\n".join(said)
    assert "the tetwild mesh's volume differs by" in text
    assert "the tetwild mesh's border lies up to" in text
    assert "the tetwild mesh places blocks" in text
    assert "the prism mesh" not in text
    where = ", ".join(f"{c:.6g}" for c in max(check.places, key=lambda p: p.max).worst)
    assert where.count(",") == 2


def test_blocks_that_a_mesh_does_not_hold_are_a_warning(check):
    lost = tuple(replace(p, outside=3) for p in check.places)
    assert "cross-check: the tetwild mesh does not hold 3 blocks" in (
        replace(check, places=lost).warnings
    )


def test_a_mesher_that_takes_too_long_is_a_row(unfolding):
    check = gu.crosscheck(unfolding, meshers="tetwild", interiors="harmonic", seconds=0.01)
    assert [mesh.error for mesh in check.meshes] == [
        "",
        "tetwild took longer than 0.01 s and was stopped",
    ]
    assert check.warnings == [
        "cross-check: no tetwild mesh: tetwild took longer than 0.01 s and was stopped"
    ]
    table = check.table
    assert table[["mesh", "interior"]].to_numpy().tolist() == [[PRISM, "harmonic"], ["tetwild", ""]]
    assert table.rms.isna().tolist() == [False, True]
    assert check.as_dict()["meshes"][1]["volume"] is None


def test_a_mesher_that_is_not_installed_is_named(unfolding, monkeypatch):
    monkeypatch.setattr("geounfold.comparison.crosscheck._meshes.find_spec", lambda _: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'geounfold\[tetgen\]'"):
        fill("tetgen", SURFACE, OPTIONS)
    check = gu.crosscheck(unfolding, meshers="tetwild", interiors="harmonic")
    assert check.meshes[1].error == "tetwild is not installed: pip install pytetwild"
    monkeypatch.setattr("geounfold.comparison.crosscheck._options.find_spec", lambda _: None)
    assert OPTIONS.chosen() == ("tetwild",)


@needs_tetgen
def test_runs_repeat_and_rows_order_changes_nothing(body, unfolding):
    rng = np.random.default_rng(11)
    chosen = {"meshers": "tetgen", "interiors": "harmonic"}
    once, again = (gu.crosscheck(unfolding, **chosen) for _ in range(2))
    assert once.differences["tetgen_harmonic"].tobytes() == (
        again.differences["tetgen_harmonic"].tobytes()
    )
    order = rng.permutation(len(body))
    mixed = gu.crosscheck(gu.unfold(body[order]), **chosen)
    # The frame of a body off a lattice is a mean over its rows, and rounds by their order: the
    # border then differs by 1e-10 blocks, and TetGen answers with other tetrahedra.  Measured
    # over 20 orders and 20 inputs moved by 1e-12 of the size, with OpenBLAS's Haswell and SkylakeX
    # kernels: 1.5e-13 to 3.9e-12 blocks by prisms; by TetGen 0.015 to 0.028 for the block that
    # moves most, and figures of 0.0199 to 0.0219.  The bounds are 25 times, twice and twice these.
    for name, apart in mixed.differences.items():
        bound = 1e-10 if name == "prism_harmonic" else 0.056
        assert apart == pytest.approx(once.differences[name][order], abs=bound)
    for one, other in zip(once.places, mixed.places, strict=True):
        assert other.rms == pytest.approx(one.rms, abs=1e-10 if one.mesh == PRISM else 0.004)


def test_options_are_checked():
    with pytest.raises(
        OptionError, match="meshers must be a list of one or more of tetwild, tetgen, but"
    ):
        CrossCheckOptions(meshers=("tetwild", "gmsh"))
    with pytest.raises(
        OptionError, match="interiors must be a list of one or more of harmonic, arap, but"
    ):
        CrossCheckOptions(interiors=())
    for name in ("edge", "envelope", "volume_bound", "position_bound", "seconds"):
        for value in (0.0, -1.0, np.nan, np.inf):
            with pytest.raises(OptionError, match=f"^{name} must be a number above 0, but is"):
                CrossCheckOptions(**{name: value})
