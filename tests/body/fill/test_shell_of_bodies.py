"""Solids whose surface cannot be the hull of their blocks: told why."""

from dataclasses import replace

from geounfold.body.fill import Shell, closed_shell
from geounfold.body.fill.shell_of_bodies import horizons_of_blocks, with_shells
from geounfold.body.prepare import prepare
from geounfold.geometry.mesh import TriMesh
from tests.body.fill.solids import ball
from tests.body.parts.bodies import fault
from tests.shapes import box as blocks


def shell() -> Shell:
    V, F = ball(16)
    return closed_shell(TriMesh(1e3 * V, F))


def test_a_surface_around_several_sheets_is_told():
    prepared, bodies = prepare(fault(throw=0.8).points, parts=True)
    bodies = with_shells(bodies, prepared, shell())
    assert "which goes around 2 sheet parts" in horizons_of_blocks(bodies, prepared, shell())
    assert horizons_of_blocks(bodies, prepared, None) == ""


def test_a_surface_that_becomes_the_horizons_is_not_told():
    prepared, bodies = prepare(blocks(24, 20, 5), parts=True)
    with_it = with_shells(bodies, prepared, shell())
    assert with_it[0].shell is not None
    assert horizons_of_blocks(with_it, prepared, shell()) == ""
    without = [replace(body, shell=None) for body in bodies]
    assert "an edge of four triangles" in horizons_of_blocks(without, prepared, shell())
