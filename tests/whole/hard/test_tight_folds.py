"""Folds that come close to themselves: hairpins, fans, sharp hinges, strips, tubes."""

from __future__ import annotations

import numpy as np
import pytest

import geounfold as gu
from geounfold.body.lattice import measure_lattice
from geounfold.errors import NoSheetError
from geounfold.geometry.measures import loop_turning
from geounfold.geometry.mesh import Floats, Ints
from geounfold.surfaces.hull import extract_hull
from geounfold.surfaces.split import split
from geounfold.synthetic import Bend, Body, FoldSpec, Profile, Sinusoid, simulate

OPEN = Profile(elements=(Sinusoid(amplitude=48, wavelength=640),))


def hinge(change: float, radius: float, at: float = 350, shape: str = "arc") -> Profile:
    return Profile(
        start=-change / 2, elements=(Bend(at=at, change=change, radius=radius, shape=shape),)
    )


def spec(
    profile: Profile, length: float = 700, width: float = 200, thickness: float = 80
) -> FoldSpec:
    return FoldSpec(
        description="tight", profile=profile, length=length, width=width, thickness=thickness
    )


FAN = Profile(
    elements=(
        Bend(at=200, change=105, radius=80),
        Bend(at=520, change=-210, radius=75),
        Bend(at=840, change=105, radius=80),
    )
)

# Of each: mean epsilon(W, Y), and RMS from the truth in blocks, as limits about 1.3 times what
# was measured.  Doing nothing scores epsilon 0.038 (strip), 0.069, 0.121, 0.201, and RMS
# of 6.6 blocks and more.  Before hulls were split by the pair of sides of largest extent, the
# strip, the hinge and the fan came out with epsilon at or above doing nothing, or not at all.
BODIES = {
    # measured 0.0016 and 0.18; 50 wide and 80 thick: its flanks are the larger pair of sides
    "strip": (spec(OPEN, length=820, width=50), 0.0022, 0.24),
    # measured 0.0031 and 0.24; radius 1.05 times the half thickness
    "hinge": (spec(hinge(-90, 42), width=160), 0.004, 0.31),
    # measured 0.0020 and 0.24; limbs overturned by 15 degrees
    "fan": (spec(FAN, length=1040, width=140), 0.0026, 0.32),
    # measured 0.0023 and 0.15; folded through 200 degrees, its ends cut 60 degrees off normal
    "hairpin": (spec(hinge(-200, 110)), 0.003, 0.2),
}


@pytest.mark.parametrize("name", BODIES)
def test_tight_folds_come_out_flat(name: str) -> None:
    recipe, error, distance = BODIES[name]
    body = simulate(recipe)
    u = gu.unfold(body.folded)
    assert u.certificate["injective"]
    assert u.outside_share == 0
    assert gu.epsilon(body.truth, u.points).mean() < error
    assert gu.aligned_rms(u.points, body.truth) / 10 < distance


def hull_faces(body: Body) -> tuple[gu.TriMesh, Floats]:
    """Return a body's hull in world coordinates, and how each face's outward normal lifts w.

    1 on the top's faces, -1 on the bottom's, between them on the rim.
    """
    lattice = measure_lattice(body.folded)
    assert lattice is not None
    hull = extract_hull(body.folded / 10, np.ones(3), "density").mesh
    corners = hull.V[hull.F]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outer, found = body.sheet.unfold(10 * (centre - 0.7 * normal))
    inner, also = body.sheet.unfold(10 * (centre - 1.0 * normal))
    lift = np.where(found & also, (outer - inner)[:, 2] / 3.0, 0.0)
    return hull, lift


# Limbs two blocks apart, once and twice, and a strip narrower than it is thick.  The pair of
# flanks, or one limb alone, has the lowest eigenvalue of the whole hull: by it 44 to 62 % of the
# first two's faces came out right.
@pytest.mark.parametrize(
    "recipe",
    [
        spec(hinge(-180, 50)),
        spec(
            Profile(
                start=90,
                elements=(
                    Bend(at=300, change=-180, radius=50, shape="arc"),
                    Bend(at=700, change=180, radius=50, shape="arc"),
                ),
            ),
            length=1000,
            width=140,
        ),
        spec(OPEN, length=820, width=50),
    ],
    ids=["hairpin", "double hairpin", "strip"],
)
def test_split_finds_top_and_bottom_of_close_limbs(recipe: FoldSpec) -> None:
    hull, lift = hull_faces(simulate(recipe))
    result = split(hull)
    top, bottom = lift > 0.95, lift < -0.95
    side = result.side * np.sign(result.side[top].sum())
    # Measured 0.997 and more of the faces; half of them by chance.
    assert (side[top] == 1).mean() > 0.98
    assert (side[bottom] == -1).mean() > 0.98
    # Flanks are separated from the sheet: measured 0.93 and more of the faces square to the layers.
    assert result.beyond[np.abs(lift) < 0.2].mean() > 0.85


def tube(radius: float, thickness: float, length: int) -> Floats:
    """Return blocks of side 1 in a closed tube around the y axis."""
    n = int(radius + thickness)
    axis = np.arange(-n, n) + 0.5
    x, y, z = np.meshgrid(axis, np.arange(length) + 0.5, axis, indexing="ij")
    wall = np.abs(np.hypot(x, z) - radius) < thickness / 2
    return np.stack([x[wall], y[wall], z[wall]], axis=1)


def test_tube_is_refused_for_what_it_is() -> None:
    with pytest.raises(NoSheetError, match=r"closes on itself around an axis.*without a cut") as e:
        gu.unfold(tube(14, 4, 24))
    assert e.value.exit_status == 2


def ring(inner: float, outer: float, rise: float, n: int = 48) -> tuple[Floats, Ints, list[Ints]]:
    """Return an annulus of two rings of vertices, ``rise`` apart, and its two loops."""
    angle = 2 * np.pi * np.arange(n) / n
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    V = np.concatenate(
        [
            np.column_stack([inner * circle, np.full(n, rise)]),
            np.column_stack([outer * circle, np.zeros(n)]),
        ]
    )
    k, next_ = np.arange(n), (np.arange(n) + 1) % n
    F = np.concatenate(
        [np.column_stack([k, k + n, next_ + n]), np.column_stack([k, next_ + n, next_])]
    )
    return V, F, [k, k + n]


# Gauss-Bonnet: a flat ring's loops turn by -2 pi and 2 pi, a cylinder's by 0; a cone's by the
# angle of its sector, here half of the whole.
@pytest.mark.parametrize(
    ("inner", "outer", "rise", "turning"),
    [(1.0, 2.0, 0.0, 2 * np.pi), (2.0, 2.0, 1.0, 0.0), (1.0, 2.0, np.sqrt(3.0), np.pi)],
    ids=["flat ring", "cylinder", "cone"],
)
def test_turning_tells_a_pierced_sheet_from_a_tube(
    inner: float, outer: float, rise: float, turning: float
) -> None:
    V, F, (first, second) = ring(inner, outer, rise)
    # 48 chords to a circle: angles are off by about (pi / 48)^2 of the turning, 0.4 %.
    assert loop_turning(V, F, second) == pytest.approx(turning, abs=0.03)
    assert loop_turning(V, F, first) == pytest.approx(-turning, abs=0.03)


def test_up_says_which_side_of_a_vertical_sheet_is_the_top() -> None:
    profile = Profile(start=90, elements=(Sinusoid(amplitude=30, wavelength=700),))
    body = simulate(spec(profile, length=600, width=160))
    # A heading of 90 degrees along +z has its top towards -x, which gravity cannot tell.
    errors = {}
    for name, up in (("true", (-1.0, 0.0, 0.0)), ("other", (1.0, 0.0, 0.0))):
        u = gu.unfold(body.folded, up=up)
        errors[name] = float(np.abs(u.stratigraphic - body.stratigraphic).mean())
    # Measured 0.006 of the thickness; the other way round is 1 minus it, off by 0.5 in the mean.
    assert errors["true"] < 0.01
    assert errors["other"] > 0.4
