"""Flatteners on real fault surfaces and published benchmark meshes."""

from __future__ import annotations

import re

import numpy as np
import pytest

from geounfold.backends import igl as backend
from geounfold.comparison.flatteners import compare
from geounfold.errors import MeshError
from geounfold.flattening import (
    Stop,
    flatten,
    measures,
)
from geounfold.geometry.mesh import TriMesh
from tests.flattening.meshes import METHODS
from tests.places import shared


def read_tsurf(path):
    """Vertices and triangles of the largest part of a GOCAD surface."""
    lines = [line.split() for line in path.read_text().splitlines()]
    rows = [w for w in lines if w and w[0] in ("VRTX", "PVRTX")]
    index = {w[1]: k for k, w in enumerate(rows)}
    V = np.array([[float(x) for x in w[2:5]] for w in rows])
    F = np.array([[index[x] for x in w[1:4]] for w in lines if w and w[0] == "TRGL"])
    part = backend.face_components(F)
    return TriMesh(V, F).submesh(part == np.bincount(part).argmax())[0]


def read_obj(path):
    """Vertices and triangles of an OBJ file, polygons cut into fans."""
    lines = [line.split() for line in path.read_text().splitlines()]
    V = [[float(x) for x in w[1:4]] for w in lines if w and w[0] == "v"]
    faces = [[int(x.split("/")[0]) - 1 for x in w[1:]] for w in lines if w and w[0] == "f"]
    F = [[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)]
    return np.array(V), np.array(F)


def faults():
    """Files of the shared fault surfaces."""
    return sorted(shared("data", "scec_cfm").glob("*.ts"))


def benchmark(name):
    """A shared benchmark mesh."""
    return read_obj(shared("data", "param_bff", f"{name}.obj"))


@pytest.mark.parametrize("method", ["arap", "lscm", "spring"])
def test_every_real_fault_is_flattened_one_to_one(method):
    for path in faults():
        flat = flatten(read_tsurf(path), method)
        assert (flat.flips, flat.overlaps) == (0, 0), path.name


@pytest.mark.parametrize("method", ["scaf", "slim"])
def test_libigls_injective_methods_flatten_a_real_fault(method):
    flat = flatten(read_tsurf(min(faults(), key=lambda p: p.stat().st_size)), method)
    assert flat.one_to_one
    assert flat.area_error[-1] < 1e-3  # measured 4.6e-5


@pytest.mark.parametrize("method", [m for m in METHODS if m != "spring_dynamic"])
def test_hemisphere_is_flattened_one_to_one_and_keeps_its_strain(method):
    V, F = benchmark("hemisphere")
    flat = flatten((V, F), method)
    assert flat.one_to_one
    # Measured 0.117 (springs) to 0.202 (LSCM): a hemisphere has no flat image without strain.
    # A round border suits harmonic here.
    assert 0.11 < measures.edge_strain(V, F, flat.uv) < 0.21


@pytest.mark.slow
@pytest.mark.parametrize("method", ["arap", "lscm", "spring"])
@pytest.mark.parametrize("name", ["spothead", "face", "beetle"])
def test_benchmark_disks_are_one_to_one_or_a_row_that_says_why(name, method):
    row = compare(benchmark(name), method).iloc[0]
    if row.error:
        assert re.search(r"folded over|border edges overlap", row.error)
        assert "near" in row.error
    else:
        assert (row.flips, row.overlaps) == (0, 0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("punctured-torus", r"1 handle\(s\), so it cannot be laid flat: take out the faces"),
        ("inverted_triangles", r"not an oriented manifold.*first at vertex \d+"),
        ("teapot", "5 components"),
    ],
)
def test_benchmark_meshes_that_are_no_disk_are_refused(name, message):
    with pytest.raises(MeshError, match=message):
        flatten(benchmark(name))


def test_springs_flatten_every_real_fault_without_flips():
    for path in faults():
        flat = flatten(read_tsurf(path))
        assert flat.stop is Stop.CONVERGED, path.name
        assert flat.flips == 0, path.name
        assert flat.area_error[-1] < 0.01, path.name  # measured 2e-5 to 6.1e-3
